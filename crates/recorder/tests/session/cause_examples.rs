//! An example of every cause that a session can hold.

use skinrig_model::*;

pub(crate) const SERIAL: &str = "A 1";

fn point() -> Point3<Skin> {
    Point3::new(0.1, 1.0 / 3.0, -2.0)
}

fn not_arrived(force_n: f64) -> NotArrived {
    NotArrived {
        what: "approach".to_owned(),
        tolerance_mm: 0.05,
        target: point(),
        allowed: HostDuration::from_millis(500),
        max_force_n: 8.0,
        found: Some(Box::new(PoseSample {
            t: HostTime(7),
            commanded: point(),
            measured: point(),
            force_n,
        })),
    }
}

fn suspension(camera: Option<CameraId>, quantity: WatchedQuantity) -> Suspension {
    Suspension {
        camera,
        quantity,
        trip: 1e6,
        found: 2.5e6,
    }
}

fn device_errors() -> Vec<DeviceError> {
    let (role, serial) = (DeviceRole::Camera2, SERIAL.to_owned());
    let text = |text: &str| text.to_owned();
    vec![
        DeviceError::Lost {
            role,
            serial: serial.clone(),
            detail: text("unplugged"),
        },
        DeviceError::Silent {
            role,
            serial: serial.clone(),
            doing: "poll".into(),
            within: HostDuration::from_millis(250),
        },
        DeviceError::Pending {
            role,
            serial: serial.clone(),
            doing: "poll".into(),
        },
        DeviceError::ReadBack {
            role,
            serial: serial.clone(),
            name: text("bias_fo"),
            expected: text("1"),
            found: text("2"),
        },
        DeviceError::Refused {
            role,
            serial: serial.clone(),
            expected: text("less"),
            found: text("more"),
        },
        DeviceError::State {
            role,
            serial,
            expected: text("armed"),
            found: text("not armed"),
        },
        DeviceError::Diverged {
            role,
            at: text("command 3"),
            expected: text("a"),
            found: text("b"),
        },
    ]
}

pub(crate) fn trips() -> Vec<WatchdogTrip> {
    let t = HostTime(5);
    vec![
        WatchdogTrip::Force {
            limit_n: 8.0,
            found_n: f64::INFINITY,
            t,
        },
        WatchdogTrip::Depth {
            limit_mm: 3.0,
            found_mm: 3.1,
            t,
        },
        WatchdogTrip::Speed {
            limit_mm_s: 100.0,
            found_mm_s: 1.0 / 3.0,
            t,
        },
        WatchdogTrip::Feedback {
            expected: "finite coordinates".to_owned(),
            found: "[NaN, 0.0, 0.0] at 1 s".to_owned(),
        },
        WatchdogTrip::Stale {
            limit: HostDuration::from_millis(100),
            found: HostDuration::from_millis(200),
        },
        WatchdogTrip::Late {
            limit: HostDuration::from_millis(100),
            found: HostDuration::from_millis(200),
        },
    ]
}

fn guard_errors() -> Vec<GuardError> {
    let (limit_mm, found_mm, height_mm) = (3.0, 3.5, -0.1);
    let mut all = vec![
        GuardError::NotFinite {
            found: "[NaN, 0.0, 0.0] at 1 mm/s".to_owned(),
        },
        GuardError::Speed {
            limit_mm_s: 1.0,
            found_mm_s: 2.0,
        },
        GuardError::Workspace {
            axis: 'z',
            min_mm: 0.0,
            max_mm: 1.0,
            found_mm: 2.0,
        },
        GuardError::Depth { limit_mm, found_mm },
        GuardError::Floor { limit_mm, found_mm },
        GuardError::Lateral {
            clearance_mm: 5.0,
            lateral_mm: 0.2,
            height_mm,
        },
        GuardError::Outline {
            outside_mm: 0.3,
            height_mm,
        },
        GuardError::KeepOut {
            name: "lamp".to_owned(),
            margin_mm: 1.0,
            found_mm: 0.5,
        },
        GuardError::StalePose {
            limit: HostDuration::from_millis(100),
            found: "none".to_owned(),
        },
        GuardError::NotArmed,
    ];
    all.extend(trips().into_iter().map(GuardError::Tripped));
    all
}

fn touch_faults() -> Vec<TouchFault> {
    vec![
        TouchFault::NoForce {
            during: TouchPhase::Tare,
        },
        TouchFault::NoForce {
            during: TouchPhase::Search,
        },
        TouchFault::ShortTare(HostDuration::from_millis(100)),
        TouchFault::Late(not_arrived(2.0)),
        TouchFault::NotFound {
            band_mm: 1.0,
            lowest: Some(point()),
        },
        TouchFault::ImmediateContact {
            band_mm: 1.0,
            height_mm: 0.9,
        },
        TouchFault::TooLow {
            depth_mm: 2.0,
            max_depth_mm: 3.0,
            height_mm: -1.5,
        },
    ]
}

