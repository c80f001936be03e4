//! Changes of time: other zeros and rates of the clocks, legs, and an exchange of repetitions.

use skinrig_analysis::LegStart;
use skinrig_analysis::legs::align;
use skinrig_model::{HostDuration, HostTime};
use skinrig_planted::grid::CLOCKS;

use super::base::{PERIOD_S, PLACES, Session, contact_s, row};
use super::figures::Figure;
use super::{BASE, Relation, begins, number};

/// Moves every time of a camera's clock.
pub(super) fn move_camera(session: &mut Session, k: usize, to: impl Fn(u64) -> u64) {
    for event in &mut session.events[k] {
        event.t_us = to(event.t_us);
    }
    skinrig_planted::sort(&mut session.events[k]);
    let input = &mut session.input;
    for edge in &mut input.edges[k] {
        edge.t_us = to(edge.t_us);
    }
    input.edges[k].sort_by_key(|e| e.t_us);
    for (from, until) in input.gaps[k].iter_mut().chain(&mut input.recorded[k]) {
        (*from, *until) = (to(*from), to(*until));
    }
}

/// Moves every time of the host's clock.
fn move_host(session: &mut Session, to: impl Fn(HostTime) -> HostDuration) {
    let input = &mut session.input;
    for timing in input
        .outcomes
        .iter_mut()
        .flatten()
        .filter_map(|o| o.timing.as_mut())
    {
        *timing = timing.after(to(timing.contact));
    }
    for mark in &mut input.marks {
        mark.t = mark.t + to(mark.t);
    }
}

/// A whole number of rate bins, so that the bins hold the same events.
pub(super) const SHIFTS_US: [u64; 2] = [3_600_000_000, 1_000_000_000];

/// A figure after these shifts.
pub(super) fn shifted(path: &mut String, figure: &mut Figure) {
    for (k, by) in SHIFTS_US.into_iter().enumerate() {
        let offset = path == &format!("clocks[{k}].offset_us");
        let knot = path.starts_with(&format!("alignment.camera_from_host[{k}]"));
        if offset || knot && path.ends_with("camera_us") {
            number(figure, |us| us + by as f64);
        }
    }
}

#[test]
fn clocks_of_cameras_may_begin_at_any_time() {
    Relation {
        name: "camera clocks shifted",
        change: &|session| {
            for (k, by) in SHIFTS_US.into_iter().enumerate() {
                move_camera(session, k, |t| t + by);
            }
        },
        expect: &shifted,
        silent: &|_| false,
        digits: &[],
    }
    .holds();
}

#[test]
fn the_host_clock_may_begin_at_any_time() {
    let by = HostDuration::from_millis(86_400_000);
    let drift = |k: usize| BASE.0.analysis().clocks[k].unwrap().drift_ppm;
    let rates = [drift(0), drift(1)].map(|ppm| 1.0 + ppm * 1e-6);
    Relation {
        name: "host clock shifted by a day",
        change: &|session| move_host(session, |_| by),
        expect: &|path, figure| {
            let s = by.0 as f64 * 1e-9;
            for (k, rate) in rates.into_iter().enumerate() {
                if path == &format!("clocks[{k}].offset_us") {
                    number(figure, |us| us - rate * s * 1e6);
                }
                if path == &format!("rates[{k}].start_s") {
                    number(figure, |at| at + s);
                }
            }
            if path.ends_with("host_s") {
                number(figure, |at| at + s);
            } else if path.ends_with("host_us") {
                number(figure, |at| at + s * 1e6);
            } else if path.contains(".timing.") {
                number(figure, |ns| ns + by.0 as f64);
            }
        },
        silent: &|_| false,
        // Camera 2 counts 1.8e13 us, of which a number keeps 4 ns.
        digits: &[("zooms[].start_s", 8.0)],
    }
    .holds();
}

/// Bins of camera time hold other events, and those of the latency study do.
fn is_binned(kind: &str) -> bool {
    begins(kind, &["rates", "latency.course"])
}

