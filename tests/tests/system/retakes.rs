//! Lost bytes invalidate a press and cause a retake: results of the analysis.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on must fail")]

use std::collections::BTreeMap;

use skinrig::analysis_request::AnalysisRequest;
use skinrig::results::analyze_session;
use skinrig_analysis::result::{AlignmentStatus, Analysis};
use skinrig_model::{BoxReport, CameraId, PressVerdict, RigFault, RunEnd, SimLevel};
use skinrig_recorder::SessionReader;
use skinrig_sim::{Fault, FaultTrigger, SimConfig, simulated_rig};
use skinrig_tests::{planned, record};

const PROTOCOL: &str = "\
skinrig: 1
name: lossy
operator: tests
prototype: {id: none}
seed: 5
scene: {needs: [triggers, event_rates, localisation]}
sync: {count: 2, interval: 1 s, at: [10 mm, 2 mm], pause_after: 1 s}
path:
  points: [[10 mm, 2 mm], [-10 mm, 18 mm], [0 mm, -18 mm], [25 mm, 17 mm]]
repetitions: {count: 2}
depth: 1.5 mm
motion: {period: 1.8 s}
limits:
  workspace: {min: [-40 mm, -48 mm, -4 mm], max: [60 mm, 52 mm, 30 mm]}
  max_depth: 2 mm
  max_speed: 100 mm/s
  max_force: 4 N
triggers: {marks: [contact, retract]}
evaluation: {calibrate: [], score: [1, 2]}
analysis: {calibration: none}
";

fn recorded(path: &std::path::Path, faults: Vec<Fault>) -> (SessionReader, Analysis) {
    let (protocol, plan) = planned(PROTOCOL).unwrap();
    let mut config = SimConfig::new(5, SimLevel::Geometric);
    config.faults = faults;
    config.fault_sizes.lost_words = 999;
    let report = record(&protocol, &plan, simulated_rig(&config), path, |_, _| {}).unwrap();
    assert_eq!(report.end, RunEnd::Completed);
    let results = analyze_session(path, AnalysisRequest::default()).unwrap();
    (SessionReader::open(path).unwrap(), results.analysis)
}

#[test]
fn a_retaken_press_counts_once_and_its_marks_misname_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let lost = |camera, contact| {
        let when = FaultTrigger::Contact(contact);
        Fault::new(RigFault::CameraDrops(camera), when).unwrap()
    };
    // Two sync presses, then press 3 and its first retake: the eighth contact is that of press 6.
    let faults = vec![
        lost(CameraId::Two, 3),
        lost(CameraId::Two, 4),
        lost(CameraId::One, 8),
    ];
    let (reader, lossy) = recorded(&folder.path().join("lossy.session.sqlite"), faults);
    let (_, whole) = recorded(&folder.path().join("whole.session.sqlite"), Vec::new());

    let attempts: Vec<usize> = reader
        .presses()
        .unwrap()
        .iter()
        .map(|p| p.1.len())
        .collect();
    assert_eq!(attempts, [1, 1, 1, 3, 1, 1, 2, 1, 1, 1]);
    for (press, attempts) in reader.presses().unwrap() {
        let (last, replaced) = attempts.split_last().unwrap();
        let verdict = |a: &skinrig_recorder::AttemptRow| a.outcome.clone().unwrap().verdict;
        assert_eq!(verdict(last), PressVerdict::Valid, "{}", press.id);
        for attempt in replaced {
            let PressVerdict::Invalid(why) = verdict(attempt) else {
                panic!("{attempt:?}");
            };
            assert!(why.to_string().contains("lost"), "{why}");
        }
    }
    // The loss and its position are in the stream.
    let gaps = CameraId::ALL.map(|camera| reader.gaps(camera).unwrap().len());
    assert_eq!(gaps, [1, 2]);

    // The marks of a press occur once per attempt under one name, within one epoch of the box.
    let mut names: BTreeMap<String, u32> = BTreeMap::new();
    for (_, report) in reader.box_reports().unwrap() {
        if let BoxReport::Mark { mark, .. } = report {
            *names.entry(format!("{mark:?}")).or_default() += 1;
        }
    }
    let repeated: Vec<u32> = names.into_values().filter(|n| *n > 1).collect();
    assert_eq!(
        repeated,
        [3, 2, 3, 2],
        "contact and retraction of two presses"
    );
    assert_eq!(lossy.alignment.status, AlignmentStatus::Valid);
    for line in &lossy.alignment.lines {
        assert_eq!((line.doubled, line.spurious), (0, 0), "{line:?}");
    }
    for (fit, other) in lossy.clocks.iter().zip(&whole.clocks) {
        let (fit, other) = (fit.unwrap(), other.unwrap());
        // The same crystals; a confused train would be off by seconds.
        assert!(
            (fit.drift_ppm - other.drift_ppm).abs() < 1.0,
            "{fit:?}, {other:?}"
        );
        assert!(fit.residual_max_us < 20.0, "{fit:?}");
    }

    assert_eq!(lossy.counts, whole.counts);
    assert_eq!((lossy.counts.planned, lossy.counts.valid), (8, 8));
    for (is, was) in lossy.presses.iter().zip(&whole.presses) {
        assert_eq!((is.press, is.planned), (was.press, was.planned));
        let off = is.truth.unwrap().distance_mm(was.truth.unwrap());
        assert!(
            off < 0.1,
            "{}: {off} mm from where it was pressed",
            is.press
        );
        let apart = is.estimate().unwrap().distance_mm(was.estimate().unwrap());
        assert!(
            apart < 3.0,
            "{}: {apart} mm from where it was seen",
            is.press
        );
    }
}