/// One fault of each kind, but the end of the run.
fn press_faults() -> Vec<PressFault> {
    let camera = CameraId::One;
    let mut all = vec![
        PressFault::DataLost { camera, bytes: 64 },
        PressFault::NoData { camera },
        PressFault::DataLate {
            camera,
            end: HostTime(9),
            waited: HostDuration::from_millis(250),
            reached: None,
        },
        PressFault::EventStorm {
            camera,
            level_ev_s: 1e6,
            found_ev_s: 2e6,
        },
        PressFault::MotionLate(not_arrived(2.0)),
        PressFault::ClearLate {
            allowed: HostDuration::from_millis(500),
            found: HostDuration::from_millis(600),
        },
        PressFault::PushedAside {
            tolerance_mm: 0.05,
            target: point(),
            found: None,
        },
        PressFault::Paused,
        PressFault::Suspended(suspension(Some(camera), WatchedQuantity::Storm)),
        PressFault::Timing(TimingFault::OutOfOrder([3, 2, 1, 4, 5, 6].map(HostTime))),
        PressFault::Timing(TimingFault::NoHold),
        PressFault::Timing(TimingFault::Hold {
            tolerance_mm: 0.05,
            target: point(),
            found: point(),
        }),
    ];
    use PressMoment as M;
    let moments = [
        M::Approach,
        M::Contact,
        M::AtDepth,
        M::Retract,
        M::Release,
        M::Clear,
    ];
    all.extend(moments.map(|m| PressFault::Timing(TimingFault::Missing(m))));
    all.extend(touch_faults().into_iter().map(PressFault::Touch));
    all
}

/// One fault of each kind.
fn run_faults() -> Vec<RunFault> {
    let text = |text: &str| text.to_owned();
    let camera = CameraId::Two;
    let mut all = vec![
        RunFault::Sink(SinkFault::Rejected(text("disk full"))),
        RunFault::Sink(SinkFault::Delayed(text("disk slow"))),
        RunFault::Plan {
            place: text("step 1"),
            expected: text("a"),
            found: text("b"),
        },
        RunFault::Rig {
            place: text("indenter"),
            expected: text("a"),
            found: text("b"),
        },
        RunFault::Surface {
            failed: Causes::try_from(vec![
                SurfaceFault {
                    at: Point2::new(1.0, 2.0),
                    after: None,
                    tolerance_mm: 0.3,
                    found: SurfaceFinding::HeightMm(0.4),
                },
                SurfaceFault {
                    at: Point2::new(1.0, 2.0),
                    after: Some(RepetitionId::from_index(2)),
                    tolerance_mm: 0.3,
                    found: SurfaceFinding::NotFound(TouchFault::NoForce {
                        during: TouchPhase::Search,
                    }),
                },
            ])
            .unwrap(),
        },
        RunFault::InvalidInARow {
            limit: 5,
            faults: Causes::try_from(press_faults()).unwrap(),
        },
        RunFault::Preflight {
            failed: vec![
                PreflightCheck::new("disk", "1 GB", "none", false, "free some")
                    .about(CheckKind::ReadBack(DeviceRole::Camera1)),
            ],
        },
        RunFault::PoseStream {
            expected: text("forces"),
            found: text("none"),
        },
        RunFault::NotArrived(not_arrived(f64::NEG_INFINITY)),
        RunFault::ChunkOrder {
            camera,
            expected: 3,
            found: u64::MAX,
        },
        RunFault::NotAtRest(NotAtRest::NotClear),
        RunFault::NotAtRest(NotAtRest::NotDisarmed),
        RunFault::Halted,
        RunFault::ClockStep {
            camera,
            limit: HostDuration::from_millis(250),
            found: HostDuration::from_millis(300),
        },
        RunFault::Suspended {
            suspension: suspension(None, WatchedQuantity::Disk),
            limit: HostDuration::from_secs_f64(600.0),
        },
        RunFault::Stopped(StopReason::Stop),
        RunFault::Stopped(StopReason::Halt),
        RunFault::Internal(text("panic: x")),
        RunFault::Recorded { text: text("x; y") },
    ];
    all.extend(device_errors().into_iter().map(RunFault::Device));
    all.extend(trips().into_iter().map(RunFault::Watchdog));
    all.extend(guard_errors().into_iter().map(RunFault::Guard));
    all
}

