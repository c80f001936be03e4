//! Describes the course of a session: its legs, losses and retaken presses.

use crate::format::{number, or_missing};
use crate::provenance::{LegRow, LossRow, Provenance};

/// Description of a leg, without its number.
pub(crate) fn leg(leg: &LegRow) -> String {
    let apart = leg.apart_s.map_or(String::new(), |s| {
        format!(", {} after the previous leg", duration(s))
    });
    format!(
        "{}, from {} s{apart}: {}",
        or_missing(&leg.started),
        number(Some(leg.start_s), 1),
        leg.end
    )
}

/// Number of superseded attempts and how they count; `None` without retakes.
pub(crate) fn retaken(p: &Provenance) -> Option<String> {
    let mut presses: Vec<u32> = p.retaken.iter().map(|r| r.press).collect();
    presses.sort_unstable();
    presses.dedup();
    let (n, presses) = (p.retaken.len(), presses.len());
    let attempts = if n == 1 { "attempt" } else { "attempts" };
    let what = if presses == 1 { "press" } else { "presses" };
    (n > 0).then(|| {
        format!(
            "{n} {attempts} at {presses} {what} retaken; each press counts once, by its last attempt"
        )
    })
}

/// One line per reason for a retake, in the order of the first press.
pub(crate) fn reasons(p: &Provenance) -> Vec<String> {
    let mut groups: Vec<(&str, Vec<String>)> = Vec::new();
    for row in &p.retaken {
        let press = row.press.to_string();
        match groups.iter_mut().find(|(reason, _)| *reason == row.reason) {
            Some((_, presses)) => presses.push(press),
            None => groups.push((&row.reason, vec![press])),
        }
    }
    let lines = groups.into_iter().map(|(reason, presses)| {
        let plural = if presses.len() == 1 { "" } else { "es" };
        format!("press{plural} {}: {reason}", presses.join(", "))
    });
    lines.collect()
}

/// Losses of one camera listed individually.
const MAX_LOSSES: usize = 5;

/// Time and length of each loss of the camera with this index.
pub(crate) fn losses(p: &Provenance, camera: usize) -> Vec<String> {
    let mine = |row: &&LossRow| usize::from(row.camera) == camera + 1;
    let times = p.losses.iter().filter(mine).map(|row| row.time.to_string());
    let mut lines: Vec<String> = times.collect();
    if let Some(more) = lines.len().checked_sub(MAX_LOSSES + 1) {
        lines.truncate(MAX_LOSSES);
        lines.push(format!("and {} times more", more + 1));
    }
    lines
}

/// `40 s`, `25 min` or `7 h 5 min`.
fn duration(seconds: f64) -> String {
    // Negative values and NaN become 0, because `as` saturates.
    let minutes = (seconds / 60.0).round() as u64;
    match minutes {
        0..2 => format!("{} s", seconds.round().max(0.0) as u64),
        2..120 => format!("{minutes} min"),
        _ => format!("{} h {} min", minutes / 60, minutes % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_read_well() {
        for (seconds, words) in [
            (-0.4, "0 s"),
            (89.0, "89 s"),
            (90.0, "2 min"),
            (7_169.0, "119 min"),
            (25_500.0, "7 h 5 min"),
        ] {
            assert_eq!(duration(seconds), words);
        }
    }
}
