//! Owns how the parts of a comparison are said: numbers in their units, verdicts, what would decide.

use skinrig_compare::statistics::{Comparison, Interval, Needed, Verdict};
use skinrig_compare::{Against1, Comparison as Result, Row, Skin};

use crate::format::{NONE, number};

/// A value of a row in its shown unit.
pub(super) fn value(row: &Row, value: Option<f64>) -> String {
    number(value.map(|v| v * row.shown.scale), row.shown.digits)
}

/// The same with its sign.
pub(super) fn signed(row: &Row, of: f64) -> String {
    let text = value(row, Some(of));
    let zero = text.bytes().all(|b| matches!(b, b'0' | b'.'));
    if of > 0.0 && !zero {
        format!("+{text}")
    } else {
        text
    }
}

/// An interval; an end that misses reach into is open.
pub(super) fn interval(row: &Row, of: &Interval) -> String {
    match (of.low, of.high) {
        (None, None) => NONE.to_owned(),
        (low, high) => {
            let low = low.map_or_else(|| "-∞".to_owned(), |v| value(row, Some(v)));
            let high = high.map_or_else(|| "∞".to_owned(), |v| value(row, Some(v)));
            format!("[{low}, {high}]")
        }
    }
}

/// Name and unit of a row.
pub(super) fn heading(row: &Row) -> String {
    match row.shown.unit {
        "" => row.name.clone(),
        unit => format!("{} ({unit})", row.name),
    }
}

pub(super) const fn verdict(of: Option<Verdict>) -> &'static str {
    match of {
        Some(Verdict::Better) => "better",
        Some(Verdict::Worse) => "worse",
        Some(Verdict::Equivalent) => "equivalent",
        Some(Verdict::Undecided) => "undecided",
        None => "no verdict",
    }
}

/// What would decide an undecided comparison, in a sentence without a full stop.
pub(super) fn needed(of: &Comparison) -> Option<String> {
    match of.needed {
        Needed::Nothing => None,
        Needed::OutOfReach => Some("no sensible number of presses decides".to_owned()),
        Needed::More(enough) => {
            let mut text = format!(
                "if the difference is what it seems, {} places in all ({} more presses of each skin) would show `{}`",
                enough.locations,
                enough.more_presses_by_locations,
                verdict(Some(enough.towards))
            );
            if let (Some(repetitions), Some(more)) =
                (enough.repetitions, enough.more_presses_by_repetitions)
            {
                text += &format!(", or {repetitions} repetitions at the same places ({more} more)");
            }
            Some(text)
        }
    }
}

/// What kind of rig all sessions come from, when no hardware stood behind any of them.
pub(super) fn stand_in(result: &Result) -> Option<&'static str> {
    let any = |word: &str| {
        let sessions = result.skins.iter().flat_map(|s| &s.sessions);
        sessions
            .into_iter()
            .any(|f| f.rig_kind == word || f.rig_name.contains(word))
    };
    match (any("simulated"), any("emulated")) {
        (true, _) => Some("simulated"),
        (false, true) => Some("emulated"),
        (false, false) => None,
    }
}

/// One skin in a line.
pub(super) fn skin(of: &Skin) -> String {
    let sessions = match of.sessions.as_slice() {
        [one] => format!("session {} of {}", short(&one.session_id), one.started),
        many => format!("{} sessions", many.len()),
    };
    format!(
        "{}: {sessions}; {} of {} scored presses count, at {} places",
        of.name, of.counted, of.attempted, of.places
    )
}

pub(super) fn short(id: &str) -> String {
    id.chars().take(8).collect()
}

/// The headline about a skin: verdict, values and difference of the RMSE.
pub(super) fn headline(result: &Result, against: &Against1) -> String {
    let (Some(row), Some(c)) = (result.headline(), &against.comparison) else {
        return against.refused.clone().unwrap_or_default();
    };
    format!(
        "RMSE {} → {} mm, difference {} mm {}",
        value(row, Some(c.a.value)),
        value(row, Some(c.b.value)),
        signed(row, c.difference.value),
        interval(row, &c.difference),
    )
}
