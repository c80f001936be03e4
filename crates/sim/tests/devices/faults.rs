//! Each injected fault shows as the documented error or count.

use crate::common::{LIMITS, RunData, places, press_all, ready};
use skinrig_device::DeviceError;
use skinrig_formats::Decoder;
use skinrig_model::{
    BoxReport, CameraId, DeviceRole, HostTime, Polarity, RawChunk, RigFault, SimLevel,
    StreamFormat,
    pulse::{DecodedMarks, decode_marks},
};
use skinrig_sim::{Fault, FaultTrigger, LineNoise, SimConfig, simulated_rig};

fn with(level: SimLevel, fault: Fault) -> SimConfig {
    SimConfig {
        faults: vec![fault],
        ..SimConfig::new(4, level)
    }
}

fn from_start(fault: RigFault) -> Fault {
    Fault::new(fault, FaultTrigger::At(HostTime::ZERO)).unwrap()
}

#[test]
fn faults_of_other_rigs_are_refused() {
    let supported = |fault: RigFault| Fault::new(fault, FaultTrigger::At(HostTime::ZERO));
    let refused: Vec<&str> = RigFault::NAMES
        .iter()
        .filter_map(|(name, fault)| supported(*fault).is_err().then_some(*name))
        .collect();
    assert_eq!(refused, ["robot-power-lost", "disk-full", "killed"]);
    let error = supported(RigFault::Killed).unwrap_err().to_string();
    assert_eq!(
        error,
        "expected a fault that the simulated rig injects, found `killed`"
    );
}

fn failed(config: &SimConfig) -> DeviceError {
    let mut rig = simulated_rig(config);
    ready(&mut rig);
    match press_all(&mut rig, &places(3), &[5_000]) {
        Ok(_) => panic!("expected a fault"),
        Err(e) => e,
    }
}

#[test]
fn lost_indenter() {
    for when in [
        FaultTrigger::At(HostTime(700_000_000)),
        FaultTrigger::Contact(1),
    ] {
        let config = with(
            SimLevel::Kinematic,
            Fault::new(RigFault::RobotLost, when).unwrap(),
        );
        let mut rig = simulated_rig(&config);
        ready(&mut rig);
        let error = press_all(&mut rig, &places(3), &[5_000]).err();
        assert!(matches!(
            error,
            Some(DeviceError::Lost {
                role: DeviceRole::Indenter,
                ..
            })
        ));
        // It stays lost, also when disarmed.
        assert!(matches!(
            rig.indenter.disarm(),
            Err(DeviceError::Lost { .. })
        ));
    }
}

#[test]
fn slow_robot_is_late() {
    let off_at_hold = |faults: Vec<Fault>| {
        let config = SimConfig {
            faults,
            ..SimConfig::new(4, SimLevel::Kinematic)
        };
        let mut rig = simulated_rig(&config);
        ready(&mut rig);
        let take = press_all(&mut rig, &places(1), &[5_000]).unwrap();
        let s = take
            .samples
            .iter()
            .find(|s| s.t == HostTime(990_000_000))
            .unwrap();
        s.measured.distance_mm(s.commanded)
    };
    assert!(off_at_hold(vec![]) < 0.05);
    let when = FaultTrigger::At(HostTime::ZERO);
    assert!(off_at_hold(vec![Fault::new(RigFault::RobotSlow, when).unwrap()]) > 0.5);
}

#[test]
fn an_unplugged_camera_delivers_its_remaining_data() {
    let when = FaultTrigger::At(HostTime(400_000_000));
    let unplugged = Fault::new(RigFault::CameraUnplugged(CameraId::Two), when).unwrap();
    let config = with(SimLevel::Kinematic, unplugged);
    let mut rig = simulated_rig(&config);
    ready(&mut rig);
    rig.clock.wait_until(HostTime(1_000_000_000));
    let mut chunks: Vec<RawChunk> = Vec::new();
    let error = rig.cameras[1].poll(&mut chunks);
    assert!(matches!(
        error,
        Err(DeviceError::Lost {
            role: DeviceRole::Camera2,
            ..
        })
    ));
    let bytes: usize = chunks.iter().map(|c| c.bytes.len()).sum();
    assert!(
        bytes.abs_diff(100_000) < 600,
        "0.4 s of idle stream, found {bytes} bytes"
    );
    assert!(rig.cameras[1].start().is_err());
    rig.cameras[0].poll(&mut chunks).unwrap();
}

