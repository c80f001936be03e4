//! Legs of a resumed session: trains stay in their leg, and all legs lie on one line.

use skinrig_analysis::LegStart;
use skinrig_analysis::SessionInput;
use skinrig_analysis::legs::align;
use skinrig_analysis::result::AlignmentStatus;
use skinrig_analysis::timebase::{TimeBase, TimeBaseInput};
use skinrig_model::{
    AlignmentSettings, AnalysisSettings, BoxReport, HostTime, RigGeometry, SkinOutline,
    StereoGeometry, TriggerEdge,
};

use crate::timebase::bench::{Bench, NOISY, Random, bench, run};

/// Two benches joined as the recorder joins the legs of a session: the second with the same crystals, all its clocks begun anew, and
/// the same labels.
struct JoinedLegs {
    first: Bench,
    second: Bench,
    leg: LegStart,
    joined: Bench,
}

fn in_legs(seed: u64) -> JoinedLegs {
    let first = bench(seed, &NOISY);
    let second = run(
        Random(seed + 1000),
        first.boxed.anew(3e5),
        [first.cameras[0].anew(7e9), first.cameras[1].anew(2e6)],
        &NOISY,
    );
    let after = |k: usize| (first.edges[k].last().unwrap().t_us / 1_000_000 + 2) * 1_000_000;
    let leg = LegStart::recorded(HostTime(43_000_000_000), [after(0), after(1)]);
    let later = |t: HostTime| HostTime(t.0 + leg.origin.0);
    let mut reports = first.reports.clone();
    reports.push(BoxReport::Reset {
        noticed: leg.origin,
    });
    reports.extend(second.reports.iter().map(|r| match *r {
        BoxReport::Exchange { sent, received, at } => BoxReport::Exchange {
            sent: later(sent),
            received: later(received),
            at,
        },
        other => other,
    }));
    let edges = [0, 1].map(|k| {
        let moved = second.edges[k].iter().map(|e| TriggerEdge {
            t_us: e.t_us + leg.camera_us[k],
            ..*e
        });
        first.edges[k].iter().copied().chain(moved).collect()
    });
    let moved = second.presses.iter().map(|at| at + 43e6);
    let presses = first.presses.iter().copied().chain(moved).collect();
    let joined = Bench {
        reports,
        edges,
        presses,
        ..first
    };
    let first = bench(seed, &NOISY);
    JoinedLegs {
        first,
        second,
        leg,
        joined,
    }
}

/// Where the zero of a camera's clock in the leg lies, µs.
fn joint(leg: &LegStart, k: usize) -> f64 {
    leg.recorded_us[k] as f64 + leg.moved_us[k] as f64
}

/// The session as it was recorded.
fn input(s: &JoinedLegs) -> SessionInput {
    SessionInput {
        planned: Vec::new(),
        outcomes: Vec::new(),
        earlier: Vec::new(),
        stopped: Vec::new(),
        edges: s.joined.edges.clone(),
        marks: Vec::new(),
        box_reports: s.joined.reports.clone(),
        recorded: [Vec::new(), Vec::new()],
        gaps: [
            vec![
                (5, s.leg.camera_us[0] + 5),
                (s.leg.camera_us[0] + 9, u64::MAX),
            ],
            Vec::new(),
        ],
        pose_interval_us: None,
        crossing_se_us: None,
        descents: Vec::new(),
        hold_forces_n: Vec::new(),
        legs: vec![s.leg],
        rig: RigGeometry {
            outline: SkinOutline::PAPER,
            nominal: StereoGeometry::PAPER,
            trigger_channel: Some(0),
            trigger_delay_us: [0; 2],
        },
        settings: AnalysisSettings::default(),
        recorded_settings: None,
    }
}

