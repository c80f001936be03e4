//! Laws of paths, orders, plans and checks.

use crate::common::{demo, parse, shipped};
use proptest::prelude::*;
use skinrig_model::{Point2, PressRole, SkinOutline};
use skinrig_protocol::{
    Area, KeepOut, Plan, PlanRule, Segment, Step, Surroundings, Violation, check,
};

fn keys(violations: &[Violation]) -> Vec<(Segment, &str)> {
    let mut keys: Vec<_> = violations.iter().map(|v| (v.segment, v.key)).collect();
    keys.dedup();
    keys
}

#[test]
fn absent_settings_are_the_documented_defaults() {
    assert_eq!(
        parse(&shipped("circles.yaml"), &[]).unwrap().analysis,
        skinrig_model::AnalysisSettings::default()
    );
    let changed = demo(&[
        "analysis.crop.camera2=[0 px, 479 px]",
        "analysis.window_before=7 ms",
        "analysis.window_after=8 ms",
        "analysis.eps=3 px",
        "analysis.min_samples=4",
        "analysis.centroid=all_clusters",
        "analysis.min_cluster_events=0",
        "analysis.min_response_sigma=3.5",
        "analysis.min_ray_sine=0.1",
        "analysis.exclude_outside=false",
        "analysis.calibration=positions_skews",
        "analysis.window_anchor=middle",
        "analysis.cluster_threshold=fixed",
        "analysis.exclude_press_numbers=[4, 17]",
        "analysis.lens=stereographic",
        "analysis.failure_penalty=30 mm",
        "analysis.within=2.5 mm",
        "analysis.bits_per_event=32",
        "analysis.study_presses=7",
        "analysis.reduction.max_power=3",
        "analysis.reduction.seeds=4",
        "analysis.reduction.min_samples=1",
        "analysis.latency.bin=0.5 ms",
        "analysis.latency.sigma=0.7 ms",
        "analysis.latency.alpha=5",
        "analysis.latency.consecutive=4",
        "analysis.latency.thresholds.from=17",
        "analysis.latency.thresholds.to=19",
        "analysis.latency.thresholds.count=3",
        "analysis.latency.target_rate=0.85",
        "analysis.latency.window=20 ms",
        "analysis.latency.background=after",
        "analysis.latency.reduced.factor=64",
        "analysis.latency.reduced.thresholds.from=4",
        "analysis.latency.reduced.thresholds.to=9",
        "analysis.latency.reduced.thresholds.count=11",
        "analysis.latency.reduced.target_rate=0.7",
        "analysis.cmre.cell=4 mm",
        "analysis.cmre.sigma=2 mm",
        "analysis.cmre.sr=80 mm",
        "analysis.bootstrap_resamples=10",
        "analysis.seed=9",
        "analysis.estimator=streaming",
        "analysis.precision=f32",
        "analysis.forget=70 ms",
        "analysis.thinning=8",
        "analysis.bin=4 px",
        "analysis.window_after_contact=100 ms",
        "analysis.rate_bin=20 ms",
    ])
    .analysis;
    insta::assert_debug_snapshot!("analysis", changed);
}

#[test]
fn the_choices_of_the_public_code_can_be_selected() {
    let settings = demo(&skinrig_protocol::REFERENCE_CODE).analysis;
    insta::assert_debug_snapshot!("reference_code", settings);
}

#[test]
fn thresholds_increase() {
    let error = parse(
        &shipped("demo.yaml"),
        &["analysis.latency.thresholds.from=30"],
    )
    .unwrap_err();
    assert!(
        error.to_string().contains("the thresholds are empty"),
        "{error}"
    );
    assert!(error.to_string().contains("30 to 20"), "{error}");
    let reduced = "analysis.latency.reduced.thresholds.to=2";
    let error = parse(&shipped("demo.yaml"), &[reduced]).unwrap_err();
    assert!(error.to_string().contains("3 to 2"), "{error}");
}

#[test]
fn rings_keep_their_radius() {
    let protocol = parse(&shipped("circles.yaml"), &[]).unwrap();
    assert_eq!(protocol.locations.len(), 48);
    for (k, p) in protocol.locations.iter().enumerate() {
        let radius = if k < 24 { 20.0 } else { 25.0 };
        assert!((p.distance_mm(Point2::new(10.0, 2.0)) - radius).abs() < 1e-9);
    }
    assert_eq!(protocol.locations[0], Point2::new(30.0, 2.0));
    assert!(protocol.locations[1].y_mm > 2.0, "counter-clockwise");
}

#[test]
fn impossible_random_locations_are_an_error() {
    let error = parse(&shipped("depth-sweep.yaml"), &["path.random.spacing=40mm"]).unwrap_err();
    assert!(
        error.to_string().contains("the locations do not fit"),
        "{error}"
    );
    assert!(error.to_string().contains("room for"), "{error}");
}

