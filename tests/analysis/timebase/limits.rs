//! Limits of the certificate: what makes a session invalid, and what the violation says.

use skinrig_analysis::result::AlignmentStatus;
use skinrig_analysis::timebase::{TimeBase, TimeBaseInput};
use skinrig_model::{AlignmentSettings, BoxReport, HostTime};

use crate::timebase::bench::{Bench, CLEAN, Clock, Conditions, NOISY, Random, bench, run};

fn status(b: &Bench, limits: &AlignmentSettings) -> (AlignmentStatus, String) {
    let a = b.align(limits).alignment;
    let texts: Vec<String> = a.violations.iter().map(ToString::to_string).collect();
    (a.status, texts.join("; "))
}

#[test]
fn a_session_beyond_a_limit_is_invalid_and_names_the_limit() {
    let clean = bench(1, &CLEAN);
    let limits = AlignmentSettings::default();
    assert_eq!(
        status(&clean, &limits),
        (AlignmentStatus::Valid, String::new())
    );
    let noisy = bench(1, &NOISY);
    for (limits, output) in [
        (
            AlignmentSettings {
                max_residual_us: 0.01,
                ..limits
            },
            "residual rms",
        ),
        (
            AlignmentSettings {
                max_camera_interval_us: 1.0,
                ..limits
            },
            "95 % interval at the presses",
        ),
        (
            AlignmentSettings {
                max_host_interval_us: 100.0,
                ..limits
            },
            "host from box, bound at the presses",
        ),
        (
            AlignmentSettings {
                max_drift_ppm: 0.001,
                ..limits
            },
            "drift",
        ),
        (
            AlignmentSettings {
                max_lost: 0.1,
                ..limits
            },
            "lost edges",
        ),
        (
            AlignmentSettings {
                max_spurious: 0.01,
                ..limits
            },
            "doubled and spurious edges",
        ),
        (
            AlignmentSettings {
                min_coverage: 1.0,
                ..limits
            },
            "share outside the stated interval",
        ),
    ] {
        let (found, words) = status(&noisy, &limits);
        assert_eq!(found, AlignmentStatus::Invalid, "{output}");
        assert!(words.contains(output), "{output}: {words}");
    }
    // No edge of one camera, as when its cable is off.
    let mut dead = bench(2, &CLEAN);
    dead.edges[1].clear();
    let (found, words) = status(&dead, &limits);
    assert_eq!(found, AlignmentStatus::Invalid);
    assert!(words.contains("camera 2 from box"), "{words}");
    // The wrong camera's cable: another bench's trains have the same names at other times.
    let mut swapped = bench(3, &CLEAN);
    swapped.edges[0] = bench(4, &CLEAN).edges[0].clone();
    assert_eq!(status(&swapped, &limits).0, AlignmentStatus::Invalid);
    // No exchange with the host.
    let mut silent = bench(5, &CLEAN);
    silent
        .reports
        .retain(|r| !matches!(r, BoxReport::Exchange { .. }));
    let (found, words) = status(&silent, &limits);
    assert_eq!(found, AlignmentStatus::Invalid);
    assert!(words.contains("host from box"), "{words}");
    // A host clock that jumped in the middle.
    let mut jumped = bench(6, &CLEAN);
    for report in &mut jumped.reports {
        if let BoxReport::Exchange { sent, received, .. } = report
            && sent.0 > 20_000_000_000
        {
            sent.0 += 50_000_000;
            received.0 += 50_000_000;
        }
    }
    assert_eq!(status(&jumped, &limits).0, AlignmentStatus::Invalid);
}

/// Clocks whose rate changes faster than a clock's may: of a camera, of the box, and a jump. Their trains came, and are not called lost.
#[test]
fn a_fast_drift_is_distinguished_from_a_lossy_wire() {
    let limits = AlignmentSettings::default();
    let steady = Clock::oscillating(5e8, (0.0, 1.0));
    for period_s in [3.0, 7.0, 20.0] {
        for ppm in [100.0, 300.0, 1_000.0] {
            let oscillating =
                Clock::oscillating(3e9, (ppm * 1e-6, std::f64::consts::TAU / (period_s * 1e6)));
            for (of_box, name) in [(false, "camera 1"), (true, "trigger box")] {
                let (boxed, one) = match of_box {
                    true => (oscillating.clone(), steady.clone()),
                    false => (steady.clone(), oscillating.clone()),
                };
                let b = run(Random(9), boxed, [one, steady.clone()], &CLEAN);
                let (found, words) = status(&b, &limits);
                let case = format!("{name}, {ppm} ppm in {period_s} s: {words}");
                assert_eq!(found, AlignmentStatus::Invalid, "{case}");
                assert!(words.contains(&format!("{name}, clock drift: ")), "{case}");
                assert!(!words.contains("edges: expected"), "{case}");
            }
        }
    }
    // A wire that loses and invents edges is no clock's fault.
    let worn = Conditions {
        lost: 0.4,
        spurious: 0.05,
        ..CLEAN
    };
    let (found, words) = status(&bench(1, &worn), &limits);
    assert_eq!(found, AlignmentStatus::Invalid);
    assert!(
        words.contains("lost edges") && !words.contains("clock drift"),
        "{words}"
    );
}

#[test]
fn no_certificate_without_a_press_and_no_statement_without_a_box() {
    let mut b = bench(7, &CLEAN);
    b.presses.clear();
    b.edges[0].clear();
    assert_eq!(
        status(&b, &AlignmentSettings::default()).0,
        AlignmentStatus::NotCertified
    );
    let ties = TimeBaseInput {
        reports: &[],
        edges: [&[], &[]],
        channel: 0,
        recorded: [&[], &[]],
        legs: &[],
        used_at_us: &[1.0],
    };
    assert_eq!(TimeBase::new(&ties, &AlignmentSettings::default()), None);
}

#[test]
fn a_reset_of_the_box_in_the_middle_is_bridged() {
    // Two benches after one another; the box goes on counting its trains, its clock starts anew.
    let mut b = bench(8, &NOISY);
    let half_us = 21e6;
    let jump_us = b.boxed.at(half_us) as u64 - 5_000;
    let late = |us: u64| us > jump_us;
    let at_of = |r: &BoxReport| match *r {
        BoxReport::Exchange { at, .. }
        | BoxReport::Mark { at, .. }
        | BoxReport::Sync { at, .. }
        | BoxReport::Input { at, .. } => at.us,
        BoxReport::Reset { .. } => 0,
    };
    let (mut after, before): (Vec<_>, Vec<_>) =
        b.reports.iter().copied().partition(|r| late(at_of(r)));
    for report in &mut after {
        match report {
            BoxReport::Exchange { at, .. }
            | BoxReport::Mark { at, .. }
            | BoxReport::Sync { at, .. }
            | BoxReport::Input { at, .. } => at.us -= jump_us,
            BoxReport::Reset { .. } => {}
        }
    }
    let noticed = HostTime((half_us * 1e3) as i64);
    b.reports = [before, vec![BoxReport::Reset { noticed }], after].concat();
    let base = b.align(&AlignmentSettings::default());
    assert_eq!(
        (base.alignment.status, base.alignment.resets),
        (AlignmentStatus::Valid, 1),
        "{:#?}",
        base.alignment
    );
    for at in &b.presses {
        for (k, camera) in b.cameras.iter().enumerate() {
            let found = base.camera_us(k, *at).unwrap();
            assert!(
                (found.us - camera.at(*at)).abs() <= found.within_us(),
                "{at}"
            );
        }
    }
}
