//! Contents that no night has: a file that was changed, or was never one. They keep a night out of histories and catalogues.

use std::collections::BTreeSet;

use crate::night::{Attempt, CheckResult, Measurement, Night};
use crate::verdict::Verdict;

/// The first such content of `night`, in words; `None` for a sound night.
#[must_use]
pub fn unsound(night: &Night) -> Option<String> {
    if !night.finished {
        return Some(format!("{}, which is unfinished", night.id));
    }
    if !is_utc(&night.started) {
        return Some(format!(
            "the start `{}` instead of a time in UTC as `2026-11-20T02:00:00Z`",
            night.started.escape_debug()
        ));
    }
    let firmware = night.versions.firmware.iter().map(|(device, _)| device);
    if let Some(device) = twice(firmware) {
        return Some(format!("two firmware versions of {device}"));
    }
    if let Some(name) = twice(night.checks.iter().map(|check| &check.name)) {
        return Some(format!("the check {name} twice"));
    }
    let worst = Verdict::worst(night.checks.iter().map(|check| check.verdict));
    if let Some(found) = hides(night.verdict, worst) {
        return Some(format!("{found} among its checks"));
    }
    night.checks.iter().find_map(|check| {
        let found = check.attempts.iter().find_map(of_attempt);
        let found = found.or_else(|| hidden(check))?;
        Some(format!("{found} in the check {}", check.name))
    })
}

/// Whether `text` is a time as `2026-11-20T02:00:00Z`, with or without a fraction of the second: as text, such times are in order.
fn is_utc(text: &str) -> bool {
    let Some((seconds, fraction)) = text.split_at_checked("2026-11-20T02:00:00".len()) else {
        return false;
    };
    let like = |(found, form): (u8, u8)| match form {
        b'0' => found.is_ascii_digit(),
        _ => found == form,
    };
    let form = b"0000-00-00T00:00:00";
    let two = |from: usize| {
        seconds
            .get(from..from + 2)
            .and_then(|two| two.parse::<u32>().ok())
    };
    let within =
        |from: usize, low: u32, high: u32| two(from).is_some_and(|n| (low..=high).contains(&n));
    let digits = fraction
        .strip_suffix('Z')
        .map(|rest| rest.strip_prefix('.').unwrap_or(rest));
    seconds.bytes().zip(form.iter().copied()).all(like)
        && within(5, 1, 12)
        && within(8, 1, 31)
        && within(11, 0, 23)
        && within(14, 0, 59)
        && within(17, 0, 60)
        && digits.is_some_and(|digits| digits.bytes().all(|b| b.is_ascii_digit()))
}

/// Whether a good verdict stands above a bad one. Rules and repeats change bad verdicts into other bad ones, never into good ones.
fn hides(above: Verdict, below: Verdict) -> Option<String> {
    let is_hidden = above.is_good() && !below.is_good();
    is_hidden.then(|| format!("{} above {}", above.name(), below.name()))
}

/// A good verdict above a bad one in the check's last attempt, which counts.
fn hidden(check: &CheckResult) -> Option<String> {
    let attempt = check.attempts.last()?;
    let of_part = || {
        attempt.parts.iter().find_map(|part| {
            let below = part.measurements.iter().find_map(|m| {
                let limit = m.limit.as_ref();
                let law = Verdict::of_measurement(m.value, m.n, m.needs, limit);
                hides(m.verdict, law).or_else(|| hides(part.verdict, m.verdict))
            });
            below.or_else(|| hides(attempt.verdict, part.verdict))
        })
    };
    hides(check.verdict, attempt.verdict).or_else(of_part)
}

fn of_attempt(attempt: &Attempt) -> Option<String> {
    let all = || {
        let parts = attempt.parts.iter();
        parts.flat_map(|part| part.measurements.iter().map(|m| (&part.subject, m)))
    };
    if let Some((subject, metric)) = twice(all().map(|(subject, m)| (subject, &m.metric))) {
        return Some(format!("{subject}/{metric} twice"));
    }
    let (subject, m) = all().find(|(_, m)| has_odd_interval(m))?;
    let metric = &m.metric;
    let [low, high] = m.interval?;
    Some(format!(
        "the interval {low} to {high} of {subject}/{metric}"
    ))
}

/// Whether the limits of the interval are exchanged, or none.
fn has_odd_interval(m: &Measurement) -> bool {
    m.interval
        .is_some_and(|[low, high]| !(low.is_finite() && high.is_finite() && low <= high))
}

/// The first value that occurs twice.
fn twice<T: Ord + Copy>(all: impl Iterator<Item = T>) -> Option<T> {
    let mut seen = BTreeSet::new();
    all.into_iter().find(|value| !seen.insert(*value))
}

#[cfg(test)]
mod tests {
    use super::is_utc;

    #[test]
    fn times_are_utc_and_sort_as_text() {
        for good in ["2026-11-20T02:00:00Z", "2026-12-31T23:59:60.25Z"] {
            assert!(is_utc(good), "{good}");
        }
        for bad in [
            "",
            "Z",
            "yesterday",
            "2026-11-20T02:00:00",
            "2026-11-20T02:00:00+05:00",
            "2026-11-20 02:00:00Z",
            "2026-13-20T02:00:00Z",
            "2026-11-00T02:00:00Z",
            "2026-11-20T24:00:00Z",
            "2026-11-20T02:00:00.2.5Z",
            "2026-11-20T02:00:0\u{e9}Z",
        ] {
            assert!(!is_utc(bad), "{bad}");
        }
    }
}