#[test]
fn depths_run_the_path_once_each() {
    let text = shipped("demo.yaml").replace("depth: 2 mm", "depths: [2 mm, 1 mm]");
    let plan = parse(&text, &[]).unwrap().compile();
    let first: Vec<_> = plan
        .presses
        .iter()
        .filter(|p| p.repetition.index() == 0 && p.role != PressRole::Sync)
        .collect();
    assert_eq!(first.len(), 162);
    assert!(first[..81].iter().all(|p| p.depth_mm == 2.0));
    assert!(first[81..].iter().all(|p| p.depth_mm == 1.0));
    assert_eq!(first[0].location, first[81].location);
}

#[test]
fn between_repetitions_the_tip_returns_and_waits() {
    let steps = |overrides: &[&str]| {
        let plan = demo(overrides).compile();
        let begin = plan
            .steps
            .iter()
            .position(|s| {
                matches!(
                    s,
                    Step::Begin {
                        repetition: Some(r)
                    } if r.number() == 2
                )
            })
            .unwrap();
        plan.steps[begin - 2..begin].to_vec()
    };
    assert!(matches!(
        steps(&[])[..],
        [Step::Travel { .. }, Step::Pause { .. }]
    ));
    let back_later = steps(&["repetitions.between.return_to_start=false"]);
    assert!(matches!(
        back_later[..],
        [Step::Pause { .. }, Step::Travel { .. }]
    ));
}

fn damaged(change: impl FnOnce(&mut Plan)) -> Vec<Violation> {
    let protocol = demo(&[]);
    let mut plan = protocol.compile();
    change(&mut plan);
    check(&plan, &protocol.surroundings, Some(protocol.motion.home))
}

/// The first press of the path; presses 0 to 2 are sync presses.
fn press(plan: &mut Plan, number: u32) -> &mut skinrig_protocol::PressStep {
    plan.steps
        .iter_mut()
        .find_map(|s| match s {
            Step::Press(p) if p.press.index() == number => Some(p),
            _ => None,
        })
        .unwrap()
}

#[test]
fn every_kind_of_damage_is_found() {
    assert_eq!(damaged(|_| {}), []);
    let depth = damaged(|p| press(p, 7).depth_mm = 3.5);
    assert!(
        keys(&depth).contains(&(Segment::Press, "depth")),
        "{depth:?}"
    );
    assert!(
        depth[0].to_string().starts_with("press 8, "),
        "{}",
        depth[0]
    );
    let fast = damaged(|p| press(p, 7).retract_speed_mm_s = 101.0);
    assert_eq!(keys(&fast), [(Segment::Retract, "motion.retract")]);
    for speed in [f64::NAN, 0.0, -1.0, f64::INFINITY] {
        let senseless = damaged(|p| press(p, 7).approach_speed_mm_s = speed);
        assert!(
            keys(&senseless).contains(&(Segment::Approach, "motion.approach")),
            "{speed}"
        );
    }
    let late = damaged(|p| press(p, 7).deadline = skinrig_model::HostDuration::from_millis(10));
    assert_eq!(keys(&late), [(Segment::Press, "motion")]);
    let away = damaged(|p| {
        press(p, 7).at = Point2::new(0.0, 0.0);
        p.presses[7].at = Point2::new(0.0, 0.0);
    });
    assert!(
        away.iter()
            .any(|v| v.segment == Segment::Approach && v.rule == PlanRule::PressStart)
    );
    let low = damaged(|p| {
        for step in &mut p.steps {
            if let Step::Travel { to, .. } = step {
                *to = to.plane().at_height(1.0);
            }
        }
    });
    assert!(keys(&low).contains(&(Segment::Travel, "motion.clearance")));
    assert!(keys(&low).contains(&(Segment::FromHome, "motion.clearance")));
    let force = damaged(|p| p.limits.max_force_n = f64::NAN);
    assert_eq!(keys(&force), [(Segment::Plan, "limits.max_force")]);
    let floor = damaged(|p| p.limits.workspace_min_mm[2] = -1.0);
    assert_eq!(floor.len(), 246);
    assert_eq!(floor[0].segment, Segment::Press);
    let wrong_place = damaged(|p| p.presses[9].at = Point2::new(0.0, 0.0));
    assert!(wrong_place.iter().any(|v| v.rule == PlanRule::PlannedPress));
}

