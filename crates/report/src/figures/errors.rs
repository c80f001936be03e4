//! Owns the error figures: distribution, and x against y.

use super::histogram::{bin_width, histogram};
use super::origin::foot;
use crate::derive;
use crate::format::number;
use crate::input::ReportInput;
use crate::plot::{Axis, Figure, HALF, Plot, Sheet, circle, nice_above};
use crate::svg::Px;

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
    let end = nice_above(errors.last().copied().unwrap_or(1.0));
    let (width, count) = bins_over(end);
    let bins = histogram(&errors, (0.0, width), count);
    let x = |label: &str| Axis::linear((0.0, end), label).ticks(8);
    let n = errors.len() as f64;
    let share = |i: usize| 100.0 * i as f64 / n;
    let steps = errors.iter().enumerate();
    let steps = steps.flat_map(|(i, e)| [(*e, share(i)), (*e, share(i + 1))]);
    let steps = [(0.0, 0.0)].into_iter().chain(steps).chain([(end, 100.0)]);
    let marks = [
        ("ref", "median", m.median_mm.value),
        ("ref2", "RMSE", m.rmse_mm.value),
        ("ref", "p95", m.p95_mm.value),
    ];
    let marks: Vec<_> = marks
        .into_iter()
        .filter(|_| !errors.is_empty())
        .filter_map(|(class, name, v)| Some((class, v?, format!("{name} {}", mm(v)))))
        .collect();
    let most = bins.iter().copied().max().unwrap_or(0).max(1);
    let mut upper = Plot::new(x(""), Axis::linear((0.0, 100.0), "presses at or below (%)"))
        .line("ecdf", steps.filter(|_| n > 0.0))
        .empty(errors.is_empty(), "no scored press was located");
    let mut lower = Plot::new(
        x("Euclidean error (mm)"),
        Axis::linear(
            (0.0, f64::from(most) * 1.06),
            format!("presses per {} mm", bin_width(width)),
        ),
    )
    .bars((0.0, width), &bins);
    for (class, v, _) in &marks {
        lower = lower.upright(class, *v);
    }
    upper = upper.references(marks);
    let id = "error-distribution";
    let sheet = Sheet::new(id, "Error distribution", caption, HALF)
        .row(196.0, [upper])
        .row(142.0, [lower]);
    sheet.finish(&foot(input), &format!("n = {n} presses"), "errors")
}

/// Width of 20 to 50 bins over 0..=end, and their number.
fn bins_over(end: f64) -> (f64, usize) {
    let width = nice_above(end / 41.0);
    (width, (end / width).ceil() as usize)
}

/// The error vectors: y against x, with the bias and a circle of radius RMSE.
#[must_use]
pub(crate) fn error_scatter(input: &ReportInput<'_>) -> Figure {
    let presses = input.analysis.presses.iter();
    let counted = presses.filter(|p| derive::is_counted(p));
    let errors: Vec<_> = counted
        .filter_map(|p| Some((p.press, p.error_mm()?)))
        .collect();
    let m = &input.analysis.scored;
    let caption = format!(
        "Error of {} scored presses along x and y (estimate minus truth). Circle: radius RMSE ({} mm) about \
         zero. Cross: bias ({} mm along x, {} mm along y).",
        errors.len(),
        number(m.rmse_mm.value, 2),
        number(m.bias_x_mm.value, 2),
        number(m.bias_y_mm.value, 2)
    );
    let most = errors.iter().map(|(_, (x, y))| x.abs().max(y.abs()));
    let most = most.fold(m.rmse_mm.value.unwrap_or(0.0), f64::max);
    let end = nice_above(most * 1.02);
    let axis = |label: &str| Axis::linear((-end, end), label).ticks(6);
    let n = errors.len();
    let rmse = m.rmse_mm.value.filter(|r| r.is_finite());
    let bias = m.bias_x_mm.value.zip(m.bias_y_mm.value);
    let plot = Plot::new(axis("error along x (mm)"), axis("error along y (mm)"))
        .upright("axis", 0.0)
        .across("axis", 0.0)
        .presses("dots dot-ink", false, errors)
        .draw(move |svg, place| {
            if let Some(r) = rmse {
                circle(svg, "ref", place.at((0.0, 0.0)), r * place.x.per_unit());
            }
            if let Some((x, y)) = bias.map(|b| place.at(b)) {
                let data = format!("M{} {}h16M{} {}v16", Px(x - 8.0), Px(y), Px(x), Px(y - 8.0));
                svg.path("bias", &data);
            }
        })
        .empty(n == 0, "no scored press was located");
    // A square frame.
    let sheet = Sheet::new("error-scatter", "Error along x and y", caption, HALF)
        .margins(130.0, 100.0)
        .row(390.0, [plot]);
    sheet.finish(&foot(input), &format!("n = {n} presses"), "presses")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_error_falls_into_one_bin() {
        for end in [0.001, 0.9, 7.0, 300.0] {
            let end = nice_above(end);
            let errors: Vec<f64> = (0..=1000).map(|i| end * f64::from(i) / 1000.0).collect();
            let (width, count) = bins_over(end);
            let bins = histogram(&errors, (0.0, width), count);
            assert_eq!(bins.iter().sum::<u32>(), 1001);
            assert!((20..=50).contains(&bins.len()), "{} bins", bins.len());
            assert!(width * bins.len() as f64 >= end * (1.0 - 1e-9));
        }
    }
}