/// A faster crystal in camera 1: the press windows hold the same events. Rates are per second of the camera's own clock, so they
/// have four digits in common. Its times are whole microseconds, which limits the digits of the clock and of what depends on
/// the length of windows.
#[test]
fn a_faster_camera_clock_changes_its_drift_alone() {
    let origin = BASE.0.events[0][0].t_us;
    let ppm = 60.0;
    let (offset, drift) = BASE.0.analysis().clocks[0]
        .map(|c| (c.offset_us, c.drift_ppm))
        .unwrap();
    Relation {
        name: "clock of camera 1 faster by 60 ppm",
        change: &|session| {
            move_camera(session, 0, |t| {
                let after = t as f64 - origin as f64;
                (t as f64 + after * ppm * 1e-6).round() as u64
            });
        },
        expect: &|path, figure| {
            if path == "clocks[0].drift_ppm" || path == "alignment.maps[0].drift_ppm" {
                number(figure, |_| drift + ppm + drift * ppm * 1e-6);
            } else if path == "clocks[0].offset_us" {
                number(figure, |_| offset + (offset - origin as f64) * ppm * 1e-6);
            }
        },
        silent: &is_binned,
        digits: &[
            ("clocks[]", 4.0),
            ("alignment.maps", 4.0),
            ("presses[].views[].rate", 4.0),
            ("presses[].views[].idle", 4.0),
            ("bit_rates", 4.0),
            ("zooms", 4.0),
            ("reduction.curves[].rows[].press_bytes", 4.0),
            ("reduction.curves[].rows[].idle_bytes", 4.0),
            ("indentation", 6.0),
            ("latency", 6.0),
        ],
    }
    .holds();
}

/// Two repetitions of the same presses are made in the other order. The marks, seen in whole microseconds, are on a slightly other
/// line, and windows begin up to a microsecond earlier or later.
#[test]
fn repetitions_may_be_made_in_any_order() {
    let block_s = PERIOD_S * f64::from(PLACES);
    // The second of background before a press moves with it.
    let from_s = contact_s(row(2, 0)) - 1.05;
    // Each block moves by the length of the other.
    let moves = |s: f64| match ((s - from_s) / block_s).floor() {
        0.0 => block_s,
        1.0 => -block_s,
        _ => 0.0,
    };
    Relation {
        name: "third and fourth repetition exchanged in time",
        change: &|session| {
            move_host(session, |t| {
                HostDuration::from_secs_f64(moves(t.as_secs_f64()))
            });
            for (k, (offset_us, ppm)) in CLOCKS.into_iter().enumerate() {
                // Both clocks count whole microseconds in a block: 784 more or 980 less than the host.
                let rate = 1.0 + ppm * 1e-6;
                move_camera(session, k, |t| {
                    let host_s = (t as f64 - offset_us) / rate * 1e-6;
                    t.saturating_add_signed((moves(host_s) * rate * 1e6).round() as i64)
                });
            }
        },
        expect: &|path, figure| {
            if path.contains(".timing.") {
                number(figure, |ns| ns + 1e9 * moves(ns * 1e-9));
            }
        },
        // Rates, pictures and close-ups are in the order of time.
        silent: &|kind| is_binned(kind) || begins(kind, &["pictures", "zooms"]),
        digits: &[
            ("clocks[].residual", 1.5),
            ("alignment.maps[].residual", 1.5),
            ("clocks[]", 4.0),
            ("alignment.maps", 4.0),
            ("presses[].views[].rate", 5.5),
            ("presses[].views[].idle", 5.5),
            ("bit_rates", 5.5),
            ("reduction.curves[].rows[].press_bytes", 5.5),
            ("reduction.curves[].rows[].idle_bytes", 5.5),
            ("indentation", 5.0),
            ("latency", 5.5),
        ],
    }
    .holds();
}

/// The run is interrupted between two repetitions, and the clocks begin anew.
#[test]
fn a_session_in_two_legs_has_the_results_of_one() {
    let at_s = contact_s(row(3, 0)) - 0.8;
    Relation {
        name: "split into two legs, merged",
        change: &|session| {
            let cut = [0, 1].map(|k| skinrig_planted::grid::camera_us(k, at_s) as u64);
            let lost = [123_456, 9_000_001];
            let leg = LegStart::recorded(
                HostTime::from_secs_f64(at_s),
                [0, 1].map(|k| cut[k] + lost[k]),
            );
            for k in 0..2 {
                move_camera(session, k, |t| if t < cut[k] { t } else { t + lost[k] });
            }
            session.input.legs = vec![leg];
            align(&mut session.input);
            let moved = session.input.legs[0].moved_us;
            for k in 0..2 {
                for event in &mut session.events[k] {
                    if event.t_us >= cut[k] + lost[k] {
                        event.t_us = event.t_us.saturating_add_signed(moved[k]);
                    }
                }
            }
        },
        expect: &|_, _| (),
        silent: &|kind| kind.starts_with("legs"),
        digits: &[],
    }
    .holds();
}
