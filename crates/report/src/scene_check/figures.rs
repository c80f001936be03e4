//! The figures: one panel per recording, one line per camera.

use skinrig_analysis::event_statistics::{Bin, EventStatistics, IntervalLaw};

use super::rows::{Recording, correlation, letter};
use crate::plot::{Axis, Figure, HALF, Plot, Sample, Sheet, WIDE, extent};

/// Class of a camera's line.
fn class(camera: &EventStatistics) -> &'static str {
    ["line c1", "line c2"][camera.camera.index()]
}

const CAMERAS: [(Sample, &str); 2] = [
    (Sample::Line("line c1"), "camera 1, or the only one"),
    (Sample::Line("line c2"), "camera 2"),
];

/// All figures that the recordings have data for.
pub(super) fn all(recordings: &[Recording]) -> Vec<Figure> {
    [intervals, distances, pixels]
        .into_iter()
        .filter_map(|draw| draw(recordings))
        .collect()
}

/// A sheet with a column per recording.
fn sheet<'a>(
    (id, title): (&'static str, &str),
    caption: &str,
    recordings: &[Recording],
    legend: &[(Sample, &'a str)],
    plots: Vec<Plot<'a>>,
) -> Figure {
    let n = recordings.len();
    let width = if n > 1 { WIDE } else { HALF };
    let sheet = Sheet::new(id, title, caption.to_owned(), width).shared_columns(n);
    let sheet = sheet.legend(CAMERAS.into_iter().chain(legend.iter().copied()));
    let origins = recordings.iter().enumerate();
    let origins: Vec<String> = origins
        .map(|(k, r)| format!("{} {}", letter(k), r.origin))
        .collect();
    let events: u64 = recordings
        .iter()
        .flat_map(|r| &r.cameras)
        .map(|c| c.events)
        .sum();
    sheet
        .row(300.0, plots)
        .finish(&origins.join(" · "), &format!("n = {events} events"), id)
}

/// The decades around all ends of bins; `None` without bins.
fn decades(bins: impl Iterator<Item = Bin>) -> Option<(f64, f64)> {
    let (low, high) = extent(bins.filter(|b| b.n > 0).flat_map(|b| [b.from, b.to]))?;
    Some((
        power_of_ten(libm::log10(low).floor()),
        power_of_ten(libm::log10(high).ceil()),
    ))
}

fn power_of_ten(exponent: f64) -> f64 {
    10f64.powi(exponent as i32)
}

/// Every second power of ten in a range, with its text.
fn powers(range: (f64, f64), text: fn(i32) -> String) -> Vec<(f64, String)> {
    let [first, last] = [range.0, range.1].map(|end| libm::log10(end).round() as i32);
    (first..=last)
        .filter(|exponent| exponent % 2 == 0)
        .map(|exponent| (power_of_ten(f64::from(exponent)), text(exponent)))
        .collect()
}

/// A power of ten in µs.
fn time(exponent: i32) -> String {
    let (unit, least) = match exponent {
        ..3 => ("µs", 0),
        3..6 => ("ms", 3),
        _ => ("s", 6),
    };
    format!("{} {unit}", power_of_ten(f64::from(exponent - least)))
}

/// A power of ten.
fn count(exponent: i32) -> String {
    power_of_ten(f64::from(exponent)).to_string()
}

fn each(recordings: &[Recording]) -> impl Iterator<Item = &EventStatistics> {
    recordings.iter().flat_map(|r| &r.cameras)
}

/// Middle of a bin on a logarithmic axis.
fn middle(bin: &Bin) -> f64 {
    (bin.from * bin.to).sqrt()
}

/// Share of the intervals per bin, with the fitted laws.
fn intervals(recordings: &[Recording]) -> Option<Figure> {
    let range = decades(each(recordings).flat_map(|c| c.interval_bins.iter().copied()))?;
    let shares = |camera: &EventStatistics| -> Vec<(f64, f64)> {
        let n: u64 = camera.interval_bins.iter().map(|b| b.n).sum();
        let bins = camera.interval_bins.iter();
        bins.map(|b| (middle(b), 100.0 * b.n as f64 / n.max(1) as f64))
            .collect()
    };
    let fitted = |camera: &EventStatistics, density: fn(&IntervalLaw, f64) -> f64| {
        let law = camera.intervals?;
        let bins = camera.interval_bins.iter();
        let share = |b: &Bin| 100.0 * density(&law, middle(b)) * (b.to - b.from);
        Some(bins.map(|b| (middle(b), share(b))).collect::<Vec<_>>())
    };
    let laws = |camera: &EventStatistics| {
        [
            ("ref", fitted(camera, inverse_gaussian)),
            ("ref2", fitted(camera, exponential)),
        ]
    };
    let highest = each(recordings).flat_map(|camera| {
        let laws = laws(camera).into_iter().filter_map(|(_, line)| line);
        laws.chain([shares(camera)])
            .flatten()
            .map(|(_, y)| y)
            .collect::<Vec<_>>()
    });
    let y = Axis::from_zero(highest, "intervals per bin (%)");
    let plots = recordings.iter().enumerate().map(|(k, recording)| {
        let x = Axis::log(range, "interval between events of a pixel").marked(powers(range, time));
        let mut plot = Plot::new(x, y.clone()).title(letter(k).to_string());
        for camera in &recording.cameras {
            for (class, line) in laws(camera) {
                plot = plot.line(class, line.unwrap_or_default());
            }
            plot = plot.line(class(camera), shares(camera));
        }
        plot.empty(
            recording.cameras.iter().all(|c| c.interval_bins.is_empty()),
            "no intervals",
        )
    });
    Some(sheet(
        ("intervals", "Intervals between events of a pixel"),
        "All pixels together, ten bins a decade, with both laws fitted by maximum likelihood (of at least 100 intervals).",
        recordings,
        &[
            (Sample::Line("ref"), "inverse Gaussian"),
            (Sample::Line("ref2"), "exponential"),
        ],
        plots.collect(),
    ))
}

/// Density at `us`, per µs.
fn exponential(law: &IntervalLaw, us: f64) -> f64 {
    libm::exp(-us / law.mean_us) / law.mean_us
}

/// Density at `us`, per µs: Tweedie (1957).
fn inverse_gaussian(law: &IntervalLaw, us: f64) -> f64 {
    let (mean, shape) = (law.mean_us, law.shape_us);
    let off = (us - mean) / mean;
    let scale = (shape / (core::f64::consts::TAU * us.powi(3))).sqrt();
    scale * libm::exp(-shape * off * off / (2.0 * us))
}

/// How often an event has one around it, by distance.
fn distances(recordings: &[Recording]) -> Option<Figure> {
    let line = |camera: &EventStatistics| -> Vec<(f64, f64)> {
        let rings = camera.correlation.iter().map(|ring| ring.distance_px);
        rings
            .filter_map(|px| Some((px, correlation(camera, px)?)))
            .filter(|(_, times)| *times > 0.0)
            .collect()
    };
    let all = each(recordings).flat_map(line).map(|(_, times)| times);
    let (low, high) = extent(all.chain([1.0]))?;
    each(recordings).flat_map(line).next()?;
    let range = (
        power_of_ten(libm::log10(low).floor()),
        power_of_ten(libm::log10(high).ceil().max(1.0)),
    );
    let plots = recordings.iter().enumerate().map(|(k, recording)| {
        let x = Axis::linear((0.0, 28.0), "distance (px)");
        let y = Axis::log(range, "events in the ms before, times chance");
        let mut plot = Plot::new(x, y)
            .title(letter(k).to_string())
            .across("ref2", 1.0);
        for camera in &recording.cameras {
            plot = plot.line(class(camera), line(camera));
        }
        plot.empty(
            recording.cameras.iter().all(|c| line(c).is_empty()),
            "too few events",
        )
    });
    Some(sheet(
        ("distances", "Events around an event"),
        "Share of the cells of 4 px at a distance that had an event in the millisecond before one, over the share of any cell at any \
         time, for a sixteenth of the events. Dotted: independent events at a constant rate.",
        recordings,
        &[(Sample::Line("ref2"), "chance")],
        plots.collect(),
    ))
}

/// Pixels by their number of events.
fn pixels(recordings: &[Recording]) -> Option<Figure> {
    let range = decades(each(recordings).flat_map(|c| c.pixels.iter().copied()))?;
    let most = each(recordings).flat_map(|c| c.pixels.iter().map(|b| b.n as f64));
    let most = most.fold(10.0, f64::max);
    let plots = recordings.iter().enumerate().map(|(k, recording)| {
        let x = Axis::log(range, "events of a pixel").marked(powers(range, count));
        let y = Axis::log(
            (0.8, power_of_ten(libm::log10(most).ceil())),
            "pixels per bin",
        );
        let mut plot = Plot::new(x, y).title(letter(k).to_string());
        for camera in &recording.cameras {
            let bins = camera.pixels.iter().filter(|b| b.n > 0);
            plot = plot.line(class(camera), bins.map(|b| (middle(b), b.n as f64)));
        }
        plot.empty(
            recording.cameras.iter().all(|c| c.pixels.is_empty()),
            "no events",
        )
    });
    Some(sheet(
        ("pixels", "Pixels by their number of events"),
        "Four bins an octave; pixels without events are left out. A tail to the right of few pixels: hot ones.",
        recordings,
        &[],
        plots.collect(),
    ))
}
