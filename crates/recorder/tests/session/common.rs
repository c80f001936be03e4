//! A small session with every kind of record, and a minimal EVT2 scanner.

use std::path::Path;

use sha2::{Digest, Sha256};
use skinrig_model::press::PressRole;
use skinrig_model::*;
use skinrig_recorder::{ChunkScanner, SealedSession, SessionWriter};
use sqlx::ConnectOptions;
use sqlx::sqlite::{SqliteConnectOptions, SqliteConnection};

/// EVT2 without wraps: enough to recompute facts.
#[derive(Default)]
pub(crate) struct Evt2 {
    base: Option<u64>,
    origin_us: u64,
}

impl ChunkScanner for Evt2 {
    fn new(_format: StreamFormat) -> Self {
        Self::default()
    }

    fn restart(&mut self, origin_us: u64) {
        self.base = None;
        self.origin_us = origin_us;
    }

    fn lost(&mut self, _bytes: u64) {
        self.base = None;
    }

    fn scan(&mut self, bytes: &[u8]) -> (ChunkFacts, Vec<TriggerEdge>) {
        let Self { base, origin_us } = self;
        let (mut facts, mut edges) = (ChunkFacts::default(), Vec::new());
        for word in bytes.as_chunks::<4>().0 {
            let w = u32::from_le_bytes(*word);
            if w >> 28 == 8 {
                *base = Some(*origin_us + (u64::from(w & 0x0FFF_FFFF) << 6));
            }
            let Some(base) = *base else { continue };
            let t = if w >> 28 == 8 {
                base
            } else {
                base + u64::from(w >> 22 & 63)
            };
            match w >> 28 {
                8 => {}
                kind @ (0 | 1) => {
                    facts.cd_events += 1;
                    facts.on_events += u64::from(kind);
                }
                0xA => {
                    facts.trigger_edges += 1;
                    let (channel, rising) = ((w >> 8 & 31) as u8, w & 1 == 1);
                    edges.push(TriggerEdge {
                        t_us: t,
                        channel,
                        rising,
                    });
                }
                _ => continue,
            }
            facts.first_us.get_or_insert(t);
            facts.last_us = Some(t);
        }
        (facts, edges)
    }
}

pub(crate) const ALIGNMENT_US: u64 = 5_000_000;

/// 20 ms of one camera from `t0_us` on: a time word every 16 µs, an event now and then, a trigger pulse.
pub(crate) fn stream(t0_us: u64, events: u64) -> Vec<u8> {
    let mut words = Vec::new();
    for k in 0..1250u64 {
        let t = t0_us + 16 * k;
        words.push(0x8000_0000 | (t >> 6) as u32);
        if events > 0 && k % (1250 / events).max(1) == 0 {
            let (x, y) = ((k % 640) as u32, (k % 480) as u32);
            words.push(((k % 2) as u32) << 28 | ((t & 63) as u32) << 22 | x << 11 | y);
        }
        if k == 100 || k == 110 {
            words.push(0xA << 28 | ((t & 63) as u32) << 22 | u32::from(k == 100));
        }
    }
    words.into_iter().flat_map(u32::to_le_bytes).collect()
}

pub(crate) fn sha(text: &str) -> String {
    Sha256::digest(text.as_bytes())
        .iter()
        .map(|b| format!("{b:02x}"))
        .collect()
}

