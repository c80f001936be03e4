//! Owns the legs of a session: aligns the camera clocks of all legs to one line.
//!
//! In each leg a camera's clock starts anew at an unknown time: the recorder only placed the legs one after another. After
//! each leg's clock has been fitted on its own, its times are shifted by whole µs so that one line of camera time over host
//! time holds for all legs. From then on the session is like any other.

use skinrig_model::{CameraId, HostTime};

use crate::clock::fit_marks;
use crate::input::SessionInput;
use crate::leg::{LegLine, LegStart, edges_of, leg_at};
use crate::result::{LegClock, Warning, WarningCause};
use crate::timebase::TimeBase;

/// Maximum advance of a leg's events before its host time, µs: half of the minimum pause between two legs.
const BEFORE_US: f64 = 0.5e6;

/// Shifts the camera times of edges and gaps in all further legs onto the line of the first, and records the shifts in
/// [`SessionInput::legs`]; event sources must apply them too. A session with a single leg is unchanged.
pub fn align(input: &mut SessionInput) {
    if input.legs.is_empty() {
        return;
    }
    let base = crate::session_base::time_base(input);
    for k in 0..2 {
        let lines: Vec<Option<LegLine>> = (0..=input.legs.len())
            .map(|leg| {
                let trains = base.as_ref().and_then(|b| b.leg_line(leg, k));
                trains.or_else(|| marks(input, leg, k))
            })
            .collect();
        let moves = moves(&input.legs, &lines, k);
        move_camera(input, k, &moves);
        // A camera's zero may be long before its first event; the recording of a leg begins at its host time.
        // A leg without its own line begins where the lines of the others predict; otherwise an empty leg could truncate
        // theirs.
        let known = |leg: usize| lines[leg].map(|line| (line, moves[leg]));
        let other = (0..lines.len()).find_map(known);
        for (i, leg) in input.legs.iter_mut().enumerate() {
            if let Some((line, by)) = known(i + 1).or(other) {
                let begins_us = line.fit.camera_us(leg.origin.0 as f64 * 1e-3) + by as f64;
                leg.camera_us[k] = (begins_us - BEFORE_US).max(0.0) as u64;
            }
        }
    }
}

/// Shift of each leg, the first included, µs.
fn moves(legs: &[LegStart], lines: &[Option<LegLine>], k: usize) -> Vec<i64> {
    let known = lines.iter().enumerate();
    let known = known.filter_map(|(leg, line)| Some((leg, (*line)?)));
    let steadiest = known.min_by(|a, b| a.1.fit.drift_se_ppm.total_cmp(&b.1.fit.drift_se_ppm));
    // Offset of a leg's camera clock from the host clock, as if both had started together.
    let start = |leg: usize| {
        let begun = leg.checked_sub(1).map(|i| &legs[i]);
        begun.map_or(0.0, |b| b.origin.0 as f64 * 1e-3 - b.recorded_us[k] as f64)
    };
    let offset_of = |leg: usize| match (steadiest, &lines[leg]) {
        (Some((_, best)), Some(line)) => {
            let host_us = line.middle_us;
            let rate = 1.0 + best.fit.drift_ppm * 1e-6;
            best.fit.camera_us(best.middle_us) + (host_us - best.middle_us) * rate
                - line.fit.camera_us(host_us)
        }
        // Nothing ties its clocks: assume that they started together as in the best-known leg.
        (best, _) => start(leg) - start(best.map_or(0, |(leg, _)| leg)),
    };
    let first = offset_of(0);
    (0..lines.len())
        .map(|leg| (offset_of(leg) - first).round() as i64)
        .collect()
}

fn move_camera(input: &mut SessionInput, k: usize, moves: &[i64]) {
    let begins: Vec<u64> = input.legs.iter().map(|leg| leg.camera_us[k]).collect();
    let moved = |t_us: u64| {
        let leg = begins.partition_point(|from| *from <= t_us);
        // End of an open-ended gap.
        if t_us == u64::MAX {
            t_us
        } else {
            t_us.saturating_add_signed(moves[leg])
        }
    };
    for edge in &mut input.edges[k] {
        edge.t_us = moved(edge.t_us);
    }
    for (from, to) in &mut input.gaps[k] {
        (*from, *to) = (moved(*from), moved(*to));
    }
    for (from, to) in &mut input.recorded[k] {
        // All of it belongs to the leg in which it begins.
        let by = moves[begins.partition_point(|begin| begin <= from)];
        (*from, *to) = (from.saturating_add_signed(by), to.saturating_add_signed(by));
    }
    for (leg, by) in input.legs.iter_mut().zip(&moves[1..]) {
        leg.camera_us[k] = moved(leg.camera_us[k]);
        leg.moved_us[k] += *by;
    }
}

