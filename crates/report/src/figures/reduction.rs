//! Owns the data-reduction figure: error and rates against the thinning factor.

use skinrig_analysis::result::{Estimate, Reduction, ReductionRow, Thinning};

use super::origin::foot;
use crate::format::number;
use crate::input::ReportInput;
use crate::markup::Markup;
use crate::plot::{Axis, Figure, Plot, Sample, Sheet, WIDE, extent, nice_above};
use crate::published;

/// Content of one panel.
struct Panel {
    name: &'static str,
    label: String,
    value: fn(&ReductionRow) -> Estimate,
    /// Factor from stored to displayed unit.
    scale: f64,
    /// Published values at factors 1 and 1024, in the displayed unit.
    published: Option<(f64, f64)>,
}

/// RMSE, pass rate, within-X rate and located rate against the factor on a log2 axis, for both kinds of thinning, with 95 %
/// bands (panel B is the paper's figure "pass rate reduction"). `None` without the study.
#[must_use]
pub fn reduction(input: &ReportInput<'_>) -> Option<Figure> {
    let study = input.analysis.reduction.as_ref()?;
    if study.curves.iter().all(|c| c.rows.is_empty()) {
        return None;
    }
    let panel = |name, label: &str, value, scale, published| Panel {
        name,
        label: label.to_owned(),
        value,
        scale,
        published,
    };
    let within = format!("within {} mm (%)", number(Some(study.within_mm), 1));
    let rmse = (published::RMSE_MM, published::RMSE_1024_MM);
    let passes = published::PASS_RATE;
    let passes = (100.0 * passes.0, 100.0 * passes.1);
    let panels: [Panel; 4] = [
        panel(
            "A   RMSE of the located presses",
            "RMSE (mm)",
            |r| r.rmse_mm,
            1.0,
            Some(rmse),
        ),
        panel(
            "B   pass rate, threshold fixed at factor 1",
            "pass rate (%)",
            |r| r.pass_rate,
            100.0,
            Some(passes),
        ),
        panel(
            "C   within the absolute limit",
            &within,
            |r| r.within_rate,
            100.0,
            None,
        ),
        panel(
            "D   located",
            "located rate (%)",
            |r| r.located_rate,
            100.0,
            None,
        ),
    ];
    let n = format!("n = {} presses, {} seeds", study.presses, study.seeds);
    let plots = panels.iter().enumerate();
    let plots = plots.map(|(i, panel)| plot(study, panel, i < 2));
    let sheet = Sheet::new("reduction", "Data reduction", caption(study), WIDE)
        .columns(&[1.0, 1.0])
        .legend([
            (Sample::Line("line c1"), "exact count (public code)"),
            (Sample::Line("line dashed c2"), "Bernoulli (paper's text)"),
            (Sample::Area("band f1"), "95 % interval over locations"),
            (Sample::Published, "published, another recording"),
        ])
        .rows(208.0, plots);
    Some(sheet.finish(&foot(input), &n, "reduction"))
}

fn caption(study: &Reduction) -> String {
    let mut caption = format!(
        "Data reduction: localisation when only one event in k is kept, by DBSCAN with one setting at all \
         factors (radius {} px, core threshold {} events), whatever the estimator of the analysis. Values are over {} \
         seeds, bands 95 % intervals over locations (exact where a share is 0 or 100 %), {} presses. A press without an estimate fails in B, C and D; presses \
         that the results leave out for too few events take part, as at high factors nothing would be left. \
         The pass threshold is the 95th percentile of the errors at factor 1 ({} mm), so B begins at about 95 % by \
         construction; C requires an error of at most {} mm. Small figures above the plots: kB/s of both cameras \
         during a press.",
        number(Some(study.eps_px), 1),
        study.min_samples,
        study.seeds,
        study.presses,
        number(study.pass_threshold_mm, 2),
        number(Some(study.within_mm), 1),
    );
    if let Some((best, all)) = better_with_less(study) {
        caption += &format!(
            "A has its minimum at k = {} ({} mm; with all events {} mm). The core threshold is a number of events, so \
             fewer events require denser neighbourhoods, while a cluster of all events includes more of its \
             surroundings.",
            best.factor,
            number(best.rmse_mm.value, 2),
            number(all.rmse_mm.value, 2),
        );
    }
    caption
}

/// Best factor and factor 1, if thinning lowers the error beyond both intervals.
fn better_with_less(study: &Reduction) -> Option<(&ReductionRow, &ReductionRow)> {
    let rows = &study.curves.first()?.rows;
    let all = rows.iter().find(|r| r.factor == 1)?;
    let with_error = rows
        .iter()
        .filter_map(|r| Some((r, r.rmse_mm.value.filter(|v| v.is_finite())?)));
    let (best, _) = with_error.min_by(|a, b| a.1.total_cmp(&b.1))?;
    (best.rmse_mm.high? < all.rmse_mm.low?).then_some((best, all))
}

