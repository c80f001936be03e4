//! Formats a night for people: amounts with units, limits, causes.

use skinrig_model::Limit;
use skinrig_nightly::rules::{CROSS_CHECK_RULES, RULES};
use skinrig_nightly::{Cause, CheckResult, Measurement, Night, Verdict};

use crate::format::{NONE, number, phrase};

/// Prefixes of large numbers.
const LARGE: [(f64, &str); 4] = [(1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, "")];
/// Prefixes of short times.
const SHORT: [(f64, &str); 3] = [(1.0, "s"), (1e-3, "ms"), (1e-6, "µs")];

/// `value` with its unit: `12.3 µs`, `1.45 MB/s`, `0.042 mm`.
pub(super) fn amount(value: Option<f64>, unit: &str) -> String {
    let Some(v) = value.filter(|v| v.is_finite()) else {
        return NONE.to_owned();
    };
    match unit {
        "" => plain(v),
        "s" => {
            let fits = |(scale, _): &&(f64, &str)| v.abs() >= *scale * 0.999_5;
            let (scale, name) = SHORT.iter().find(fits).unwrap_or(&SHORT[2]);
            if v == 0.0 {
                return "0 s".to_owned();
            }
            format!("{} {name}", three(v / scale))
        }
        "B" | "B/s" | "ev/s" => {
            let fits = |(scale, _): &&(f64, &str)| v.abs() >= *scale * 0.999_5;
            let (scale, prefix) = LARGE.iter().find(fits).unwrap_or(&LARGE[3]);
            format!("{} {prefix}{unit}", three(v / scale))
        }
        "mm" => format!("{} mm", number(Some(v), 3)),
        "%" => format!("{} %", number(Some(v), 1)),
        _ => format!("{} {unit}", three(v)),
    }
}

/// A value without a unit.
fn plain(v: f64) -> String {
    if v.fract() == 0.0 {
        number(Some(v), 0)
    } else {
        three(v)
    }
}

/// Three significant digits.
fn three(v: f64) -> String {
    let digits = match v.abs() {
        a if a >= 99.95 || a == 0.0 => 0,
        a if a >= 9.995 => 1,
        _ => 2,
    };
    number(Some(v), digits)
}

/// `at most 20 µs`, `from -200 ppm to 200 ppm`.
pub(super) fn limit(limit: &Limit, unit: &str) -> String {
    let of = |v| amount(Some(v), unit);
    match (limit.at_least, limit.at_most) {
        (Some(least), Some(most)) => format!("from {} to {}", of(least), of(most)),
        (Some(least), None) => format!("at least {}", of(least)),
        (None, Some(most)) => format!("at most {}", of(most)),
        (None, None) => "none".to_owned(),
    }
}

/// Measured and allowed value: `jitter 35.1 µs, allowed at most 20.0 µs`.
pub(super) fn against(m: &Measurement) -> String {
    let mut text = match m.value {
        Some(_) => format!("{} {}", m.metric, amount(m.value, &m.unit)),
        None => format!("{} not measured", m.metric),
    };
    if let Some(of) = &m.limit {
        text.push_str(&format!(", allowed {}", limit(of, &m.unit)));
    }
    if m.verdict == Verdict::Inconclusive {
        text.push_str(&format!(", {} of {} samples", m.n.unwrap_or(0), m.needs));
    }
    if let Some(note) = &m.note {
        text.push_str(&format!(" ({note})"));
    }
    text
}

/// Reason behind a rule.
pub(super) fn reason(rule: &str) -> Option<&'static str> {
    let named = RULES
        .iter()
        .chain(CROSS_CHECK_RULES)
        .find(|r| r.name == rule);
    named.map(|r| r.reason)
}

/// Why a check failed, in one sentence, with the name of the rule.
pub(super) fn why(check: &CheckResult) -> Option<String> {
    let rule = check.rule.as_ref();
    let rule = rule.map_or_else(String::new, |rule| format!(" [{rule}]"));
    because(check, &check.witnesses).map(|text| text + &rule)
}

/// Why a check failed, in one sentence without identifiers.
pub(super) fn why_in_words(check: &CheckResult) -> Option<String> {
    let witnesses: Vec<String> = check.witnesses.iter().map(|w| phrase(w)).collect();
    because(check, &witnesses)
}