#[test]
fn lost_bytes_are_counted() {
    let when = FaultTrigger::At(HostTime(400_000_000));
    let camera = CameraId::One;
    let fault = Fault::new(RigFault::CameraDrops(camera), when).unwrap();
    let run = |config: &SimConfig| -> RunData {
        let mut rig = simulated_rig(config);
        ready(&mut rig);
        let mut take = press_all(&mut rig, &places(1), &[5_000]).unwrap();
        take.stop(&mut rig);
        take
    };
    let mut faulted = with(SimLevel::Geometric, fault);
    faulted.fault_sizes.lost_words = 1_234;
    let (complete, lossy) = (run(&SimConfig::new(4, SimLevel::Geometric)), run(&faulted));
    let (a, b) = (complete.bytes(camera), lossy.bytes(camera));
    assert_eq!(a.len(), b.len() + 4 * 1_234);
    let lost: Vec<(usize, u64)> = lossy.chunks[0]
        .iter()
        .enumerate()
        .filter(|(_, c)| c.lost_before > 0)
        .map(|(n, c)| (n, c.lost_before))
        .collect();
    assert_eq!(lost, [(1, 4 * 1_234)]);
    let gap = lossy.chunks[0][0].bytes.len();
    assert_eq!(a[..gap], b[..gap]);
    assert_eq!(a[gap + 4 * 1_234..], b[gap..]);
    assert_eq!(complete.bytes(CameraId::Two), lossy.bytes(CameraId::Two));
}

#[test]
fn a_lost_start_pulse_makes_one_train_of_one_camera_unreadable() {
    let fault = Fault::PulseLost {
        camera: CameraId::Two,
        train: 1,
        pulse: 0,
    };
    let mut rig = simulated_rig(&with(SimLevel::Kinematic, fault));
    ready(&mut rig);
    let mut take = press_all(&mut rig, &places(3), &[5_000]).unwrap();
    take.stop(&mut rig);
    let decoded = CameraId::ALL.map(|camera| {
        let (mut events, mut edges) = (Vec::new(), Vec::new());
        Decoder::new(StreamFormat::Evt2).push_cd(&take.bytes(camera), &mut events, &mut edges);
        let decoded = decode_marks(&edges);
        (decoded.marks.len(), decoded.stray_edges)
    });
    assert_eq!(decoded, [(3, 0), (2, 62)]);
}

#[test]
fn a_noisy_line_corrupts_no_mark_and_affects_only_one_camera() {
    let fault = from_start(RigFault::LineNoisy(CameraId::Two));
    let mut config = with(SimLevel::Kinematic, fault);
    config.fault_sizes.line_noise = LineNoise {
        lost_percent: 3,
        doubled_percent: 3,
        spurious_percent: 3,
    };
    let mut rig = simulated_rig(&config);
    ready(&mut rig);
    let mut take = press_all(&mut rig, &places(8), &[5_000]).unwrap();
    take.stop(&mut rig);
    let syncs: Vec<u32> = (0..12).collect();
    let decoded = CameraId::ALL.map(|camera| {
        let (mut events, mut edges) = (Vec::new(), Vec::new());
        Decoder::new(StreamFormat::Evt2).push_cd(&take.bytes(camera), &mut events, &mut edges);
        decode_marks(&edges)
    });
    let [clean, noisy] = &decoded;
    assert_eq!((clean.stray_edges, clean.lost_edges), (0, 0));
    assert_eq!(
        clean.syncs.iter().map(|s| s.count).collect::<Vec<_>>(),
        syncs
    );
    assert_eq!(clean.marks.len(), 8);
    assert!(noisy.stray_edges > 20 && noisy.lost_edges > 10, "{noisy:?}");
    let marks = |decoded: &DecodedMarks| decoded.marks.iter().map(|m| m.mark).collect::<Vec<_>>();
    assert!(marks(noisy).iter().all(|m| marks(clean).contains(m)));
    assert!(noisy.syncs.iter().all(|s| syncs.contains(&s.count)));
    assert!(noisy.marks.len() + noisy.syncs.len() >= 10, "{noisy:?}");
}

