//! Formats numbers for people: digits, units, intervals, the dash for "no value".

use skinrig_analysis::result::{Estimate, RatesEvidence};

/// Placeholder for a missing value.
pub(crate) const NONE: &str = "–";

/// `value` with `digits` decimals, or the dash if missing or non-finite.
pub(crate) fn number(value: Option<f64>, digits: usize) -> String {
    match value {
        Some(v) if v.is_finite() => {
            let text = format!("{v:.digits$}");
            // A rounded negative zero looks like an error.
            if text.starts_with('-') && text.bytes().all(|b| matches!(b, b'-' | b'0' | b'.')) {
                text[1..].to_owned()
            } else {
                text
            }
        }
        _ => NONE.to_owned(),
    }
}

/// Decimals that show two digits of a standard error, 1 to 4; 3 without one.
pub(crate) fn digits_of_error(standard_error: f64) -> usize {
    if standard_error.is_finite() && standard_error > 0.0 {
        (1.0 - libm::log10(standard_error).floor()).clamp(1.0, 4.0) as usize
    } else {
        3
    }
}

/// 95 % interval as `[low, high]`, or the dash.
pub(crate) fn interval(e: &Estimate, scale: f64, digits: usize) -> String {
    match (e.low, e.high) {
        (Some(l), Some(h)) if l.is_finite() && h.is_finite() => format!(
            "[{}, {}]",
            number(Some(l * scale), digits),
            number(Some(h * scale), digits)
        ),
        _ => NONE.to_owned(),
    }
}

/// A large estimate rounded to the second digit of half its interval, one decimal at most, and its number of decimals: more digits
/// would say more than is known.
pub(crate) fn rounded_to_interval(e: &Estimate) -> (Estimate, usize) {
    const FINEST: f64 = 0.1;
    let half = match (e.low, e.high) {
        (Some(low), Some(high)) => (high - low) / 2.0,
        _ => 0.0,
    };
    let place = if half.is_finite() && half > 0.0 {
        libm::pow(10_f64, libm::log10(half).floor() - 1.0).max(FINEST)
    } else {
        FINEST
    };
    let round = |value: Option<f64>| value.map(|v| (v / place).round() * place);
    let rounded = Estimate {
        value: round(e.value),
        low: round(e.low),
        high: round(e.high),
        n: e.n,
    };
    (rounded, usize::from(place < 1.0))
}

/// Contact map score of the public code with its interval. It compares two parts of the estimated map, so it is said which
/// one is larger: brightness `missing` in the true cell, or brightness `outside` it.
pub(crate) fn contact_map(e: &Estimate) -> String {
    let part = |v: f64| {
        let name = if v < 0.0 { "outside" } else { "missing" };
        format!("{} % {name}", number(Some(v.abs()), 2))
    };
    match (e.value, e.low, e.high) {
        (Some(v), Some(low), Some(high)) => {
            format!("{} [{} to {}]", part(v), part(low), part(high))
        }
        (Some(v), ..) => part(v),
        _ => NONE.to_owned(),
    }
}

/// An identifier as people write it: `lost_pulses` is "lost pulses", `camera1` "camera 1", `rmse` "RMSE".
pub(crate) fn phrase(identifier: &str) -> String {
    let word = |word: &str| match word {
        "rmse" | "usb" | "cpu" | "evk1" | "evk4" | "drd" => word.to_uppercase(),
        "std" => "standard deviation".to_owned(),
        "camera1" => "camera 1".to_owned(),
        "camera2" => "camera 2".to_owned(),
        _ => word.to_owned(),
    };
    let words: Vec<String> = identifier.split(['_', ' ']).map(word).collect();
    words.join(" ")
}

/// Whole number in groups of three, separated by thin spaces: `12 345 678`.
pub(crate) fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::with_capacity(digits.len() + digits.len() / 3);
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push('\u{202f}');
        }
        out.push(c);
    }
    out
}

/// Serialised name of a unit variant, with spaces for underscores.
pub(crate) fn words<T: serde::Serialize>(variant: &T) -> String {
    match serde_json::to_value(variant) {
        Ok(serde_json::Value::String(name)) => name.replace('_', " "),
        _ => NONE.to_owned(),
    }
}