/// Without box reports: uses the marks that the host sent.
fn marks(input: &SessionInput, leg: usize, k: usize) -> Option<LegLine> {
    let channel = input.rig.trigger_channel?;
    let sent = input.marks.iter().copied();
    let sent: Vec<_> = sent.filter(|m| leg_at(&input.legs, m.t) == leg).collect();
    let edges = edges_of(&input.edges[k], &input.legs, leg, k);
    let fit = fit_marks(edges, channel, &sent).ok()?.fit;
    let sum: f64 = sent.iter().map(|m| m.t.0 as f64 * 1e-3).sum();
    Some(LegLine {
        fit,
        middle_us: sum / sent.len() as f64,
    })
}

/// Clocks of each leg; empty for a session with a single leg.
pub(crate) fn clocks(input: &SessionInput, base: Option<&TimeBase>) -> Vec<LegClock> {
    if input.legs.is_empty() {
        return Vec::new();
    }
    (0..=input.legs.len())
        .map(|leg| LegClock {
            number: leg as u32 + 1,
            start_s: leg
                .checked_sub(1)
                .map_or(0.0, |i| input.legs[i].origin.as_secs_f64()),
            cameras: [0, 1].map(|k| {
                let trains = base.and_then(|b| b.leg_line(leg, k));
                let line = trains.or_else(|| marks(input, leg, k));
                line.map(|line| line.fit)
            }),
        })
        .collect()
}

/// A warning for every leg with presses in which a camera's own trains or marks give no clock while there are other legs:
/// its position among them is then known only by its nominal start. `pressed_us`: host times of contacts, µs.
pub(crate) fn nominal_only(
    legs: &[LegStart],
    clocks: &[LegClock],
    pressed_us: impl Iterator<Item = f64>,
) -> Vec<Warning> {
    let mut pressed = vec![false; legs.len() + 1];
    for us in pressed_us {
        pressed[leg_at(legs, HostTime((us * 1e3) as i64))] = true;
    }
    let each = clocks.iter().zip(pressed).filter(|(_, pressed)| *pressed);
    let unknown = each.flat_map(|(leg, _)| {
        let cameras = CameraId::ALL.into_iter().zip(&leg.cameras);
        cameras
            .filter(|(_, fit)| fit.is_none())
            .map(|(camera, _)| Warning {
                leg: Some(leg.number),
                ..Warning::of_camera(camera, WarningCause::NominalStart)
            })
    });
    unknown.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::result::{ClockFit, ClockMethod};
    use skinrig_model::TriggerEdge;

    fn edge(t_us: u64) -> TriggerEdge {
        TriggerEdge {
            t_us,
            channel: 0,
            rising: true,
        }
    }

    const LEGS: [LegStart; 3] = [
        LegStart::recorded(HostTime(10_000_000_000), [5_000_000, 7_000_000]),
        // It is empty: the next one begins at the same camera times.
        LegStart::recorded(HostTime(12_000_000_000), [9_000_000, 8_000_000]),
        LegStart::recorded(HostTime(14_000_000_000), [9_000_000, 8_000_000]),
    ];

    #[test]
    fn every_edge_belongs_to_one_leg_and_an_empty_leg_has_none() {
        let edges = [0, 4_999_999, 5_000_000, 8_999_999, 9_000_000, 20_000_000].map(edge);
        let of = |leg| edges_of(&edges, &LEGS, leg, 0).len();
        assert_eq!([0, 1, 2, 3].map(of), [2, 2, 0, 2]);
        let at = |ns| leg_at(&LEGS, HostTime(ns));
        assert_eq!(
            [
                -1,
                9_999_999_999,
                10_000_000_000,
                13_999_999_999,
                14_000_000_000
            ]
            .map(at),
            [0, 0, 1, 2, 3]
        );
    }

    #[test]
    fn a_leg_placed_by_its_nominal_start_is_reported() {
        let fit = ClockFit {
            method: ClockMethod::TriggerMarks,
            offset_us: 0.0,
            drift_ppm: 0.0,
            drift_se_ppm: 1.0,
            residual_rms_us: 1.0,
            residual_max_us: 2.0,
            n: 20,
            rejected: 0,
        };
        let clock = |number, cameras| LegClock {
            number,
            start_s: 0.0,
            cameras,
        };
        let clocks = [
            clock(1, [Some(fit); 2]),
            clock(2, [Some(fit), None]),
            clock(3, [None; 2]),
            clock(4, [Some(fit); 2]),
        ];
        // The third leg has no presses.
        let pressed = [1e6, 11e6, 11.5e6, 15e6].into_iter();
        let said = nominal_only(&LEGS, &clocks, pressed);
        assert_eq!(said.len(), 1, "{said:?}");
        let text = said[0].to_string();
        assert!(text.starts_with("leg 2, camera 2: expected"), "{text}");
        assert_eq!(nominal_only(&[], &[], [1e6].into_iter()), []);
    }
}
