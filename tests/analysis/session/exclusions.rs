//! Presses without a result: each has a row with its reason, and reasons are grouped by rule.

use skinrig_analysis::rule::Rule;
use skinrig_analysis::{SessionInput, analyze};
use skinrig_model::{
    CameraId, Causes, CdEvent, ExcludedReason, InvalidReason, MissedReason, Point2, PressFault,
    PressRole, PressVerdict, RunEnd, StereoGeometry, StopReason, Verdict,
};

use skinrig_planted::grid::{PLANTED, camera_us, plan, session};

#[test]
fn each_failure_has_its_own_row_and_reason() {
    let (mut input, mut source) = session();
    let verdict = |input: &mut SessionInput, row: usize, v: PressVerdict| {
        input.outcomes[row].as_mut().unwrap().verdict = v;
    };
    input.outcomes[52] = None;
    verdict(
        &mut input,
        51,
        PressVerdict::Missed(MissedReason::RunEnded(RunEnd::Stopped(StopReason::Stop))),
    );
    verdict(
        &mut input,
        50,
        PressVerdict::Invalid(InvalidReason::Faults(Causes::one(PressFault::Paused))),
    );
    verdict(
        &mut input,
        49,
        PressVerdict::Excluded(ExcludedReason::NotUsed {
            presses_used: "[1]".to_owned(),
        }),
    );
    input.outcomes[48].as_mut().unwrap().measured_at = None;
    input.outcomes[47].as_mut().unwrap().timing = None;
    let contact = |row: usize| plan()[row].4;
    let lost = camera_us(1, contact(46)) as u64;
    input.gaps[1].push((lost, lost + 10));
    // Camera 2 sees nothing of press 45 and little of 44; press 43 appears beside the skin.
    let inside = |row: usize, k: usize, e: &CdEvent| {
        let from = camera_us(k, contact(row) - 0.1) as u64;
        (from..from + 700_000).contains(&e.t_us)
    };
    source.events[1].retain(|e| !inside(45, 1, e));
    let mut kept = 0;
    source.events[1].retain(|e| {
        let keep = !inside(44, 1, e) || ((265..275).contains(&e.y) && kept < 15);
        kept += u32::from(inside(44, 1, e) && keep);
        keep
    });
    let planted = StereoGeometry::paper_like(PLANTED);
    let beside = Point2::new(-35.0, 47.0); // within the box, outside the rounded corner
    for (k, events) in source.events.iter_mut().enumerate() {
        let column = |p| planted.cameras[k].column_of_point(p).unwrap();
        let shift = (column(beside) - column(plan()[43].3)).round();
        for e in events.iter_mut().filter(|e| inside(43, k, e)) {
            e.x = (f64::from(e.x) + shift).clamp(0.0, 639.0) as u16;
        }
    }
    let a = analyze(&input, &source).unwrap();
    let reason = |row: usize| (a.presses[row].verdict, a.presses[row].reason().unwrap());
    let with_reason = |v: Verdict, r: &str| (v, r.to_owned());
    assert_eq!(reason(52), with_reason(Verdict::Missed, "never attempted"));
    assert_eq!(reason(51), with_reason(Verdict::Missed, "operator: stop"));
    assert_eq!(
        reason(50),
        with_reason(Verdict::Invalid, "paused by the operator")
    );
    assert_eq!(
        reason(49),
        with_reason(Verdict::Excluded, "not used: presses_used is [1]")
    );
    assert_eq!(
        reason(48),
        with_reason(Verdict::Invalid, "no measured position")
    );
    assert_eq!(
        reason(47),
        with_reason(Verdict::Invalid, "no measured times")
    );
    assert_eq!(
        reason(46),
        with_reason(Verdict::Invalid, "data lost in window (camera 2)")
    );
    assert_eq!(
        reason(45),
        with_reason(Verdict::Excluded, "no cluster (camera 2)")
    );
    let (v, r) = reason(44);
    assert!(
        v == Verdict::Excluded
            && r.starts_with("too few cluster events: 1")
            && r.ends_with(" < 20 (camera 2)"),
        "{r}"
    );
    let (v, r) = reason(43);
    assert!(
        v == Verdict::Excluded && r == "outside the skin outline",
        "{v}: {r}"
    );
    // Kinds and fields, with both texts for people.
    let json = serde_json::to_value(&a).unwrap();
    let found = &json["presses"][45];
    assert_eq!(found["cause"]["no_cluster"]["camera"], "camera2", "{found}");
    assert_eq!(found["rule"], "no cluster (camera 2)");
    assert_eq!(
        json["presses"][50]["cause"]["invalid"]["faults"][0],
        "paused"
    );
    assert_eq!(json["presses"][50]["reason"], "paused by the operator");
    let back: skinrig_analysis::Analysis = serde_json::from_str(&json.to_string()).unwrap();
    assert_eq!(back, a);
    assert!(a.counts.add_up());
    assert_eq!(
        (
            a.counts.valid,
            a.counts.missed,
            a.counts.invalid,
            a.counts.excluded
        ),
        (40, 2, 4, 4)
    );
    // Attempted: 25 scored presses but the two missed and the one that the operator left out. Seven fail here.
    assert_eq!(a.scored.located_rate.n, 22);
    assert_eq!(a.scored.located_rate.value, Some(15.0 / 22.0));
    assert!(a.scored.rmse_mm.n < a.scored_without_exclusions.rmse_mm.n);
    assert!(a.scored.rmse_mm.value < a.scored_without_exclusions.rmse_mm.value);
}