#[test]
fn the_box_reports_its_clock_its_trains_and_contacts() {
    let mut config = SimConfig::new(4, SimLevel::Kinematic);
    config.trigger_box.max_drift_ppm = 500.0;
    let mut rig = simulated_rig(&config);
    ready(&mut rig);
    let take = press_all(&mut rig, &places(2), &[5_000]).unwrap();
    let mut ties = Vec::new();
    let (mut marks, mut syncs, mut inputs) = (Vec::new(), Vec::new(), Vec::new());
    for report in &take.reports {
        match *report {
            BoxReport::Exchange { sent, received, at } => ties.push((sent.0, received.0, at.us)),
            BoxReport::Mark { mark, at } => marks.push((mark, at.us)),
            BoxReport::Sync { count, at } => syncs.push((count, at.us)),
            BoxReport::Input { rising, at } => inputs.push((rising, at.us)),
            BoxReport::Reset { .. } => panic!("no reset was planned"),
        }
    }
    // Nearly three seconds: an exchange every 0.1 s, each at least two delays wide.
    assert!((28..=30).contains(&ties.len()), "{}", ties.len());
    assert!(
        ties.iter()
            .all(|(sent, received, _)| received - sent >= 300_000)
    );
    assert_eq!(
        marks.iter().map(|m| m.0).collect::<Vec<_>>(),
        take.marks.iter().map(|m| m.mark).collect::<Vec<_>>()
    );
    assert_eq!(syncs.iter().map(|s| s.0).collect::<Vec<_>>(), [0, 1, 2]);
    assert!(
        syncs
            .windows(2)
            .all(|w| (w[1].1 - w[0].1).abs_diff(1_000_000) < 20_000),
        "{syncs:?}"
    );
    assert_eq!(
        inputs.iter().map(|i| i.0).collect::<Vec<_>>(),
        [true, false, true, false]
    );
    // The marks' box times agree with the host times according to the exchanges around them.
    for (sent, (_, at)) in take.marks.iter().zip(&marks) {
        let before = ties.iter().rev().find(|(_, _, us)| us <= at).copied();
        if let Some((low, high, us)) = before {
            let since_ns = (at - us) as i64 * 1_000;
            let slack = sent.uncertainty_ns + since_ns / 1_000 + 2_000;
            assert!(
                (low + since_ns - slack..=high + since_ns + slack).contains(&sent.t.0),
                "{sent:?}"
            );
        }
    }
}

#[test]
fn trigger_box_lost() {
    let error = failed(&with(
        SimLevel::Kinematic,
        Fault::new(RigFault::BoxSilent, FaultTrigger::Contact(0)).unwrap(),
    ));
    assert!(matches!(
        error,
        DeviceError::Lost {
            role: DeviceRole::TriggerBox,
            ..
        }
    ));
}

#[test]
fn settings_that_read_back_differently_are_errors() {
    let mut rig = simulated_rig(&with(
        SimLevel::Kinematic,
        from_start(RigFault::RobotSettingIgnored),
    ));
    assert!(matches!(
        rig.indenter.configure(&LIMITS),
        Err(DeviceError::ReadBack {
            role: DeviceRole::Indenter,
            ..
        })
    ));
    let mut rig = simulated_rig(&with(
        SimLevel::Kinematic,
        from_start(RigFault::CameraSettingIgnored(CameraId::Two)),
    ));
    let settings = rig.camera_settings.clone();
    rig.cameras[0].configure(&settings[0]).unwrap();
    assert!(matches!(
        rig.cameras[1].configure(&settings[1]),
        Err(DeviceError::ReadBack {
            role: DeviceRole::Camera2,
            ..
        })
    ));
}

#[test]
fn dead_press_gives_background_only() {
    let fault = Fault::DeadPress {
        camera: CameraId::One,
        contact: 1,
    };
    let mut config = with(SimLevel::Geometric, fault);
    config.geometric.dead_share = 0.0;
    let mut rig = simulated_rig(&config);
    ready(&mut rig);
    let mut take = press_all(&mut rig, &places(3), &[5_000]).unwrap();
    take.stop(&mut rig);
    let presses = |camera: CameraId| -> Vec<usize> {
        let (mut events, mut edges) = (Vec::new(), Vec::new());
        Decoder::new(StreamFormat::Evt2).push_cd(&take.bytes(camera), &mut events, &mut edges);
        let zero = decode_marks(&edges).marks[0].t_us;
        (0..3u64)
            .map(|n| {
                let from = zero + n * 1_500_000 + 100_000;
                events
                    .iter()
                    .filter(|e| (from..from + 250_000).contains(&e.t_us))
                    .filter(|e| e.polarity == Polarity::Off && (185..=360).contains(&e.y))
                    .count()
            })
            .collect()
    };
    let (one, two) = (presses(CameraId::One), presses(CameraId::Two));
    assert!(one[1] * 3 < one[0] && one[1] * 3 < one[2], "{one:?}");
    assert!(two.iter().all(|&n| n > 1_200), "{two:?}");
}

