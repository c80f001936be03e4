//! Reach of a map: cut wires, cameras that did not record, exchanges that end, and presses that no tie times.

use skinrig_analysis::result::{
    AlignmentStatus, AlignmentViolation, MapName, Warning, WarningCause,
};
use skinrig_analysis::rule::Rule;
use skinrig_analysis::tie::Tie;
use skinrig_analysis::{EventSource, EventSourceError, SessionInput, analyze};
use skinrig_model::{
    AlignmentSettings, AnalysisSettings, BoxReport, CameraId, CdEvent, HostTime, Point2, PressRole,
    RigGeometry, SentMark, SkinOutline, StereoGeometry, Verdict,
};
use skinrig_planted as planted;

use crate::timebase::bench::{Bench, CLEAN, bench};

impl Bench {
    /// As if the wire to camera `k` came off at a host time, µs.
    fn cut_wire(&mut self, k: usize, at_us: f64) {
        let camera = &self.cameras[k];
        let end_us = camera.at(at_us);
        self.edges[k].retain(|e| (e.t_us as f64) < end_us);
    }

    /// Camera `k` recorded between two host times, µs.
    fn recorded(&mut self, k: usize, from_us: f64, to_us: f64) {
        let camera = &self.cameras[k];
        let (from, to) = (camera.at(from_us) as u64, camera.at(to_us) as u64);
        self.recorded[k] = vec![(from, to)];
        self.edges[k].retain(|e| (from..to).contains(&e.t_us));
    }
}

#[test]
fn presses_beyond_lost_end_trains_are_not_timed() {
    let limits = AlignmentSettings::default();
    for seed in 40..50 {
        let mut b = bench(seed, &CLEAN);
        for k in 0..2 {
            b.recorded(k, 0.0, 40e6);
        }
        b.cut_wire(1, 26e6);
        let a = b.align(&limits).alignment;
        let shares = [0, 1].map(|k| a.lines[k].share(a.lines[k].lost));
        assert!(shares[0] < 0.01, "seed {seed}: {shares:?}");
        assert!((0.34..0.36).contains(&shares[1]), "seed {seed}: {shares:?}");
        assert_eq!(a.status, AlignmentStatus::Invalid);
        assert!(
            matches!(
                a.violations[0],
                AlignmentViolation::LostEdges {
                    camera: CameraId::Two,
                    ..
                }
            ),
            "{a:?}"
        );

        // A quarter lost is within the limit. What lies beyond the wire's end is not timed; what is near it, is, and says how well.
        let mut b = bench(seed, &CLEAN);
        b.cut_wire(1, 31e6);
        let base = b.align(&limits);
        let a = &base.alignment;
        assert_eq!(a.status, AlignmentStatus::Valid, "seed {seed}: {a:#?}");
        assert_eq!(
            (a.warnings[0].camera, &a.warnings[0].cause),
            (
                Some(CameraId::Two),
                &WarningCause::PressesFarFromTies {
                    instants: 3,
                    of: 20,
                    limit_s: 2.5
                }
            )
        );
        for at in &b.presses {
            let (_, distance) = base.tie_distance_us(1, *at).unwrap();
            assert_eq!(distance > 2.5e6, *at > 33.5e6, "{at}: {distance}");
            let found = base.camera_us(1, *at).unwrap();
            assert!((found.us - b.cameras[1].at(*at)).abs() <= found.within_us());
        }
        let half = |host_us: f64| {
            let box_us = b.boxed.at(host_us) as u64;
            base.camera_us_of_box(1, box_us).unwrap().bound_us
        };
        // 20 ppm of wander in 2 s, and further off in proportion.
        assert!((half(35e6) - half(33e6) - 40.0).abs() < 5.0);
        assert!(half(38e6) - half(30e6) > 139.0);
        // Of the interval at the presses only those count that are timed.
        let map = a
            .maps
            .iter()
            .find(|m| m.map == MapName::Camera2FromBox)
            .unwrap();
        assert!(map.interval_us.unwrap().1 < 1.0, "{map:?}");
        assert!(map.bound_us.unwrap().1 < 55.0, "{map:?}");
    }
}

#[test]
fn what_a_camera_did_not_record_is_not_lost_and_not_timed() {
    let limits = AlignmentSettings::default();
    let mut b = bench(51, &CLEAN);
    b.recorded(0, 0.0, 40e6);
    b.recorded(1, 8e6, 20e6);
    let base = b.align(&limits);
    let a = &base.alignment;
    assert_eq!(a.status, AlignmentStatus::Valid, "{a:#?}");
    let line = a.lines[1];
    assert!(line.share(line.lost) < 0.01, "{line:?}");
    // A train each second and three of a press each other second, in 28 s of 40.
    assert!((68..=72).contains(&line.trains_unrecorded), "{line:?}");
    assert_eq!(a.lines[0].trains_unrecorded, 0);
    let untimed = |at: &&f64| base.tie_distance_us(1, **at).unwrap().1 > 2.5e6;
    assert_eq!(b.presses.iter().filter(untimed).count(), 3 + 9);
    // It recorded all along and saw nothing there: most of it is lost.
    b.recorded[1].clear();
    assert_eq!(b.align(&limits).alignment.status, AlignmentStatus::Invalid);
}