/// `text` with a capital first letter.
pub(crate) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(char::to_uppercase);
    first.into_iter().flatten().chain(letters).collect()
}

/// Turns a remark into a sentence: capital first letter, full stop.
pub(crate) fn sentence(remark: &str) -> String {
    capital(remark) + "."
}

/// Certainty of an alignment by event rates, as a clause.
pub(crate) fn by_rates(evidence: &RatesEvidence) -> String {
    let mut parts = vec![format!(
        "by event rates, log-odds {} against all other alignments",
        number(Some(evidence.log_odds), 1)
    )];
    for (k, sights) in evidence.cameras.iter().enumerate() {
        if let Some(s) = sights {
            parts.push(format!(
                "camera {}: {} of {} presses found, {} bursts unexplained",
                k + 1,
                s.found,
                s.expected,
                s.unexplained
            ));
        }
    }
    parts.join(", ")
}

/// The text, or "not recorded" when it is empty.
pub(crate) fn or_missing(text: &str) -> &str {
    if text.trim().is_empty() {
        "not recorded"
    } else {
        text
    }
}

/// User text on one line, with control characters spelled out.
pub(crate) fn plain(text: &str) -> String {
    skinrig_model::text::visible(&text.replace(['\n', '\t'], " ")).into_owned()
}

/// With an upper-case first letter.
pub(crate) fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    match letters.next() {
        Some(first) => first.to_uppercase().chain(letters).collect(),
        None => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        assert_eq!(number(Some(4.6649), 2), "4.66");
        assert_eq!(number(Some(-0.0001), 2), "0.00");
        assert_eq!(number(Some(f64::NAN), 2), NONE);
        assert_eq!(number(None, 2), NONE);
        assert_eq!(grouped(1_234_567), "1\u{202f}234\u{202f}567");
        assert_eq!(grouped(999), "999");
    }

    #[test]
    fn a_standard_error_shows_two_digits_where_four_decimals_can() {
        let written = |se: f64| number(Some(se), digits_of_error(se));
        assert_eq!(written(0.0123), "0.012");
        assert_eq!(written(0.000_057), "0.0001");
        assert_eq!(written(1.893), "1.9");
        assert_eq!(written(38.0), "38.0");
        assert_eq!(written(0.0), "0.000");
    }

    #[test]
    fn a_large_estimate_has_no_more_digits_than_its_interval_gives() {
        let written = |value, low, high| {
            let e = Estimate {
                value: Some(value),
                low,
                high,
                n: 3,
            };
            let (rounded, digits) = rounded_to_interval(&e);
            format!(
                "{} {}",
                number(rounded.value, digits),
                interval(&rounded, 1.0, digits)
            )
        };
        let with = |value, low, high| written(value, Some(low), Some(high));
        assert_eq!(with(5853.1, 2501.8, 9666.0), "5900 [2500, 9700]");
        assert_eq!(with(46.3, 40.2, 53.9), "46.3 [40.2, 53.9]");
        assert_eq!(with(105.4, 80.2, 140.3), "105 [80, 140]");
        assert_eq!(with(5853.1, 5853.0, 5853.2), "5853.1 [5853.0, 5853.2]");
        assert_eq!(written(105.4, None, None), "105.4 –");
    }

    #[test]
    fn identifiers_become_words_and_scores_say_which_part_is_larger() {
        assert_eq!(phrase("lost_pulses"), "lost pulses");
        assert_eq!(phrase("camera1"), "camera 1");
        assert_eq!(phrase("rmse_over_repeat"), "RMSE over repeat");
        let score = |value| Estimate {
            value: Some(value),
            low: Some(value - 1.0),
            high: Some(value + 1.0),
            n: 3,
        };
        let caption = contact_map(&score(-12.17));
        assert_eq!(
            caption,
            "12.17 % outside [13.17 % outside to 11.17 % outside]"
        );
        assert_eq!(
            contact_map(&score(0.5)),
            "0.50 % missing [0.50 % outside to 1.50 % missing]"
        );
    }

    #[test]
    fn half_an_interval_is_none() {
        let e = Estimate {
            value: Some(1.0),
            low: Some(0.5),
            high: None,
            n: 3,
        };
        assert_eq!(interval(&e, 1.0, 2), NONE);
    }
}