#[test]
fn the_set_point_keeps_the_configured_acceleration() {
    // (limit, largest found), mm/s².
    let found = [40.0, 500.0].map(|limit| {
        let mut rig = simulated_rig(&SimConfig::new(4, SimLevel::Kinematic));
        let limits = skinrig_device::MotionLimits {
            max_acceleration_mm_s2: limit,
            ..LIMITS
        };
        rig.indenter.configure(&limits).unwrap();
        rig.indenter.arm().unwrap();
        let to = rig
            .robot_from_skin
            .apply(skinrig_model::Point3::new(20.0, 0.0, 20.0));
        rig.indenter.command(to, 30.0).unwrap();
        let until = rig.clock.now() + skinrig_model::HostDuration::from_millis(2_000);
        rig.clock.wait_until(until);
        let mut samples = Vec::new();
        rig.indenter.poll(&mut samples).unwrap();
        let z: Vec<f64> = samples.iter().map(|s| s.commanded.x_mm).collect();
        let bends = z.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs() * 1e6);
        (limit, bends.fold(0.0, f64::max))
    });
    for (limit, largest) in found {
        assert!(
            largest <= limit * 1.001 && largest > limit * 0.3,
            "{found:?}"
        );
    }
}

#[test]
fn too_much_force_stops_the_robot() {
    let config = SimConfig::new(4, SimLevel::Kinematic);
    let mut rig = simulated_rig(&config);
    let soft = skinrig_device::MotionLimits {
        max_force_n: 0.5,
        ..LIMITS
    };
    rig.indenter.configure(&soft).unwrap();
    rig.indenter.arm().unwrap();
    let up = rig.robot_from_skin;
    let at = |z: f64| up.apply(skinrig_model::Point2::new(10.0, 2.0).at_height(z));
    rig.indenter.command(at(-3.0), 20.0).unwrap();
    rig.clock.wait_until(HostTime(3_000_000_000));
    let mut samples = Vec::new();
    rig.indenter.poll(&mut samples).unwrap();
    let deepest = samples
        .iter()
        .map(|s| s.measured.z_mm)
        .fold(f64::MAX, f64::min);
    assert!(deepest > at(-1.8).z_mm, "continued to press to {deepest}");
    assert!(matches!(
        rig.indenter.command(at(-3.0), 20.0),
        Err(DeviceError::Refused { .. })
    ));
    rig.indenter.command(at(5.0), 20.0).unwrap();
    rig.indenter.command(at(4.0), 20.0).unwrap();
}

#[test]
fn overflowing_data_is_lost_and_counted() {
    let after = |buffer_bytes: usize, looks: i64| {
        let mut config = SimConfig::new(4, SimLevel::Geometric);
        config.camera_clock.buffer_bytes = buffer_bytes;
        let mut rig = simulated_rig(&config);
        ready(&mut rig);
        let mut chunks: Vec<RawChunk> = Vec::new();
        for look in 1..=looks {
            rig.clock.wait_until(HostTime(1_000_000_000 * look / looks));
            rig.cameras[0].flush(&mut chunks).unwrap();
        }
        let bytes: u64 = chunks.iter().map(|c| c.bytes.len() as u64).sum();
        let lost: u64 = chunks.iter().map(|c| c.lost_before).sum();
        (bytes, lost)
    };
    let (all, none) = after(64 << 20, 1);
    assert_eq!(none, 0);
    assert_eq!(after(64 << 10, 100), (all, 0), "fetched often enough");
    let (kept, lost) = after(64 << 10, 1);
    assert!(lost > 0 && kept <= 64 << 10, "{kept} kept, {lost} lost");
    assert_eq!(kept + lost, all);
}
