//! Touches felt online in a simulated session: the scored presses, and at the end of each window the bits of the analysis.

use skinrig_analysis::segment::{Window, windows};
use skinrig_analysis::{Analysis, SessionInput, analyze};
use skinrig_model::{CameraId, SimLevel};
use skinrig_online::{
    DetectionScore, Detector, IdleStatistic, Opening, PositionEstimator, ScoredPress, Training,
    interleave, learn,
};
use skinrig_results::{AlignedSession, AnalysisOptions, Session};
use skinrig_sim::{SimConfig, simulated_rig};
use skinrig_tests::{planned, record};

const PROTOCOL: &str = "
skinrig: 1
name: online
operator: tests
prototype: {id: none}
seed: 5
scene: {level: geometric}
sync: {count: 3, interval: 1.5 s, at: [10 mm, 2 mm], pause_after: 1 s}
path:
  meander: {origin: [-14 mm, -12 mm], pitch: 14 mm, columns: 4, rows: 3, line_direction: y}
repetitions: {count: 2, between: {return_to_start: true, pause: 1 s}}
depth: 2 mm
motion: {period: 2.5 s, hold: 150 ms}
limits:
  workspace: {min: [-40 mm, -48 mm, -4 mm], max: [60 mm, 52 mm, 30 mm]}
  max_depth: 3 mm
  max_speed: 100 mm/s
  max_force: 5 N
triggers: {marks: [contact, retract]}
evaluation: {calibrate: [1], score: [2]}
";

fn session(test: impl FnOnce(&AlignedSession, &Analysis)) {
    let (protocol, plan) = planned(PROTOCOL.trim_start()).expect("a valid protocol");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("online.session.sqlite");
    let rig = simulated_rig(&SimConfig::new(5, SimLevel::Geometric));
    let report = record(&protocol, &plan, rig, &path, |_, _| {}).expect("a session");
    assert_eq!(report.valid, 27);
    let opened = Session::open(&path, AnalysisOptions::default()).expect("a session");
    let aligned = opened.read_input().expect("its input").align();
    let analysis = analyze(&aligned.input, &aligned.events).expect("an analysis");
    test(&aligned, &analysis);
}

/// The windows of both cameras, in order of time.
fn press_windows(analysis: &Analysis, input: &SessionInput) -> Vec<[Window; 2]> {
    let timings = || {
        let rows = analysis.presses.iter().enumerate();
        rows.filter_map(|(row, p)| Some((row, p.timing?)))
    };
    let [one, two] = analysis.clocks.map(|clock| {
        windows(
            timings(),
            &input.earlier,
            &clock.expect("a clock"),
            &analysis.settings,
        )
    });
    one.into_iter()
        .zip(two)
        .map(|(one, two)| [one, two])
        .collect()
}

fn positions_are_those_of_the_analysis(aligned: &AlignedSession, analysis: &Analysis) {
    let training = Training::of(analysis).expect("calibration presses");
    let mut positions = PositionEstimator::of(analysis).expect("a locator");
    let mut windows = press_windows(analysis, &aligned.input)
        .into_iter()
        .peekable();
    let (mut open, mut compared): (Option<[Window; 2]>, usize) = (None, 0);
    let mut newest = [0, 0];
    interleave(&aligned.events, training.clocks(), |camera, events, _| {
        // One event at a time, or many.
        let slice = if compared.is_multiple_of(2) {
            1
        } else {
            events.len()
        };
        for events in events.chunks(slice) {
            positions.push(camera, events);
        }
        newest[camera.index()] = events.last().map_or(0, |e| e.t_us);
        let passed = |of: [u64; 2]| newest[0] > of[0] && newest[1] > of[1];
        if let Some(window) = open.take_if(|w| passed(w.map(|w| w.end_us))) {
            let found = positions.position(window.map(|w| w.end_us));
            let press = &analysis.presses[window[0].row];
            assert!(found.complete);
            assert_eq!(found.outcome, press.location_outcome, "{:?}", press.press);
            assert_eq!(found.location.and_then(|l| l.region), press.region);
            compared += 1;
        }
        if open.is_none()
            && let Some(next) = windows.next_if(|w| passed(w.map(|w| w.start_us)))
        {
            positions.open(next.map(Opening::from));
            open = Some(next);
        }
        true
    })
    .expect("the events");
    assert_eq!(compared, analysis.presses.len());
}

#[test]
fn touches_are_felt_online_and_located_as_offline() {
    session(|aligned, analysis| {
        positions_are_those_of_the_analysis(aligned, analysis);
        let training = Training::of(analysis).unwrap();
        let model = learn(&training, &aligned.events).unwrap();
        let idle = IdleStatistic::measure(&model, &training, &aligned.events, |_, _| true).unwrap();
        let threshold = idle.threshold(0.1);
        assert!((8.0..60.0).contains(&threshold), "{threshold}");
        let clocks = training.clocks();
        let mut detector = Detector::new(&model, clocks, threshold, 0).unwrap();
        let mut found = Vec::new();
        interleave(&aligned.events, clocks, |camera, events, next_us| {
            for camera in CameraId::ALL {
                detector.promise(camera, next_us[camera.index()], |d| found.push(d));
            }
            detector.push(camera, events, |d| found.push(d)) == events.len()
        })
        .unwrap();
        let presses = ScoredPress::of(analysis);
        let score = DetectionScore::new(&found, &presses);
        // A contact without events in either camera is rare, but possible.
        assert!(score.delays_ms.len() + 1 >= presses.len(), "{score:?}");
        assert!(
            score.delays_ms.iter().all(|d| (-1.0..12.0).contains(&d.1)),
            "{score:?}"
        );
        assert!(score.false_alarms <= 8, "{score:?}");
        assert!(
            score
                .releases_ms
                .iter()
                .filter(|ms| ms.abs() < 60.0)
                .count()
                + 2
                >= presses.len(),
            "{score:?}"
        );
    });
}