pub(crate) fn header(presses: u32) -> RunHeader {
    let (protocol, plan) = ("name: test # äöü\n", "{\"version\":1}");
    RunHeader {
        protocol_text: protocol.into(),
        protocol_name: "test.yaml".into(),
        protocol_sha256: sha(protocol),
        overrides: vec!["path.pitch=6 mm".into(), "a=\"b\"".into()],
        plan_json: plan.into(),
        plan_sha256: sha(plan),
        seed: u64::MAX,
        rig_kind: "simulated".into(),
        rig_name: "simulated (test)".into(),
        rig_json: "{}".into(),
        robot_from_skin: RigidTransform::new(
            [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
            [0.1, 1.0 / 3.0, -7.0],
        ),
        stream_formats: [StreamFormat::Evt2; 2],
        prototype: "P1".into(),
        operator: "tester".into(),
        started_at: "2026-01-02T03:04:05Z".into(),
        host: "bench".into(),
        software: "0.1.0".into(),
        command_line: "skinrig run".into(),
        presses: (0..presses)
            .map(|i| PlannedPress {
                id: PressId::from_index(i),
                role: if i == 0 {
                    PressRole::Sync
                } else {
                    PressRole::Score
                },
                repetition: RepetitionId::default(),
                location: LocationId::from_index(i.saturating_sub(1)),
                at: Point2::new(f64::from(i) * 0.1, -4.0),
                depth_mm: 2.0,
            })
            .collect(),
    }
}

pub(crate) fn outcome(attempt: AttemptId, t: i64, verdict: PressVerdict) -> PressOutcome {
    let at = |ms: i64| HostTime(t + ms * 1_000_000);
    PressOutcome {
        attempt,
        verdict,
        timing: Some(PressTiming {
            approach: at(1),
            contact: at(4),
            at_depth: at(8),
            retract: at(12),
            release: at(15),
            clear: at(19),
        }),
        measured_at: Some(Point2::new(1.0 / 3.0, -4.0)),
        measured_depth_mm: Some(1.99),
        touched_mm: Some(-0.012),
        peak_force_n: None,
        scheduled: false,
    }
}

/// Height of the tip so many milliseconds after the start of an attempt: what [`outcome`] states follows from it.
fn height_mm(ms: i64) -> f64 {
    match ms {
        ..=3 | 16.. => 5.0,
        4 => -1e-4,
        14 => -2.0,
        15 => 1e-4,
        _ => -2.002,
    }
}

/// The set point rises with the retraction.
fn set_point(target: Point3<Skin>, ms: i64) -> Point3<Skin> {
    let rise_mm = if ms < 12 { 0.0 } else { 5.0 };
    Point3::new(target.x_mm, target.y_mm, target.z_mm + rise_mm)
}

/// One report of each kind; the reset comes first, where it separates nothing.
fn box_reports(mark: Mark, t: HostTime, k: u64) -> Vec<BoxReport> {
    let at = |us: u64| BoxTime {
        us: 7_000_000 + 20_000 * k + us,
    };
    vec![
        BoxReport::Reset { noticed: t },
        BoxReport::Exchange {
            sent: t,
            received: t + HostDuration::from_millis(1),
            at: at(400),
        },
        BoxReport::Mark { mark, at: at(500) },
        BoxReport::Sync {
            count: (1 << 17) - 1 - k as u32,
            at: at(9_000),
        },
        BoxReport::Input {
            rising: k.is_multiple_of(2),
            at: at(9_500),
        },
    ]
}

/// The end of [`records`].
pub(crate) const fn stopped() -> RunEnd {
    RunEnd::Stopped(StopReason::Stop)
}

/// A transient fault and one of the place.
fn not_settled() -> InvalidReason {
    let faults = vec![
        PressFault::DataLost {
            camera: CameraId::One,
            bytes: 64,
        },
        PressFault::Timing(TimingFault::NoHold),
    ];
    InvalidReason::Faults(Causes::try_from(faults).unwrap())
}

/// All records of a run of `presses` presses of 20 ms each; the last but one needs two attempts, the last is missed.
pub(crate) fn records(presses: u32) -> Vec<Record> {
    let mut out = vec![Record::Started(Box::new(header(presses)))];
    let mut ids: Vec<AttemptId> = (0..presses - 1)
        .map(|i| AttemptId {
            press: PressId::from_index(i),
            number: 1,
        })
        .collect();
    ids.push(AttemptId {
        press: PressId::from_index(presses - 2),
        number: 2,
    });
    let t = attempts(&ids, &mut out);
    out.push(Record::Interruption {
        kind: InterruptionKind::Stop,
        t,
        reason: InterruptionReason::End(stopped()),
    });
    out.push(Record::Note {
        t,
        text: "tip cleaned".into(),
    });
    out.extend(touches().map(Record::Touch));
    let last = AttemptId {
        press: PressId::from_index(presses - 1),
        number: 1,
    };
    out.push(Record::Missed(last, MissedReason::RunEnded(stopped())));
    out.push(Record::Ended { t, end: stopped() });
    out.extend(notifications().map(|n| Record::Notification(Box::new(n))));
    out
}

/// Touches felt in [`records`]: one with everything, one between presses.
pub(crate) fn touches() -> [TouchEstimate; 2] {
    let full = TouchEstimate {
        t: HostTime(12_345_678),
        until: HostTime(9_000_000),
        until_sd_ns: 1_500,
        kind: TouchKind::Stopped,
        attempt: Some(AttemptId {
            press: PressId::from_index(1),
            number: 1,
        }),
        at_mm: Some([1.0 / 3.0, -4.5]),
        region: Some(TouchRegion {
            semi_axes_mm: [2.5, 1.0 / 7.0],
            angle_deg: -31.25,
        }),
        depth: Some(TouchDepth {
            mm: 1.0 / 9.0,
            within_mm: 0.25,
        }),
        llr: Some(12.75),
    };
    let skipped = TouchEstimate {
        kind: TouchKind::Skipped,
        attempt: None,
        at_mm: None,
        region: None,
        depth: None,
        llr: None,
        ..full
    };
    [full, skipped]
}

/// Messages about the end of [`records`]: one sent, one not.
pub(crate) fn notifications() -> [Notification; 2] {
    let sent = Notification {
        channel: NotificationChannel::Mail,
        occasion: Occasion::Stop,
        subject: "run stopped".into(),
        raised_at: "2026-01-02T03:05:00Z".into(),
        ended_at: "2026-01-02T03:05:01Z".into(),
        tries: 1,
        fault: None,
    };
    let failed = Notification {
        channel: NotificationChannel::Webhook,
        tries: 3,
        fault: Some(NotificationFault::TimedOut {
            server: "hooks.example.org:443".into(),
            limit_s: 5,
        }),
        ..sent.clone()
    };
    [sent, failed]
}

/// All records of a further leg that makes the sync press again and every press that has no valid attempt: its clocks and its
/// chunk numbers start again.
pub(crate) fn further_leg(known: &[PressHistory]) -> Vec<Record> {
    let mut out = vec![Record::Resumed(Box::new(ResumeHeader {
        operator: "another tester".into(),
        started_at: "2026-01-03T03:04:05Z".into(),
        host: "bench".into(),
        software: "0.1.0".into(),
        command_line: "skinrig resume".into(),
    }))];
    let ids: Vec<AttemptId> = (0u32..)
        .zip(known)
        .filter(|(press, history)| *press == 0 || history.verdict != Some(PressVerdict::Valid))
        .map(|(press, history)| AttemptId {
            press: PressId::from_index(press),
            number: history.attempts + 1,
        })
        .collect();
    let t = attempts(&ids, &mut out);
    out.push(Record::Ended {
        t,
        end: RunEnd::Completed,
    });
    out
}

/// Devices, preflight and these attempts in turn, the last at each press valid, from time zero on; returns the end.
fn attempts(ids: &[AttemptId], out: &mut Vec<Record>) -> HostTime {
    let mut scanners = <[Evt2; 2]>::default();
    for (role, setting) in [
        (DeviceRole::Indenter, "speed"),
        (DeviceRole::Camera1, "bias_fo"),
    ] {
        out.push(Record::Device {
            role,
            identity: DeviceIdentity {
                model: "simulated".into(),
                serial: "1".into(),
                firmware: "2".into(),
            },
            settings: vec![Setting {
                name: setting.into(),
                requested: "5".into(),
                read_back: "5".into(),
            }],
        });
    }
    out.push(Record::Preflight(vec![
        PreflightCheck::new("disk", "1 GB", "2 GB", true, ""),
        PreflightCheck::new("clock", "advancing", "no time", false, "power-cycle it"),
        PreflightCheck::skipped("retouch", "a touch", "not asked for"),
    ]));
    for (k, id) in (0u64..).zip(ids) {
        let t = HostTime(k as i64 * 20_000_000);
        out.push(Record::Intent { attempt: *id, t });
        let target = Point3::new(0.1, 0.2, 5.0);
        out.push(Record::Command {
            t,
            command: MotionCommand {
                target,
                speed_mm_s: 20.0,
            },
        });
        let mark = Mark {
            kind: MarkKind::Contact,
            press: id.press,
        };
        out.push(Record::MarkSent(SentMark {
            mark,
            t,
            uncertainty_ns: 50,
        }));
        out.push(Record::BoxReports {
            t,
            reports: box_reports(mark, t, k),
        });
        for camera in CameraId::ALL {
            let bytes = stream(ALIGNMENT_US + k * 20_000, 5 + 300 * (k % 2));
            let (facts, triggers) = scanners[camera.index()].scan(&bytes);
            out.push(Record::Chunk(RawChunk {
                camera,
                seq: k,
                host_time: t + HostDuration::from_millis(20),
                lost_before: if k == 2 && camera == CameraId::Two {
                    12
                } else {
                    0
                },
                lost_from_us: None,
                bytes,
                facts,
                triggers,
            }));
        }
        out.push(Record::Poses(
            (0..20)
                .map(|ms| PoseSample {
                    t: t + HostDuration::from_millis(ms),
                    commanded: set_point(target, ms),
                    measured: Point3::new(1.0 / 3.0, -4.0, height_mm(ms)),
                    force_n: f64::NAN,
                })
                .collect(),
        ));
        let verdict = match ids.get(k as usize + 1) {
            Some(next) if next.press == id.press => PressVerdict::Invalid(not_settled()),
            _ => PressVerdict::Valid,
        };
        out.push(Record::Outcome(outcome(*id, t.0, verdict)));
    }
    HostTime(ids.len() as i64 * 20_000_000)
}

/// Records `presses` presses and seals the session.
pub(crate) fn sealed(path: &Path, presses: u32) -> SealedSession {
    let mut writer = SessionWriter::create(path).unwrap();
    for record in records(presses) {
        writer.accept(record).unwrap();
    }
    writer.finish().unwrap()
}

/// Works on a session file without opening it as a session.
pub(crate) fn with_file<T>(path: &Path, work: impl AsyncFnOnce(&mut SqliteConnection) -> T) -> T {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .build()
        .unwrap();
    runtime.block_on(async {
        let mut conn = SqliteConnectOptions::new()
            .filename(path)
            .connect()
            .await
            .unwrap();
        work(&mut conn).await
    })
}

pub(crate) async fn execute(conn: &mut SqliteConnection, statements: &[&'static str]) {
    for statement in statements {
        sqlx::query(*statement).execute(&mut *conn).await.unwrap();
    }
}

/// Executes statements on a session file.
pub(crate) fn change(path: &Path, statements: &[&'static str]) {
    with_file(path, async |conn| execute(conn, statements).await);
}