/// Logarithm of the factor, base 2.
fn power(row: &ReductionRow) -> f64 {
    libm::log2(f64::from(row.factor.max(1)))
}

fn axes(study: &Reduction, panel: &Panel) -> (Axis, Axis) {
    let rows = || study.curves.iter().flat_map(|c| &c.rows);
    let ends = rows().flat_map(|r| {
        let e = (panel.value)(r);
        [e.value, e.low, e.high]
    });
    let drawn = ends.flatten().map(|v| v * panel.scale);
    let published = panel.published.into_iter().flat_map(|(a, b)| [a, b]);
    let (low, high) = extent(drawn.chain(published)).unwrap_or((0.0, 0.0));
    let y = if panel.scale > 1.0 {
        // Shares: from a round number below the minimum to 100 %.
        (((low - 4.0) / 10.0).floor().clamp(0.0, 9.0) * 10.0, 101.0)
    } else {
        (0.0, nice_above(high * 1.02))
    };
    let last = rows().map(power).fold(0.0, f64::max);
    let every = if last > 14.0 { 2 } else { 1 };
    let factors = (0..=last as u32).step_by(every);
    let factors = factors.map(|p| (f64::from(p), (1u64 << p).to_string()));
    let x = Axis::linear((-0.35, last + 0.35), "one event in k kept").marked(factors.collect());
    (x, Axis::linear(y, &*panel.label))
}

fn plot<'a>(study: &'a Reduction, panel: &Panel, with_bytes: bool) -> Plot<'a> {
    let (x, y) = axes(study, panel);
    let mut plot = Plot::new(x, y).title(panel.name);
    if with_bytes {
        plot = plot
            .names_above()
            .draw(|svg, place| bytes(svg, study, place));
    }
    let finite = |v: Option<f64>| v.filter(|v| v.is_finite()).map(|v| v * panel.scale);
    for curve in &study.curves {
        let (area, line, dot) = match curve.thinning {
            Thinning::Exact => ("band f1", "line c1", "dots c1"),
            Thinning::Bernoulli => ("band f2", "line dashed c2", "dots c2"),
        };
        let of = |r: &ReductionRow| (power(r), (panel.value)(r));
        let estimates: Vec<_> = curve.rows.iter().map(of).collect();
        let ends = estimates.iter();
        let ends = ends.filter_map(|(x, e)| Some((*x, finite(e.low).zip(finite(e.high))?)));
        let middle = estimates.iter();
        let middle: Vec<_> = middle
            .filter_map(|(x, e)| Some((*x, finite(e.value)?)))
            .collect();
        plot = plot
            .band(area, ends)
            .line(line, middle.iter().copied())
            .dots(dot, middle);
    }
    let rows = || study.curves.iter().flat_map(|c| &c.rows);
    let end = rows().map(power).fold(0.0, f64::max);
    if panel.scale == 1.0 {
        // A missing line is explained.
        let located = rows().filter(|r| r.rmse_mm.value.is_some()).map(power);
        let last = located.fold(0.0, f64::max);
        if end - last >= 2.0 {
            plot = plot.draw(move |svg, place| {
                let x = f64::midpoint(place.x.at(last + 1.0), place.x.at(end));
                let at = (x, place.middle().1);
                svg.text(at, "note halo", "middle", "no press is located");
            });
        }
    }
    if let Some((one, many)) = panel.published {
        let there = [(0.0, one), (10.0, many)].into_iter();
        for at in there.filter(|(power, _)| *power <= end + 0.35) {
            plot = plot.published(at);
        }
    }
    plot
}

/// Second scale above the plot: bytes per second during a press.
fn bytes(svg: &mut Markup, study: &Reduction, place: &crate::plot::Place) {
    let Some(curve) = study.curves.first() else {
        return;
    };
    let (_, top, ..) = place.frame();
    let shown = |r: &&ReductionRow| (power(r) as u32).is_multiple_of(2);
    for row in curve.rows.iter().filter(shown) {
        let x = place.x.at(power(row));
        svg.line("axis", (x, top - 4.0), (x, top));
        let Some(kilo) = row.press_bytes_per_s.value.map(|b| b / 1e3) else {
            continue;
        };
        let digits = if kilo >= 10.0 { 0 } else { 2 };
        let unit = if row.factor == 1 { " kB/s" } else { "" };
        let text = format!("{}{unit}", number(Some(kilo), digits));
        svg.text((x, top - 8.0), "tick", "middle", &text);
    }
}