#[test]
fn trains_of_one_leg_are_never_looked_for_in_another() {
    for seed in 20..30 {
        let s = in_legs(seed);
        let limits = AlignmentSettings::default();
        let mut aligned = input(&s);
        align(&mut aligned);
        let base = TimeBase::new(
            &TimeBaseInput {
                reports: &aligned.box_reports,
                edges: [&aligned.edges[0], &aligned.edges[1]],
                channel: 0,
                recorded: [&[], &[]],
                legs: &aligned.legs,
                used_at_us: &s.joined.presses,
            },
            &limits,
        )
        .unwrap();
        let a = &base.alignment;
        assert_eq!(a.status, AlignmentStatus::Valid, "seed {seed}: {a:#?}");
        assert_eq!(a.resets, 0, "the box lost nothing");
        assert!(a.lines.iter().all(|line| line.trains_seen > 180), "{a:#?}");
        for k in 0..2 {
            for at in &s.first.presses {
                let found = base.camera_us(k, *at).unwrap();
                let half = found.within_us();
                let off = found.us - s.first.cameras[k].at(*at);
                assert!(off.abs() <= half, "seed {seed}, first leg: {off} µs");
            }
            for at in &s.second.presses {
                let found = base.camera_us(k, at + 43e6).unwrap();
                let half = found.within_us();
                let off = found.us - joint(&aligned.legs[0], k) - s.second.cameras[k].at(*at);
                assert!(off.abs() <= half, "seed {seed}, second leg: {off} µs");
            }
        }
        // Taken for one leg, every label is there twice.
        let base = s.joined.align(&limits);
        assert_eq!(base.alignment.status, AlignmentStatus::Invalid);
    }
}

#[test]
fn the_legs_share_one_time_axis() {
    let s = in_legs(31);
    let mut input = input(&s);
    align(&mut input);
    for k in 0..2 {
        let (one, two) = (&s.first.cameras[k], &s.second.cameras[k]);
        let moved = input.legs[0].moved_us[k] as f64;
        for host_us in [0.0, 20e6, 40e6] {
            let other = s.leg.camera_us[k] as f64 + two.at(host_us) + moved;
            let off = other - one.at(43e6 + host_us);
            assert!(off.abs() < 100.0, "camera {k}: {off} µs");
        }
    }
    let by = input.legs[0].moved_us[0];
    let after = |us: u64| (s.leg.recorded_us[0] + us).saturating_add_signed(by);
    assert_eq!(input.gaps[0], [(5, after(5)), (after(9), u64::MAX)]);
    let begins = input.legs[0].camera_us;
    for (k, edges) in input.edges.iter().enumerate() {
        assert!(edges.is_sorted_by_key(|e| e.t_us));
        let before = edges.partition_point(|e| e.t_us < begins[k]);
        assert_eq!(before, s.first.edges[k].len(), "camera {k}");
    }
    let last = s.joined.edges[1].last().unwrap().t_us;
    let moved = last.saturating_add_signed(input.legs[0].moved_us[1]);
    assert_eq!(input.edges[1].last().unwrap().t_us, moved);
    assert_eq!(input.edges[1][0], s.joined.edges[1][0]);
    // Again: they are on one line already.
    let aligned = input.legs[0].moved_us;
    align(&mut input);
    let further = (input.legs[0].moved_us[1] - aligned[1]).abs();
    assert!(further <= 20, "{further} µs");
}

/// A leg that was cut off before its first chunk: the next one begins at the same camera times.
#[test]
fn a_leg_that_holds_nothing_changes_nothing() {
    let s = in_legs(32);
    let mut without = input(&s);
    let mut with = without.clone();
    let empty = LegStart::recorded(HostTime(42_000_000_000), s.leg.recorded_us);
    with.legs.insert(0, empty);
    let reset = |r: &BoxReport| matches!(r, BoxReport::Reset { .. });
    let at = with.box_reports.iter().position(reset).unwrap();
    let noticed = empty.origin;
    with.box_reports.insert(at, BoxReport::Reset { noticed });
    align(&mut without);
    align(&mut with);
    assert_eq!(with.edges, without.edges);
    assert_eq!(with.gaps, without.gaps);
    assert_eq!(with.legs[1].moved_us, without.legs[0].moved_us);
    let base = |input: &SessionInput| {
        let ties = TimeBaseInput {
            reports: &input.box_reports,
            edges: [&input.edges[0], &input.edges[1]],
            channel: 0,
            recorded: [&[], &[]],
            legs: &input.legs,
            used_at_us: &s.joined.presses,
        };
        TimeBase::new(&ties, &AlignmentSettings::default()).unwrap()
    };
    let (with, without) = (base(&with).alignment, base(&without).alignment);
    assert_eq!(with.status, AlignmentStatus::Valid, "{with:#?}");
    assert_eq!(with.camera_from_host, without.camera_from_host);
}