#[test]
fn presses_after_the_last_exchange_are_not_timed() {
    let limits = AlignmentSettings::default();
    let mut b = bench(52, &CLEAN);
    let mut end = |after_us: f64| {
        b.reports.retain(
            |r| !matches!(r, BoxReport::Exchange { sent, .. } if sent.0 as f64 > after_us * 1e3),
        );
        let base = b.align(&limits);
        for at in &b.presses {
            let (tie, distance) = base.tie_distance_us(0, *at).unwrap();
            if *at > after_us + 1e6 {
                assert_eq!(tie, Tie::Exchange);
                assert!((distance - (at - after_us)).abs() < 0.2e6);
            }
            // The rate may have changed: the bound says so.
            let found = base.host_us_of_box(b.boxed.at(*at) as u64).unwrap();
            assert!((found.us - at).abs() <= found.bound_us);
            assert!(found.bound_us >= 20e-6 * (at - after_us));
        }
        base.alignment
    };
    let a = end(32e6);
    assert_eq!(a.status, AlignmentStatus::Valid, "{a:#?}");
    assert_eq!(a.warnings.len(), 2);
    let a = end(23e6);
    assert_eq!(a.status, AlignmentStatus::Invalid);
    let is_far = |v: &AlignmentViolation| {
        matches!(
            v,
            AlignmentViolation::FarFromTies {
                tie_limit_s: 2.5,
                limit_percent: 30.0,
                ..
            }
        )
    };
    assert!(a.violations.iter().any(is_far), "{:?}", a.violations);
}

/// Nothing happens in front of the cameras.
struct NoEvents;

impl EventSource for NoEvents {
    fn for_each_slice(
        &self,
        _: CameraId,
        _: &mut dyn FnMut(&[CdEvent]),
    ) -> Result<(), EventSourceError> {
        Ok(())
    }
}

/// A session of the presses of a bench. With `marks`, the box reports nothing, and the host knows when its marks were sent.
fn session_of(b: &Bench, marks: bool) -> SessionInput {
    let mut input = planted::session(
        RigGeometry {
            outline: SkinOutline::PAPER,
            nominal: StereoGeometry::PAPER,
            trigger_channel: Some(0),
            trigger_delay_us: [0; 2],
        },
        AnalysisSettings::default(),
    );
    for at in &b.presses {
        let middle = Point2::new(10.0, 5.0);
        let touch = planted::PlantedPress {
            timing: planted::timing(at * 1e-6, [0.01, 0.15, 0.4, 0.5, 0.6]),
            ..planted::PlantedPress::new(PressRole::Score, 0, 0, middle)
        };
        planted::press(&mut input, touch);
    }
    input.edges = b.edges.clone();
    input.recorded = b.recorded.clone();
    if marks {
        let sent = b.reports.iter().filter_map(|r| match *r {
            BoxReport::Mark { mark, at } => Some(SentMark {
                mark,
                t: HostTime((b.boxed.host_us(at.us as f64) * 1e3) as i64),
                uncertainty_ns: 10_000,
            }),
            _ => None,
        });
        input.marks = sent.collect();
    } else {
        input.box_reports = b.reports.clone();
    }
    input
}

#[test]
fn a_press_that_no_clock_reaches_is_refused_by_a_rule_that_names_itself() {
    let mut b = bench(53, &CLEAN);
    b.cut_wire(1, 31e6);
    for (marks, output) in [(false, "train"), (true, "mark")] {
        let input = session_of(&b, marks);
        let a = analyze(&input, &NoEvents).unwrap();
        assert!(a.alignment.is_usable(), "{:?}", a.alignment);
        for (press, at) in a.presses.iter().zip(&b.presses) {
            let reason = press.reason().unwrap();
            if *at + 5e5 > 33.5e6 {
                assert_eq!(press.verdict, Verdict::Invalid);
                assert_eq!(press.rule(), Some(Rule::NotTimed(CameraId::Two)));
                assert!(
                    reason.starts_with(&format!("not timed: the nearest {output} seen is "))
                        && reason.ends_with(" s away, expected at most 2.5 s (camera 2)"),
                    "{reason}"
                );
            } else {
                // The cameras saw nothing of any press.
                assert_eq!(reason, "no cluster (camera 1)");
            }
        }
        assert!(a.counts.invalid >= 3 && a.counts.add_up());
        let warned = |w: &Warning| {
            matches!(
                w.cause,
                WarningCause::PressesFarFromTies { .. } | WarningCause::PressesFarFromMarks { .. }
            )
        };
        let all = a.alignment.warnings.iter().chain(&a.warnings);
        assert_eq!(all.filter(|w| warned(w)).count(), 1, "{a:?}");
    }
    // A longer reach is a choice of the settings.
    let mut input = session_of(&b, false);
    input.settings.alignment.max_tie_distance_us = 60e6;
    input.settings.alignment.max_camera_interval_us = 1e3;
    let a = analyze(&input, &NoEvents).unwrap();
    assert_eq!(a.counts.invalid, 0);
}
