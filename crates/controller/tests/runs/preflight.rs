//! The preflight on the simulated rig: its checks, and that a failed check prevents power-on.

use skinrig_controller::{ControlHandle, ExpectedDevice, Loopback, Preflight, Run, RunReport};
use skinrig_model::*;
use skinrig_sim::config::SimConfig;
use skinrig_sim::faults::{Fault, FaultTrigger};
use skinrig_sim::rig::simulated_rig;

use crate::mock::{Sink, header};
use crate::simulated::paced_plan;

fn full_preflight() -> Preflight {
    Preflight {
        caller_checks: vec![PreflightCheck::new("disk", "1 GB", "2 GB", true, "")],
        expected: Vec::new(),
        clocks_within: Some(HostDuration::from_millis(500)),
        loopback: Some(Loopback {
            channels: [0; 2],
            within: HostDuration::from_millis(500),
        }),
    }
}

fn run(faults: Vec<Fault>, preflight: Preflight) -> (RunReport, Vec<PreflightCheck>, Vec<Record>) {
    let mut config = SimConfig::new(5, SimLevel::Kinematic);
    config.faults = faults;
    let plan = paced_plan();
    let header = RunHeader {
        robot_from_skin: config.robot_from_skin,
        ..header(&plan)
    };
    let mut sink = Sink::default();
    let rig = simulated_rig(&config);
    let control = ControlHandle::new();
    let report = Run::new(&plan, header, rig, &control, &mut sink)
        .checked(preflight)
        .execute();
    let tables: Vec<_> = sink
        .records
        .iter()
        .filter_map(|r| match r {
            Record::Preflight(checks) => Some(checks.clone()),
            _ => None,
        })
        .collect();
    assert_eq!(tables.len(), 1, "one table in every case");
    (report, tables.concat(), sink.records)
}

fn failed(checks: &[PreflightCheck]) -> Vec<&str> {
    let failed = checks.iter().filter(|c| c.failed());
    failed.map(|c| c.check.as_str()).collect()
}

#[test]
fn a_healthy_rig_passes_every_check_and_runs() {
    let (report, checks, records) = run(Vec::new(), full_preflight());
    assert_eq!((report.end, report.valid), (RunEnd::Completed, 3));
    let names: Vec<&str> = checks.iter().map(|c| c.check.as_str()).collect();
    assert_eq!(
        names,
        [
            "disk",
            "indenter: identity",
            "indenter: settings read back",
            "indenter: initialised",
            "camera 1: identity",
            "camera 1: settings read back",
            "camera 2: identity",
            "camera 2: settings read back",
            "trigger box: identity",
            "camera 1: clock",
            "camera 2: clock",
            "camera 1: trigger loop-back",
            "camera 2: trigger loop-back",
        ]
    );
    assert_eq!(failed(&checks), [""; 0]);
    // The test mark is not part of the session.
    let sent = records.iter().filter_map(|r| match r {
        Record::MarkSent(s) => Some(s.mark),
        _ => None,
    });
    assert_eq!(sent.filter(|m| *m == pulse::LOOPBACK).count(), 0);
    let at = |f: &dyn Fn(&Record) -> bool| records.iter().position(f).unwrap();
    let table = at(&|r| matches!(r, Record::Preflight(_)));
    assert!(
        table < at(&|r| matches!(r, Record::Poses(_)))
            || table < at(&|r| matches!(r, Record::Intent { .. }))
    );
}

/// The run must end before power-on: no command, every press missed, the failed checks named.
fn refused(faults: Vec<Fault>, preflight: Preflight, expected: &[&str]) {
    let (report, checks, records) = run(faults, preflight);
    assert_eq!(failed(&checks), expected);
    let RunEnd::Faulted(causes) = &report.end else {
        panic!("{report:?}");
    };
    assert!(
        matches!(causes.as_slice(), [RunFault::Preflight { .. }]) || expected == ["devices"],
        "{causes}"
    );
    assert!(checks.iter().all(|c| c.failed() != c.next_step.is_empty()));
    assert_eq!((report.missed, report.disarmed), (3, true));
    assert!(!records.iter().any(|r| matches!(r, Record::Command { .. })));
}

#[test]
fn a_lost_trigger_line_is_found_before_the_robot_is_powered() {
    let start_pulse = |train| Fault::PulseLost {
        camera: CameraId::Two,
        train,
        pulse: 0,
    };
    let broken = (0..4).map(start_pulse).collect();
    refused(broken, full_preflight(), &["camera 2: trigger loop-back"]);
    // One damaged train is reported, but does not fail the run.
    let (report, checks, _) = run(vec![start_pulse(0)], full_preflight());
    assert_eq!((report.end, failed(&checks)), (RunEnd::Completed, vec![]));
    let last = checks.last().unwrap();
    assert_eq!(last.found, "the mark; 2 marks were sent", "{last:?}");
    let mut crossed = full_preflight();
    crossed.loopback = Some(Loopback {
        channels: [0, 7],
        within: HostDuration::from_millis(500),
    });
    refused(Vec::new(), crossed, &["camera 2: trigger loop-back"]);
}

#[test]
fn an_unexpected_device_or_version_is_rejected() {
    let mut preflight = full_preflight();
    preflight.expected = vec![
        ExpectedDevice {
            role: DeviceRole::Camera2,
            serial: Some("00001754".into()),
            versions: Vec::new(),
            settings: vec![("fpga".into(), "3.0".into())],
        },
        ExpectedDevice {
            role: DeviceRole::TriggerBox,
            serial: None,
            versions: vec!["9.9".into()],
            settings: Vec::new(),
        },
    ];
    refused(
        Vec::new(),
        preflight,
        &[
            "camera 2: identity",
            "camera 2: fpga",
            "trigger box: version",
        ],
    );
}

#[test]
fn failed_checks_of_the_caller_and_rejected_settings_end_the_run() {
    let mut preflight = full_preflight();
    preflight.caller_checks = vec![PreflightCheck::new(
        "disk",
        "9 GB",
        "1 GB",
        false,
        "make room",
    )];
    refused(Vec::new(), preflight, &["disk"]);
    let start = FaultTrigger::At(HostTime::ZERO);
    let ignored = Fault::new(RigFault::RobotSettingIgnored, start).unwrap();
    refused(vec![ignored], full_preflight(), &["devices"]);
}