#[test]
fn presses_with_different_reasons_are_grouped_by_rule() {
    let (input, mut source) = session();
    // Camera 2 sees almost nothing of two presses, not equally little.
    for (row, most) in [(40usize, 15), (41, 17)] {
        let from = camera_us(1, plan()[row].4 - 0.1) as u64;
        let mut kept = 0;
        source.events[1].retain(|e| {
            let inside = (from..from + 700_000).contains(&e.t_us);
            let keep = !inside || ((265..275).contains(&e.y) && kept < most);
            kept += u32::from(inside && keep);
            keep
        });
    }
    let a = analyze(&input, &source).unwrap();
    let (p, q) = (&a.presses[40], &a.presses[41]);
    assert_eq!(p.verdict, Verdict::Excluded, "{:?}", p.cause);
    assert_ne!(p.reason(), q.reason());
    assert_eq!(p.rule(), Some(Rule::FewClusterEvents(CameraId::Two)));
    assert_eq!(p.rule(), q.rule());
    assert!(
        a.presses
            .iter()
            .all(|p| p.cause.is_some() == (p.verdict != Verdict::Valid))
    );
}

#[test]
fn presses_named_by_hand_are_rows_with_that_rule() {
    let (mut input, source) = session();
    let scored = input
        .planned
        .iter()
        .find(|p| p.role == PressRole::Score)
        .unwrap();
    input.settings.exclude_press_numbers = vec![scored.id];
    let a = analyze(&input, &source).unwrap();
    assert_eq!((a.counts.valid, a.counts.excluded), (49, 1));
    assert_eq!(
        a.presses[scored.id.index() as usize].rule(),
        Some(Rule::ByHand)
    );
    assert_eq!(a.scored.rmse_mm.n, 24);
    // It was attempted, so it is a failure.
    assert_eq!((a.penalised.failures, a.penalised.rmse_mm.n), (1, 25));
    assert_eq!((a.penalised.beyond_penalty, a.penalised.raised), (0, false));
    let count = |e: &skinrig_analysis::result::Estimate| e.value.unwrap() * f64::from(e.n);
    assert!((count(&a.scored.located_rate) - 24.0).abs() < 1e-9);
    let rms = |e: &skinrig_analysis::result::Estimate| e.value.unwrap().powi(2) * f64::from(e.n);
    let expected = rms(&a.scored.rmse_mm) + a.penalised.penalty_mm.powi(2);
    assert!((rms(&a.penalised.rmse_mm) - expected).abs() < 1e-6);
}
