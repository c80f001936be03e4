//! Owns the event-rate figures: whole session, and single presses in fine bins.

use skinrig_analysis::result::{RateSeries, RateZoom};
use skinrig_model::PressId;

use super::origin::{HOST_TIME, foot};
use crate::format::number;
use crate::input::ReportInput;
use crate::plot::{Axis, Figure, Plot, Sample, Sheet, WIDE, extent, press_path};
use crate::svg::Px;

/// Unit for rates up to the highest of `values`, events per second: divisor and name.
fn unit<'a>(values: impl Iterator<Item = &'a f32>) -> (f64, &'static str) {
    let most = extent(values.map(|v| f64::from(*v))).map_or(0.0, |e| e.1);
    if most >= 1e6 {
        (1e6, "Mev/s")
    } else if most >= 1e3 {
        (1e3, "kev/s")
    } else {
        (1.0, "ev/s")
    }
}

/// Values in a unit.
fn within(values: &[f32], divisor: f64) -> impl Iterator<Item = f64> {
    values.iter().map(move |v| f64::from(*v) / divisor)
}

/// Event rate of both cameras over the session, with a mark at the contact of each press.
#[must_use]
pub fn event_rates(input: &ReportInput<'_>) -> Figure {
    // Without a clock fit the time axis is the camera's own, starting from 0, and the panel says so.
    let aligned = input.analysis.clocks.map(|c| c.is_some());
    let mut series = input.analysis.rates.clone();
    for (s, _) in series.iter_mut().zip(aligned).filter(|(_, a)| !a) {
        s.start_s = 0.0;
    }
    let presses = input.analysis.presses.iter();
    let (pressed, contacts): (Vec<PressId>, Vec<f64>) = presses
        .filter_map(|p| Some((p.press, p.timing?.contact.as_secs_f64())))
        .unzip();
    let bins = |s: &RateSeries| s.mean_per_s.len() as f64;
    let there = series.iter().filter(|s| !s.mean_per_s.is_empty());
    let ends = there.flat_map(|s| [s.start_s, s.start_s + s.bin_s * bins(s)]);
    let span = extent(ends).unwrap_or((0.0, 1.0));
    let bin = |s: &RateSeries| {
        if s.bin_s >= 1.0 {
            format!("{} s", number(Some(s.bin_s), 2))
        } else {
            format!("{} ms", number(Some(s.bin_s * 1e3), 0))
        }
    };
    let caption = format!(
        "Event rates over the session (rows of the crop). A: camera 1, bins of {}; B: camera 2, bins of {}. Strong \
         line: mean per bin; light line: highest fine bin within it. Ticks between the panels: measured contacts ({}). \
         Zoom with the buttons or the keys + and -; pan by dragging or with the arrow keys.",
        bin(&series[0]),
        bin(&series[1]),
        contacts.len()
    );
    let n = format!("{} and {} bins", bins(&series[0]), bins(&series[1]));
    let plots = series.iter().enumerate().map(|(camera, s)| {
        let (divisor, name) = unit(s.peak_per_s.iter().chain(&s.mean_per_s));
        let own = if aligned[camera] || s.mean_per_s.is_empty() {
            ""
        } else {
            " (clock not aligned: time since its first event)"
        };
        let letter = ["A", "B"][camera];
        let highest = within(&s.peak_per_s, divisor).chain(within(&s.mean_per_s, divisor));
        let first = (s.start_s, s.bin_s);
        let plot = Plot::new(
            Axis::linear(span, ["", HOST_TIME][camera]).ticks(10),
            Axis::from_zero(highest, format!("event rate ({name})")).ticks(4),
        )
        .title(format!("{letter}   camera {}{own}", camera + 1))
        .clipped(format!("event-rates-clip-{camera}"))
        .zooming()
        .steps(
            ["line thin c1", "line thin c2"][camera],
            first,
            within(&s.peak_per_s, divisor),
        )
        .steps(
            ["line c1", "line c2"][camera],
            first,
            within(&s.mean_per_s, divisor),
        )
        .empty(s.mean_per_s.is_empty(), "no events in this camera");
        if camera == 1 {
            return plot;
        }
        let (pressed, contacts) = (&pressed, &contacts);
        plot.below("contacts", move |svg, place, top| {
            let mark = |t: &f64| format!("M{} {}v12", Px(place.x.at(*t)), Px(top));
            let marks: String = contacts.iter().map(mark).collect();
            press_path(svg, "marks", &marks, pressed);
        })
    });
    let sheet = Sheet::new("event-rates", "Event rates", caption, WIDE).rows(185.0, plots);
    sheet.finish(&foot(input), &n, "rates").interactive("zoom")
}

/// ON and OFF rates around single presses, one column per press, one row per camera. `None` without any.
#[must_use]
pub(crate) fn press_rates(input: &ReportInput<'_>) -> Option<Figure> {
    let zooms = &input.analysis.zooms;
    let mut presses: Vec<PressId> = zooms.iter().map(|z| z.press).collect();
    presses.sort_unstable();
    presses.dedup();
    presses.truncate(6);
    if presses.is_empty() {
        return None;
    }
    let caption = "Event rates around single presses, ON and OFF events separately, against time since measured \
        contact. Dashed lines: contact and release. One column per press, camera 1 above, camera 2 below."
        .to_owned();
    let row = |camera: usize| {
        let is_shown = |press: &PressId| {
            let of = |z: &&RateZoom| z.press == *press && z.camera.index() == camera;
            zooms.iter().find(of)
        };
        let all = || presses.iter().filter_map(is_shown);
        let (divisor, name) = unit(all().flat_map(|z| z.on_per_s.iter().chain(&z.off_per_s)));
        let label = format!("camera {} ({name})", camera + 1);
        let x_label = ["", "time since contact (s)"][camera];
        let plots = all().map(|z| {
            let bins = z.on_per_s.len().max(z.off_per_s.len());
            let span = (z.start_s, z.start_s + z.bin_s * bins as f64);
            let on_off = all().flat_map(|z| z.on_per_s.iter().chain(&z.off_per_s));
            let highest = on_off.map(|v| f64::from(*v) / divisor);
            let first = (z.start_s, z.bin_s);
            let plot = Plot::new(
                Axis::linear(span, x_label).ticks(6),
                Axis::from_zero(highest, &*label).ticks(4),
            );
            let marks = [0.0, z.release_s].into_iter();
            marks
                .filter(|t| (span.0..=span.1).contains(t))
                .fold(plot, |plot, t| plot.upright("ref2", t))
                .title(z.press.to_string())
                .steps("line on-line", first, within(&z.on_per_s, divisor))
                .steps("line off-line", first, within(&z.off_per_s, divisor))
        });
        plots.collect::<Vec<_>>()
    };
    let title = "Single presses: event rates";
    let sheet = Sheet::new("press-rates", title, caption, WIDE)
        .shared_columns(presses.len())
        .legend([
            (Sample::Line("line on-line"), "ON"),
            (Sample::Line("line off-line"), "OFF"),
        ])
        .row(158.0, row(0))
        .row(158.0, row(1));
    Some(sheet.finish(
        &foot(input),
        &format!("{} presses", presses.len()),
        "press_rates",
    ))
}