#[test]
fn presses_stay_inside_the_outline_not_its_bounding_box() {
    // (55, 47) lies inside the 100 x 100 mm box and outside the chamfer.
    let protocol = demo(&["path.meander.origin=[55 mm, 47 mm]", "path.meander.count=1"]);
    let found = check(
        &protocol.compile(),
        &protocol.surroundings,
        Some(protocol.motion.home),
    );
    assert_eq!(found.len(), 3, "once per repetition");
    assert!(
        found
            .iter()
            .all(|v| v.rule == PlanRule::OnSkin && v.key == "path")
    );
    // The margin counts as well: 2 mm from the right edge, 3 mm required.
    let protocol = demo(&["path.meander.origin=[58 mm, 2 mm]", "path.meander.count=1"]);
    assert_eq!(
        check(&protocol.compile(), &protocol.surroundings, None).len(),
        3
    );
    let protocol = demo(&[
        "path.meander.origin=[58 mm, 2 mm]",
        "path.meander.count=1",
        "frame.margin=1mm",
    ]);
    assert_eq!(check(&protocol.compile(), &protocol.surroundings, None), []);
}

#[test]
fn keep_outs_hold_for_presses_and_for_travel_between_them() {
    // A wall between the columns x = -25 and x = -18, at the top, where the path crosses from one to the other.
    let wall = |height: &str| {
        format!(
            "frame.keep_outs=[{{name: wall, rectangle: {{min: [-22 mm, 25 mm], max: [-21 mm, 40 mm]}}, margin: 1 mm{height}}}]"
        )
    };
    let found = |overrides: &[&str]| {
        let protocol = demo(overrides);
        check(
            &protocol.compile(),
            &protocol.surroundings,
            Some(protocol.motion.home),
        )
    };
    let tall = found(&[&wall("")]);
    assert!(
        tall.iter()
            .all(|v| v.segment == Segment::Travel && v.rule == PlanRule::KeepOut("wall".to_owned()))
    );
    assert!(tall.len() >= 3, "{tall:?}");
    assert_eq!(
        tall[0].press.unwrap().number(),
        3 + 10,
        "the tenth press of the path is behind the wall"
    );
    assert_eq!(
        found(&[&wall(", height: 4 mm")]),
        [],
        "clearance 5 mm passes over 4 mm and 1 mm margin"
    );
    assert!(!found(&[&wall(", height: 4.5 mm")]).is_empty());
    let circle = "frame.keep_outs=[{circle: {centre: [10 mm, 9 mm], radius: 1 mm}, height: 1 mm}]";
    let pressed = found(&[circle]);
    assert!(pressed.iter().all(|v| v.segment == Segment::Press));
    assert_eq!(pressed.len(), 3);
}

#[test]
fn the_travel_from_home_is_checked() {
    let text = shipped("demo.yaml").replace(
        "  hold: 150 ms",
        "  hold: 150 ms\n  home: [-50 mm, 2 mm, 20 mm]",
    );
    let protocol = parse(&text, &[]).unwrap();
    let found = check(
        &protocol.compile(),
        &protocol.surroundings,
        Some(protocol.motion.home),
    );
    assert_eq!(keys(&found), [(Segment::FromHome, "motion.home")]);
}

#[test]
fn pinned_shuffle() {
    // The documented generator, pinned: a change would silently reorder everyone's campaigns.
    let plan = demo(&["order.shuffled.seed=3", "motion.period=3s"]).compile();
    let order: Vec<u32> = plan.presses[3..11]
        .iter()
        .map(|p| p.location.index())
        .collect();
    insta::assert_debug_snapshot!("shuffle_seed_3", order);
}

#[test]
fn a_point_that_a_path_lists_again_is_the_same_location() {
    let path = "path={points: [[0 mm, 0 mm], [10 mm, 5 mm], [0.03 mm, 0 mm], [-20 mm, 0 mm], [10 mm, 5 mm]]}";
    let plan = demo(&[path]).compile();
    let mut pressed: Vec<(i32, u32)> = plan
        .presses
        .iter()
        .filter(|p| p.role != PressRole::Sync)
        .map(|p| (p.at.x_mm.round() as i32, p.location.number()))
        .collect();
    pressed.sort_unstable();
    pressed.dedup();
    assert_eq!(pressed, [(-20, 3), (0, 1), (10, 2)]);
    assert_eq!(plan.summary().locations, 3);
}

