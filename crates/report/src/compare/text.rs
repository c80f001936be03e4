//! Formats the parts of a comparison: values with units, verdicts, required presses.

use skinrig_compare::{BaselineComparison, Comparison as Result, Row, Skin};
use skinrig_statistics::{Comparison, Interval, PressesNeeded, Verdict};

use crate::format::{NONE, number};

/// Level of the intervals of metrics: `95 %`, or that of the last look.
pub(super) fn level(result: &Result) -> String {
    let percent = 100.0 * (1.0 - result.settings.alpha);
    let digits = if result.sequential.is_some() { 2 } else { 0 };
    format!("{} %", number(Some(percent), digits))
}

/// Value in the display unit of the row.
pub(super) fn value(row: &Row, value: Option<f64>) -> String {
    number(value.map(|v| v * row.format.scale), row.format.digits)
}

/// Same, with a sign.
pub(super) fn signed(row: &Row, of: f64) -> String {
    let text = value(row, Some(of));
    let zero = text.bytes().all(|b| matches!(b, b'0' | b'.'));
    if of > 0.0 && !zero {
        format!("+{text}")
    } else {
        text
    }
}

/// Interval; infinite ends are open.
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
    match row.format.unit {
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

/// What the verdicts and intervals of several skins hold for; `None` for one.
pub(super) fn together(result: &Result) -> Option<String> {
    let others = result.skins.len().checked_sub(1).filter(|n| *n > 1)?;
    let all = match others {
        2 => "both".to_owned(),
        n => format!("all {n}"),
    };
    Some(format!(
        "verdicts and intervals hold for {all} comparisons with A together"
    ))
}

/// Presses required for a decision, without a full stop; `None` when decided.
pub(super) fn needed(of: &Comparison) -> Option<String> {
    match of.needed {
        PressesNeeded::Nothing => None,
        PressesNeeded::OutOfReach => Some("no practical number of presses would decide".to_owned()),
        PressesNeeded::Unknown => {
            Some("the values do not vary: nothing tells how many presses would decide".to_owned())
        }
        PressesNeeded::Sessions { towards, each } => Some(format!(
            "if the measured difference is real, {each} sessions of each skin, mounted anew, would show `{}`; more presses in these would not",
            verdict(Some(towards))
        )),
        PressesNeeded::More(enough) => {
            let mut text = format!(
                "if the measured difference is real, {} locations in total ({} more presses per skin) would show `{}`",
                enough.locations,
                enough.more_presses_by_locations,
                verdict(Some(enough.towards))
            );
            if let (Some(repetitions), Some(more)) =
                (enough.repetitions, enough.more_presses_by_repetitions)
            {
                text +=
                    &format!(", or {repetitions} repetitions at the same locations ({more} more)");
            }
            Some(text)
        }
    }
}

/// `simulated` or `emulated` when any session was recorded without hardware.
pub(super) fn stand_in(result: &Result) -> Option<&'static str> {
    let any = |word: &str| {
        let sessions = result.skins.iter().flat_map(|s| &s.sessions);
        sessions
            .into_iter()
            .any(|f| f.origin.as_deref() == Some(word))
    };
    match (any("simulated"), any("emulated")) {
        (true, _) => Some("simulated"),
        (false, true) => Some("emulated"),
        (false, false) => None,
    }
}

/// Summary of a skin in one line.
pub(super) fn skin(of: &Skin) -> String {
    let sessions = match of.sessions.as_slice() {
        [one] => format!("session {} of {}", short(&one.session_id), one.started),
        many => format!("{} sessions", many.len()),
    };
    format!(
        "{}: {sessions}; {} of {} scored presses count, at {} locations",
        of.name, of.counted, of.attempted, of.locations
    )
}

pub(super) fn short(id: &str) -> String {
    id.chars().take(8).collect()
}

/// A number of things.
pub(super) fn counted(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// Limits a verdict on the RMSE, where one skin locates fewer presses.
pub(super) const WHERE_LOCATED: &str = " where presses are located";

/// That one of both skins locates fewer presses than the other, if this is certain: its RMSE is that of its easier presses.
pub(super) fn fewer_located(result: &Result, against: &BaselineComparison) -> Option<String> {
    let (fewer, row) = result.fewer_located(against.subject)?;
    let of = row.against_first.iter();
    let compared = of.filter(|a| a.subject == against.subject);
    let compared = compared.filter_map(|a| a.comparison.as_ref()).next()?;
    let (own, other) = match fewer {
        0 => (compared.a.value, compared.b.value),
        _ => (compared.b.value, compared.a.value),
    };
    Some(format!(
        "{} locates fewer presses: {} against {} {}",
        result.skins.get(fewer)?.letter,
        value(row, Some(own)),
        value(row, Some(other)),
        row.format.unit,
    ))
}

/// RMSE of a skin and the first, with difference and interval.
pub(super) fn headline(result: &Result, against: &BaselineComparison) -> String {
    let compared = against.comparison.as_ref().zip(against.difference());
    let Some((row, (c, difference))) = result.headline().zip(compared) else {
        return against
            .error
            .as_ref()
            .map_or_else(String::new, ToString::to_string);
    };
    format!(
        "RMSE {} → {} mm, difference {} mm {}",
        value(row, Some(c.a.value)),
        value(row, Some(c.b.value)),
        signed(row, difference.value),
        interval(row, &difference),
    )
}