fn because(check: &CheckResult, witnesses: &[String]) -> Option<String> {
    let cause = check.cause?.name();
    let because = match (&check.rule, witnesses) {
        (None, _) if check.verdict == Verdict::Inconclusive => {
            "too few samples for a verdict".to_owned()
        }
        (None, _) => "a limit was violated and no evidence explains it".to_owned(),
        (Some(rule), []) => reason(rule).unwrap_or_default().to_owned(),
        (Some(rule), some) => {
            format!("{}: {}", reason(rule).unwrap_or_default(), some.join(", "))
        }
    };
    Some(format!("{cause}: {because}"))
}

/// Causes in order of inspection, with the checks that blame them.
pub(super) fn causes(night: &Night) -> Vec<(Cause, Vec<&CheckResult>)> {
    [
        Cause::Rig,
        Cause::Infrastructure,
        Cause::Software,
        Cause::Skin,
    ]
    .into_iter()
    .map(|cause| {
        let named = |c: &&CheckResult| !c.verdict.is_good() && c.cause == Some(cause);
        (cause, night.checks.iter().filter(named).collect::<Vec<_>>())
    })
    .filter(|(_, checks)| !checks.is_empty())
    .collect()
}

/// Headline of the night.
pub(super) fn headline(night: &Night) -> String {
    let looked_at: Vec<String> = causes(night)
        .iter()
        .map(|(cause, _)| match cause {
            Cause::Infrastructure => "the computer and its cables".to_owned(),
            Cause::Rig => "the rig".to_owned(),
            Cause::Software => "the software".to_owned(),
            Cause::Skin => "the skin".to_owned(),
        })
        .collect();
    let marginal = count(night, Verdict::Marginal);
    match (looked_at.as_slice(), night.verdict, marginal) {
        ([], Verdict::Skipped, _) => "Nothing was checked".to_owned(),
        ([], verdict, _) if !verdict.is_good() => match night.ended_early {
            Some(_) => "The night ended early".to_owned(),
            None => "Nothing was checked".to_owned(),
        },
        ([], _, 0) => "All within limits".to_owned(),
        ([], _, 1) => "All within limits, one marginal".to_owned(),
        ([], _, n) => format!("All within limits, {n} marginal"),
        (some, _, _) => format!("Look at {}", listed(some)),
    }
}

/// `a, b and c`.
pub(super) fn listed(words: &[String]) -> String {
    match words {
        [] => String::new(),
        [one] => one.clone(),
        [most @ .., last] => format!("{} and {last}", most.join(", ")),
    }
}

/// True if any check ran.
pub(super) fn was_made(night: &Night) -> bool {
    night.checks.iter().any(|c| !c.attempts.is_empty())
}

/// Number of checks with this verdict.
pub(super) fn count(night: &Night, verdict: Verdict) -> usize {
    night.checks.iter().filter(|c| c.verdict == verdict).count()
}

/// `12 PASS, 1 MARGINAL, 1 FAIL`.
pub(super) fn tally(night: &Night) -> String {
    let counted = Verdict::ALL.iter().rev().filter_map(|v| {
        let n = count(night, *v);
        (n > 0).then(|| format!("{n} {}", v.name()))
    });
    counted.collect::<Vec<_>>().join(", ")
}

/// `40 s`, `6.2 min`.
#[must_use]
pub fn span(seconds: f64) -> String {
    match seconds {
        s if s < 9.95 => format!("{} s", number(Some(s.max(0.0)), 1)),
        s if s < 120.0 => format!("{} s", number(Some(s), 0)),
        s => format!("{} min", number(Some(s / 60.0), 1)),
    }
}

/// Total duration of all attempts at a check, s.
pub(super) fn took_s(check: &CheckResult) -> f64 {
    check.attempts.iter().fold(0.0, |sum, a| sum + a.took_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn amounts_read_as_people_write_them() {
        for (value, unit, text) in [
            (0.000_012_34, "s", "12.3 µs"),
            (0.000_000_2, "s", "0.20 µs"),
            (0.5, "s", "500 ms"),
            (1.0, "s", "1.00 s"),
            (0.0, "s", "0 s"),
            (-0.002, "s", "-2.00 ms"),
            (1.45e6, "B/s", "1.45 MB/s"),
            (999_900.0, "ev/s", "1.00 Mev/s"),
            (0.0, "B", "0 B"),
            (12.0, "", "12"),
            (0.0421, "mm", "0.042 mm"),
            (99.95, "%", "100.0 %"),
            (-23.41, "ppm", "-23.4 ppm"),
        ] {
            assert_eq!(amount(Some(value), unit), text);
        }
        assert_eq!(amount(None, "s"), NONE);
        assert_eq!(span(0.04), "0.0 s");
        assert_eq!(span(119.0), "119 s");
        assert_eq!(span(372.0), "6.2 min");
    }
}
