//! Owns the error figures: distribution, and x against y.

use super::canvas::{Canvas, Figure, LINKED, nice_above, press_path};
use crate::axes::{Axes, Scale, tick_label};
use crate::derive;
use crate::format::number;
use crate::input::ReportInput;
use crate::svg::{Px, Svg, dots};

/// Histogram and cumulative distribution of the Euclidean error, with median, RMSE and 95th percentile.
#[must_use]
pub(crate) fn error_distribution(input: &ReportInput<'_>) -> Figure {
    let errors = derive::sorted_errors_mm(input.analysis);
    let m = &input.analysis.scored;
    let mm = |v: Option<f64>| number(v, 2);
    let caption = format!(
        "Distribution of the Euclidean error of {} scored presses. Above: cumulative share; below: presses \
         per bin. Vertical lines: median {} mm, RMSE {} mm, 95th percentile {} mm.",
        errors.len(),
        mm(m.median_mm.value),
        mm(m.rmse_mm.value),
        mm(m.p95_mm.value)
    );
    let size = (620.0, 480.0);
    let end = nice_above(errors.last().copied().unwrap_or(1.0));
    let (bins, width) = histogram(&errors, end);
    let x = Scale::new((0.0, end), (66.0, 600.0));
    let upper = Axes {
        x,
        y: Scale::new((0.0, 100.0), (230.0, 34.0)),
        x_label: String::new(),
        y_label: "presses at or below (%)".into(),
        tick_count: (8, 4),
    };
    let most = bins.iter().copied().max().unwrap_or(0);
    let lower = Axes {
        x,
        y: Scale::new((0.0, f64::from(most.max(1)) * 1.06), (416.0, 274.0)),
        x_label: "Euclidean error (mm)".into(),
        y_label: format!("presses per {} mm", bin_width(width)),
        tick_count: (8, 4),
    };
    let mut canvas = Canvas::new(
        input,
        "error-distribution",
        "Error distribution",
        caption,
        size,
        &[
            LINKED,
            ("data-x0", &x.px.0),
            ("data-per-mm", &x.per_unit()),
            ("data-bin", &width),
            ("data-top", &upper.y.px.1),
            ("data-middle", &upper.y.px.0),
            ("data-bottom", &lower.y.px.0),
            ("data-per-press", &lower.y.per_unit()),
        ],
    );
    let svg = &mut canvas.svg;
    upper.draw(svg);
    lower.draw(svg);
    svg.open("g", &[("class", &"bars")]);
    for (i, count) in bins.iter().enumerate().filter(|(_, c)| **c > 0) {
        let (left, right) = (x.at(i as f64 * width), x.at((i + 1) as f64 * width));
        let top = lower.y.at(f64::from(*count));
        svg.leaf(
            "rect",
            &[
                ("x", &Px(left)),
                ("y", &Px(top)),
                ("width", &Px(right - left)),
                ("height", &Px(416.0 - top)),
            ],
        );
    }
    svg.close();
    svg.path("ecdf", &ecdf(&errors, &upper));
    if errors.is_empty() {
        canvas.svg.text(
            (333.0, 137.0),
            "empty",
            "middle",
            "no scored press was located",
        );
    } else {
        let marks = [
            ("median", m.median_mm.value, "ref"),
            ("RMSE", m.rmse_mm.value, "ref2"),
            ("p95", m.p95_mm.value, "ref"),
        ];
        references(&mut canvas.svg, x, &marks);
    }
    canvas.finish(&format!("n = {} presses", errors.len()), "errors", "")
}

/// Vertical lines with labels above the plot, shifted where they would overlap.
fn references(svg: &mut Svg, x: Scale, marks: &[(&str, Option<f64>, &str)]) {
    let mut free_from = f64::NEG_INFINITY;
    for (name, value, class) in marks {
        let Some(v) = value.filter(|v| v.is_finite() && *v <= x.data.1) else {
            continue;
        };
        let at = x.at(v);
        svg.line(class, (at, 28.0), (at, 416.0));
        let label = format!("{name} {}", number(Some(v), 2));
        let half = label.len() as f64 * 3.3;
        let centre = at.max(free_from + half + 6.0);
        svg.text((centre, 21.0), "tick", "middle", &label);
        free_from = centre + half;
    }
}

