//! planned = valid + missed + invalid + excluded, for any plan, fault or stop.

use proptest::prelude::*;
use skinrig::analysis_request::AnalysisRequest;
use skinrig::results::analyze_session;
use skinrig_model::{CameraId, Record, RigFault, SimLevel};
use skinrig_recorder::{SessionReader, verify};
use skinrig_results::Rescan;
use skinrig_sim::{Fault, FaultTrigger, SimConfig, simulated_rig};
use skinrig_tests::{planned, record};

/// A small protocol with these locations.
fn protocol(
    places: &[(i32, i32)],
    sync: u32,
    repetitions: u32,
    depth_um: u32,
    seed: u64,
) -> String {
    let points: Vec<String> = places
        .iter()
        .map(|(x, y)| format!("[{x} mm, {y} mm]"))
        .collect();
    let sync = if sync == 0 {
        String::new()
    } else {
        format!("sync: {{count: {sync}, interval: 1.5 s, at: [10 mm, 2 mm], pause_after: 2 s}}\n")
    };
    let scored: Vec<String> = (1..=repetitions).map(|r| r.to_string()).collect();
    format!(
        "skinrig: 1\nname: random\noperator: tests\nprototype: {{id: none}}\nseed: {seed}\n\
         scene: {{level: kinematic}}\n{sync}path:\n  points: [{}]\n\
         repetitions: {{count: {repetitions}}}\norder: {{shuffled: {{}}}}\ndepth: {depth_um} um\n\
         motion: {{period: 2.5 s}}\n\
         limits: {{workspace: {{min: [-40 mm, -48 mm, -4 mm], max: [60 mm, 52 mm, 30 mm]}}, \
         max_depth: 3 mm, max_speed: 100 mm/s, max_force: 5 N}}\n\
         triggers: {{marks: [contact, retract]}}\n\
         evaluation: {{calibrate: [], score: [{}]}}\nanalysis: {{calibration: none}}\n",
        points.join(", "),
        scored.join(", "),
    )
}

/// Operator action, by the number of the record at which it occurs.
#[derive(Debug, Clone)]
enum Operator {
    Watches,
    Stops(usize),
    Aborts(usize),
}

fn operators() -> impl Strategy<Value = Operator> {
    prop_oneof![
        Just(Operator::Watches),
        (0_usize..400).prop_map(Operator::Stops),
        (0_usize..400).prop_map(Operator::Aborts),
    ]
}

fn faults() -> impl Strategy<Value = Vec<Fault>> {
    let when = (0_u32..6).prop_map(FaultTrigger::Contact);
    let camera = prop_oneof![Just(CameraId::One), Just(CameraId::Two)];
    let kind = prop_oneof![
        Just(RigFault::RobotLost),
        camera.clone().prop_map(RigFault::CameraUnplugged),
        camera.prop_map(RigFault::CameraDrops),
        Just(RigFault::BoxSilent),
        Just(RigFault::RobotSlow),
    ];
    prop_oneof![
        2 => Just(Vec::new()),
        5 => (kind, when).prop_map(|(kind, when)| vec![Fault::new(kind, when).expect("a supported fault")]),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(24) })]

    #[test]
    fn presses_add_up(
        places in prop::collection::vec((-20_i32..30, -20_i32..25), 1..5),
        sync in 0_u32..4,
        repetitions in 1_u32..3,
        depth_um in 500_u32..2_500,
        seed in 0_u64..1_000,
        operator in operators(),
        faults in faults(),
    ) {
        let text = protocol(&places, sync, repetitions, depth_um, seed);
        let (protocol, plan) = planned(&text).unwrap();
        let mut config = SimConfig::new(seed, SimLevel::Kinematic);
        let robot_lost = faults.iter().any(|f| f.kind() == Some(RigFault::RobotLost));
        config.faults = faults;
        config.fault_sizes.lost_words = 999;
        let lab = tempfile::tempdir().unwrap();
        let path = lab.path().join("random.session.sqlite");
        let mut n = 0;
        let report = record(&protocol, &plan, simulated_rig(&config), &path, |_: &Record, control| {
            match operator {
                Operator::Stops(at) if at == n => control.stop(),
                Operator::Aborts(at) if at == n => control.abort(),
                _ => {}
            }
            n += 1;
        })
        .unwrap();
        prop_assert!(robot_lost || (report.retracted && report.disarmed), "{report:?}");
        prop_assert_eq!(report.planned, plan.presses.len());
        prop_assert_eq!(report.planned, report.valid + report.invalid + report.missed);

        let reader = SessionReader::open(&path).unwrap();
        let totals = reader.totals().unwrap();
        for tally in [totals.presses, totals.sync] {
            prop_assert_eq!(tally.open(), 0);
            prop_assert_eq!(
                tally.planned,
                tally.valid + tally.missed + tally.invalid + tally.excluded
            );
        }
        let scored = places.len() as u64 * u64::from(repetitions);
        prop_assert_eq!(totals.presses.planned, scored);
        prop_assert_eq!(totals.sync.planned, u64::from(sync));
        prop_assert_eq!((totals.presses.valid + totals.sync.valid) as usize, report.valid);

        let counts = analyze_session(&path, AnalysisRequest::default()).unwrap().analysis.counts;
        prop_assert!(counts.add_up(), "{counts:?}");
        prop_assert_eq!(u64::from(counts.planned), totals.presses.planned);
        prop_assert_eq!(u64::from(counts.sync), totals.sync.planned);
        prop_assert_eq!(u64::from(counts.missed), totals.presses.missed);
        // With the data, an analysis may find more invalid presses, never fewer.
        prop_assert!(u64::from(counts.invalid) >= totals.presses.invalid);

        let verified = verify::<Rescan>(&path).unwrap();
        prop_assert!(verified.is_sound() && verified.sealed, "{:?}", verified.problems);
    }
}
