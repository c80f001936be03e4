//! Owns the bars on a night's page: a value between its limits, drawn without text.

use skinrig_model::Limit;
use skinrig_nightly::{Measurement, Verdict};

use crate::markup::Markup;
use crate::svg::Px;

/// Width of a bar in its own units; the page stretches it to its cell.
const WIDTH: f64 = 120.0;
const HEIGHT: f64 = 12.0;
/// Extension of the scale beyond a limit, so that a violation is visible.
const BEYOND: f64 = 0.25;

/// A value on the scale of its limits: good, marginal and bad ranges, and the value. `None` if not measured or without a
/// limit.
pub(super) fn bar(m: &Measurement) -> Option<String> {
    let (value, limit) = (m.value?, m.limit.as_ref()?);
    let (from, to) = scale(value, limit);
    let x = |v: f64| ((v - from) / (to - from)).clamp(0.0, 1.0) * WIDTH;
    let low = x(limit.at_least.unwrap_or(from));
    let high = x(limit.at_most.unwrap_or(to));
    let mut svg = Markup::new();
    svg.open(
        "svg",
        &[
            ("viewBox", &format_args!("0 0 {WIDTH} {HEIGHT}")),
            ("class", &"limit-bar"),
            ("aria-hidden", &"true"),
            ("preserveAspectRatio", &"none"),
        ],
    );
    let mut zone = |class: &str, a: f64, b: f64| {
        if b > a {
            svg.leaf(
                "rect",
                &[
                    ("class", &class),
                    ("x", &Px(a)),
                    ("y", &3),
                    ("width", &Px(b - a)),
                    ("height", &6),
                ],
            );
        }
    };
    zone("beyond", 0.0, WIDTH);
    zone("good", low, high);
    if limit.margin > 0.0 {
        if let Some(least) = limit.at_least {
            zone("near", low, x(least + limit.margin).min(high));
        }
        if let Some(most) = limit.at_most {
            zone("near", x(most - limit.margin).max(low), high);
        }
    }
    let class = match m.verdict {
        Verdict::Fail | Verdict::Invalid => "at bad",
        Verdict::Marginal => "at warn",
        _ => "at",
    };
    svg.leaf(
        "rect",
        &[
            ("class", &class),
            ("x", &Px((x(value) - 1.5).clamp(0.0, WIDTH - 3.0))),
            ("y", &0),
            ("width", &3),
            ("height", &HEIGHT),
            ("rx", &1),
        ],
    );
    svg.close();
    Some(svg.finish())
}

/// First and last value of the scale: zero if near, limits, value, and padding.
fn scale(value: f64, limit: &Limit) -> (f64, f64) {
    let named = [limit.at_least, limit.at_most, Some(value), Some(0.0)];
    let named = || named.iter().flatten().copied();
    // A scale with one limit starts at zero; one with two limits does not.
    let both = limit.at_least.is_some() && limit.at_most.is_some();
    let listed = || named().take(if both { 3 } else { 4 });
    let low = listed().fold(f64::INFINITY, f64::min);
    let high = listed().fold(f64::NEG_INFINITY, f64::max);
    let room = ((high - low) * BEYOND).max(f64::MIN_POSITIVE);
    let room = if room < 1e-300 { 1.0 } else { room };
    let below = if low == 0.0 && limit.at_least.is_none() {
        0.0
    } else {
        room
    };
    (low - below, high + room)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_holds_limits_and_value_whatever_they_are() {
        let cases = [
            (0.0, Limit::at_most(0.0)),
            (5.0, Limit::at_most(0.0)),
            (1e9, Limit::at_least(60e6)),
            (
                -300.0,
                Limit {
                    at_least: Some(-200.0),
                    at_most: Some(200.0),
                    margin: 50.0,
                },
            ),
        ];
        for (value, limit) in cases {
            let (from, to) = scale(value, &limit);
            assert!(from < to && from <= value && value <= to, "{value}");
            for of in [limit.at_least, limit.at_most].into_iter().flatten() {
                assert!(from <= of && of <= to, "{value}");
            }
        }
    }
}