/// Step line of the cumulative share in percent; at most one vertex per press.
fn ecdf(errors: &[f64], axes: &Axes) -> String {
    use std::fmt::Write as _;
    if errors.is_empty() {
        return String::new();
    }
    let mut d = format!("M{} {}", Px(axes.x.at(0.0)), Px(axes.y.at(0.0)));
    let n = errors.len() as f64;
    for (i, e) in errors.iter().enumerate() {
        let _ = write!(
            d,
            "H{}V{}",
            Px(axes.x.at(*e)),
            Px(axes.y.at(100.0 * (i + 1) as f64 / n))
        );
    }
    let _ = write!(d, "H{}", Px(axes.x.px.1));
    d
}

/// Counts per bin over 0..=end, and the bin width: 20 to 50 bins of a round width.
fn histogram(errors: &[f64], end: f64) -> (Vec<u32>, f64) {
    let width = nice_above(end / 41.0);
    let mut bins = vec![0u32; ((end / width).ceil() as usize).max(1)];
    let last = bins.len() - 1;
    for e in errors {
        bins[((e / width) as usize).min(last)] += 1;
    }
    (bins, width)
}

/// The error vectors: y against x, with the bias and a circle of radius RMSE.
#[must_use]
pub(crate) fn error_scatter(input: &ReportInput<'_>) -> Figure {
    let counted = input
        .analysis
        .presses
        .iter()
        .filter(|p| derive::is_counted(p));
    let (numbers, errors): (Vec<_>, Vec<_>) = counted
        .filter_map(|p| Some((p.press, p.error_mm()?)))
        .unzip();
    let m = &input.analysis.scored;
    let caption = format!(
        "Error of {} scored presses along x and y (estimate minus truth). Circle: radius RMSE ({} mm) about \
         zero. Cross: bias ({} mm along x, {} mm along y).",
        errors.len(),
        number(m.rmse_mm.value, 2),
        number(m.bias_x_mm.value, 2),
        number(m.bias_y_mm.value, 2)
    );
    let size = (620.0, 480.0);
    let mut canvas = Canvas::new(
        input,
        "error-scatter",
        "Error along x and y",
        caption,
        size,
        &[LINKED],
    );
    let most = errors
        .iter()
        .map(|(x, y)| x.abs().max(y.abs()))
        .fold(0.0, f64::max);
    let end = nice_above(most.max(m.rmse_mm.value.unwrap_or(0.0)) * 1.02);
    let (side, left, top) = (390.0, 130.0, 20.0);
    let axes = Axes {
        x: Scale::new((-end, end), (left, left + side)),
        y: Scale::new((-end, end), (top + side, top)),
        x_label: "error along x (mm)".into(),
        y_label: "error along y (mm)".into(),
        tick_count: (6, 6),
    };
    let svg = &mut canvas.svg;
    axes.draw(svg);
    svg.line("axis", (axes.x.at(0.0), top), (axes.x.at(0.0), top + side));
    svg.line(
        "axis",
        (left, axes.y.at(0.0)),
        (left + side, axes.y.at(0.0)),
    );
    let points = errors.iter().map(|(x, y)| (axes.x.at(*x), axes.y.at(*y)));
    press_path(svg, "dots dot-ink", &dots(points), &numbers);
    if let Some(r) = m.rmse_mm.value.filter(|r| r.is_finite()) {
        svg.leaf(
            "circle",
            &[
                ("class", &"ref"),
                ("cx", &Px(axes.x.at(0.0))),
                ("cy", &Px(axes.y.at(0.0))),
                ("r", &Px(r * axes.x.per_unit())),
            ],
        );
    }
    if let (Some(x), Some(y)) = (m.bias_x_mm.value, m.bias_y_mm.value) {
        let (x, y) = (axes.x.at(x), axes.y.at(y));
        svg.path(
            "bias",
            &format!("M{} {}h16M{} {}v16", Px(x - 8.0), Px(y), Px(x), Px(y - 8.0)),
        );
    }
    if errors.is_empty() {
        canvas.empty("no scored press was located");
    }
    canvas.finish(&format!("n = {} presses", errors.len()), "presses", "")
}

/// Three digits of a bin width, without trailing zeros.
fn bin_width(width: f64) -> String {
    let text = tick_label(width, width * 0.01);
    let text = if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        &text
    };
    text.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_error_falls_into_one_bin() {
        for end in [0.001, 0.9, 7.0, 300.0] {
            let end = nice_above(end);
            let errors: Vec<f64> = (0..=1000).map(|i| end * f64::from(i) / 1000.0).collect();
            let (bins, width) = histogram(&errors, end);
            assert_eq!(bins.iter().sum::<u32>(), 1001);
            assert!((20..=50).contains(&bins.len()), "{} bins", bins.len());
            assert!(width * bins.len() as f64 >= end * (1.0 - 1e-9));
        }
    }
}