proptest! {
    #[test]
    fn meanders_visit_each_cell_once_and_step_by_one_pitch(
        columns in 1u32..12, rows in 1u32..12, along_x in any::<bool>(), share in 0.0f64..1.0,
    ) {
        let count = 1 + (share * f64::from(columns * rows - 1)) as usize;
        let axis = if along_x { "x" } else { "y" };
        let text = shipped("demo.yaml");
        let protocol = parse(&text, &[
            "path.meander.pitch=3mm", &format!("path.meander.columns={columns}"), &format!("path.meander.rows={rows}"),
            &format!("path.meander.line_direction={axis}"), &format!("path.meander.count={count}"),
        ]).unwrap();
        prop_assert_eq!(protocol.locations.len(), count);
        for pair in protocol.locations.windows(2) {
            prop_assert!((pair[0].distance_mm(pair[1]) - 3.0).abs() < 1e-9);
        }
        let mut cells: Vec<_> = protocol.locations.iter()
            .map(|p| (((p.x_mm + 25.0) / 3.0).round() as i64, ((p.y_mm + 26.0) / 3.0).round() as i64)).collect();
        cells.sort_unstable();
        cells.dedup();
        prop_assert_eq!(cells.len(), count);
        prop_assert!(cells.iter().all(|(i, j)| (0..i64::from(columns)).contains(i) && (0..i64::from(rows)).contains(j)));
    }

    #[test]
    fn random_locations_keep_their_distances(seed in any::<u32>(), count in 1u32..40, spacing in 0.0f64..9.0) {
        let text = shipped("depth-sweep.yaml");
        let make = || parse(&text, &[
            &format!("path.random.seed={seed}"), &format!("path.random.count={count}"),
            &format!("path.random.spacing={spacing} mm"),
        ]).unwrap();
        let protocol = make();
        prop_assert_eq!(&protocol, &make());
        for (i, p) in protocol.locations.iter().enumerate() {
            prop_assert!(SkinOutline::PAPER.clearance_mm(*p) >= 15.0);
            for q in &protocol.locations[i + 1..] {
                prop_assert!(p.distance_mm(*q) >= spacing);
            }
        }
    }

    #[test]
    fn a_shuffle_presses_everything_once_per_repetition(seed in any::<u32>()) {
        let plan = demo(&[&format!("order.shuffled.seed={seed}"), "motion.period=3s"]).compile();
        let mut orders = Vec::new();
        for repetition in 0..3 {
            let order: Vec<u32> = plan.presses.iter()
                .filter(|p| p.repetition.index() == repetition && p.role != PressRole::Sync).map(|p| p.location.index()).collect();
            let mut sorted = order.clone();
            sorted.sort_unstable();
            prop_assert_eq!(sorted, (0..81).collect::<Vec<_>>());
            orders.push(order);
        }
        prop_assert!(orders[0] != orders[1] && orders[1] != orders[2]);
    }

    /// Plans survive JSON unchanged, and so does their digest.
    #[test]
    fn plans_survive_json(pitch in 1.0f64..7.0, period in 1.5f64..9.0) {
        let plan = demo(&[&format!("path.meander.pitch={pitch} mm"), &format!("motion.period={period} s")]).compile();
        let back: Plan = serde_json::from_str(&plan.to_json()).unwrap();
        prop_assert_eq!(&back, &plan);
        prop_assert_eq!(back.digest(), plan.digest());
    }

    /// Detects anything moved out of the workspace or the outline.
    #[test]
    fn nothing_outside_passes(x in -80.0f64..100.0, y in -90.0f64..95.0) {
        let protocol = demo(&[&format!("path.meander.origin=[{x} mm, {y} mm]"), "path.meander.count=1"]);
        let clean = check(&protocol.compile(), &protocol.surroundings, None).is_empty();
        let p = Point2::new(x, y);
        prop_assert_eq!(clean, SkinOutline::PAPER.clearance_mm(p) >= 3.0 - 1e-9);
    }

    /// A keep-out anywhere is violated exactly when some press or travel comes within its margin.
    #[test]
    fn keep_outs_against_sampling(x in -30.0f64..40.0, y in -30.0f64..40.0, radius in 0.5f64..5.0) {
        let protocol = demo(&["path.meander.columns=3", "path.meander.rows=3", "repetitions.count=2", "evaluation.score=[2]"]);
        let plan = protocol.compile();
        let around = Surroundings {
            keep_outs: vec![KeepOut {
                name: "post".to_owned(),
                area: Area::Circle { centre: Point2::new(x, y), radius_mm: radius },
                margin_mm: 0.0,
                height_mm: None,
            }],
            ..protocol.surroundings.clone()
        };
        let found = !check(&plan, &around, Some(protocol.motion.home)).is_empty();
        let mut place = protocol.motion.home.plane();
        let mut nearest = f64::INFINITY;
        for step in &plan.steps {
            if let Step::Travel { to, .. } = step {
                for k in 0..=400 {
                    let t = f64::from(k) / 400.0;
                    let p = Point2::new(place.x_mm + t * (to.x_mm - place.x_mm), place.y_mm + t * (to.y_mm - place.y_mm));
                    nearest = nearest.min(p.distance_mm(Point2::new(x, y)));
                }
                place = to.plane();
            }
        }
        prop_assume!((nearest - radius).abs() > 0.1);
        prop_assert_eq!(found, nearest < radius);
    }
}