/// The lists above are complete: a new variant does not compile here until it has a number, and then needs an example.
pub(crate) fn check_examples() {
    fn run(fault: &RunFault) -> usize {
        match fault {
            RunFault::Device(_) => 0,
            RunFault::Sink(_) => 1,
            RunFault::Guard(_) => 2,
            RunFault::Plan { .. } => 3,
            RunFault::Rig { .. } => 4,
            RunFault::Surface { .. } => 5,
            RunFault::InvalidInARow { .. } => 6,
            RunFault::Preflight { .. } => 7,
            RunFault::PoseStream { .. } => 8,
            RunFault::NotArrived(_) => 9,
            RunFault::Watchdog(_) => 10,
            RunFault::ChunkOrder { .. } => 11,
            RunFault::NotAtRest(_) => 12,
            RunFault::Halted => 13,
            RunFault::ClockStep { .. } => 14,
            RunFault::Suspended { .. } => 15,
            RunFault::Stopped(_) => 16,
            RunFault::Internal(_) => 17,
            RunFault::Recorded { .. } => 18,
        }
    }
    fn device(error: &DeviceError) -> usize {
        match error {
            DeviceError::Lost { .. } => 0,
            DeviceError::Silent { .. } => 1,
            DeviceError::Pending { .. } => 2,
            DeviceError::ReadBack { .. } => 3,
            DeviceError::Refused { .. } => 4,
            DeviceError::State { .. } => 5,
            DeviceError::Diverged { .. } => 6,
        }
    }
    fn guard(error: &GuardError) -> usize {
        match error {
            GuardError::NotFinite { .. } => 0,
            GuardError::Speed { .. } => 1,
            GuardError::Workspace { .. } => 2,
            GuardError::Depth { .. } => 3,
            GuardError::Floor { .. } => 4,
            GuardError::Lateral { .. } => 5,
            GuardError::Outline { .. } => 6,
            GuardError::KeepOut { .. } => 7,
            GuardError::StalePose { .. } => 8,
            GuardError::Tripped(_) => 9,
            GuardError::NotArmed => 10,
        }
    }
    fn press(fault: &PressFault) -> usize {
        match fault {
            PressFault::DataLost { .. } => 0,
            PressFault::NoData { .. } => 1,
            PressFault::DataLate { .. } => 2,
            PressFault::EventStorm { .. } => 3,
            PressFault::MotionLate(_) => 4,
            PressFault::ClearLate { .. } => 5,
            PressFault::PushedAside { .. } => 6,
            PressFault::Paused => 7,
            PressFault::Suspended(_) => 8,
            PressFault::Timing(_) => 9,
            PressFault::Touch(_) => 10,
            // Its example is built from the end of a run.
            PressFault::RunEnded(_) => 11,
        }
    }
    fn complete<T>(all: &[T], number: fn(&T) -> usize, variants: usize) {
        let numbers: std::collections::BTreeSet<usize> = all.iter().map(number).collect();
        assert!(numbers.into_iter().eq(0..variants));
    }
    complete(&run_faults(), run, 19);
    complete(&device_errors(), device, 7);
    complete(&guard_errors(), guard, 11);
    complete(&press_faults(), press, 11);
}

pub(crate) fn ended_run() -> RunEnd {
    RunEnd::Faulted(Causes::try_from(run_faults()).unwrap())
}

/// One of each reason of a verdict but `Valid` that an attempt may have.
pub(crate) fn verdicts() -> Vec<PressVerdict> {
    let invalid = |faults: Vec<PressFault>| {
        PressVerdict::Invalid(InvalidReason::Faults(Causes::try_from(faults).unwrap()))
    };
    let mut cut_off = vec![PressFault::RunEnded(ended_run())];
    cut_off.extend(press_faults());
    vec![
        invalid(press_faults()),
        invalid(cut_off),
        PressVerdict::cut_off(3),
        PressVerdict::Invalid(InvalidReason::Recorded {
            text: "of an older session".to_owned(),
            kinds: vec![PressFaultKind::Late],
            is_cut_off: true,
        }),
        PressVerdict::Excluded(ExcludedReason::NotUsed {
            presses_used: "[1, 2]".to_owned(),
        }),
        PressVerdict::Excluded(ExcludedReason::Recorded {
            text: "by hand".to_owned(),
        }),
    ]
}

/// The end of a campaign whose question is decided.
pub(crate) fn decided() -> RunEnd {
    RunEnd::Stopped(StopReason::Decided(Box::new(Look {
        number: 2,
        declared: 7,
        repetition: RepetitionId::from_index(2),
        presses: 162,
        attempted: Some(180),
        metric: StopMetric::Median,
        question: StopQuestion::NarrowerThan(0.3),
        alpha: 0.05 / 7.0,
        value_mm: 0.1 + 0.2,
        low_mm: Some(1.0 / 3.0),
        high_mm: None,
        answer: Some(StopAnswer::Narrow),
    })))
}

pub(crate) fn missed() -> Vec<MissedReason> {
    vec![
        MissedReason::RunEnded(ended_run()),
        MissedReason::RunEnded(RunEnd::Stopped(StopReason::Abort)),
        MissedReason::RunEnded(decided()),
        MissedReason::NeverAttempted,
        MissedReason::Recorded {
            text: "of an older session".to_owned(),
        },
    ]
}

pub(crate) fn interruptions() -> Vec<(InterruptionKind, InterruptionReason)> {
    use {InterruptionKind as K, InterruptionReason as R};
    let disk = suspension(None, WatchedQuantity::Disk);
    vec![
        (K::Pause, R::Pause),
        (K::PauseNow, R::PauseNow),
        (K::Resume, R::Resume),
        (K::Pause, R::Suspended(disk)),
        (K::Resume, R::Calm(disk)),
        (K::Stop, R::End(RunEnd::Stopped(StopReason::Stop))),
        (K::Fault, R::End(ended_run())),
        (
            K::Pause,
            R::Recorded {
                text: "of an older session".to_owned(),
            },
        ),
        (K::Stop, R::End(decided())),
    ]
}
