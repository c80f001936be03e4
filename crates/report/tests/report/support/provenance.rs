//! Made-up provenance of a simulated session.

use skinrig_model::{LostTime, RunEnd};
use skinrig_report::{DeviceRow, InterruptionRow, LegRow, LossRow, NoteRow, Provenance, RetakeRow};

/// Provenance of a simulated session.
pub(crate) fn provenance() -> Provenance {
    let device = |role: &str, model: &str, serial: &str, firmware: &str| DeviceRow {
        role: role.into(),
        model: model.into(),
        serial: serial.into(),
        firmware: firmware.into(),
    };
    Provenance {
        session_id: "2026-03-02_14-05-09_meander".into(),
        content_sha256: None,
        started: "2026-03-02T14:05:09+01:00".into(),
        prototype: "waveguide 3, second pour".into(),
        operator: "A. Example".into(),
        protocol_name: "protocols/meander.yaml".into(),
        protocol_sha256: "3f5b".repeat(16),
        overrides: vec!["path.repetitions=10".into()],
        variant: None,
        selection: None,
        plan_sha256: "a90c".repeat(16),
        seed: 20_260_302,
        rig_kind: "simulated".into(),
        rig_name: "simulated (geometric)".into(),
        differences_from_optical: Default::default(),
        simulated: true,
        emulated: false,
        preflight: Vec::new(),
        devices: vec![
            device("indenter", "simulated Omega.3", "sim-robot", "0.1.0"),
            device(
                "camera1",
                "simulated Prophesee EVK1 Gen3.1",
                "sim-cam-1",
                "0.1.0",
            ),
            device(
                "camera2",
                "simulated Prophesee EVK1 Gen3.1",
                "sim-cam-2",
                "0.1.0",
            ),
            device("trigger_box", "simulated trigger box", "sim-box", "0.1.0"),
        ],
        software: "skinrig 0.1.0".into(),
        host: "bench-2".into(),
        command_line: "skinrig run protocols/meander.yaml --set path.repetitions=10".into(),
        results_hash: "77e1".repeat(16),
        run_end: "completed".into(),
        run_end_reason: None,
        run_end_cause: Some(RunEnd::Completed),
        legs: vec![
            LegRow {
                number: 1,
                started: "2026-03-02T14:05:09+01:00".into(),
                start_s: 0.0,
                end: "cut off".into(),
                apart_s: None,
            },
            LegRow {
                number: 2,
                started: "2026-03-02T22:10:30+01:00".into(),
                start_s: 1210.0,
                end: "completed".into(),
                apart_s: Some(27_913.5),
            },
        ],
        retaken: [
            (41, "camera 2 lost 4096 bytes during the press"),
            (77, "cut off: leg 1 ended during the press"),
            (93, "camera 2 lost 4096 bytes during the press"),
        ]
        .map(|(press, reason)| RetakeRow {
            press,
            attempt: 1,
            reason: reason.into(),
            cause: None,
        })
        .to_vec(),
        interruptions: vec![InterruptionRow {
            t_s: 1803.2,
            kind: "pause".into(),
            reason: "operator paused".into(),
            ended_run: false,
        }],
        notes: vec![NoteRow {
            t_s: 2.0,
            text: "blinds closed".into(),
        }],
        lost_bytes: [0, 4096],
        losses: vec![LossRow {
            camera: 2,
            bytes: 4096,
            time: LostTime {
                from_us: Some(61_250_000),
                to_us: Some(61_262_500),
            },
        }],
    }
}
