//! The recordings, and the rows of their table.

use skinrig_analysis::event_statistics::{EventStatistics, IntervalLaw, PressPolarity};

use crate::format::{NONE, number};

/// The statistics of one recording.
#[derive(Debug, Clone)]
pub struct Recording {
    /// Its file.
    pub name: String,
    /// What the data come from, in words: `simulated (optical)`.
    pub origin: String,
    /// True if a simulated rig or stand-ins for hardware made it.
    pub is_stand_in: bool,
    /// Why the presses are not known, if it is a session.
    pub without_presses: Option<String>,
    /// What of a file's stream could not be read.
    pub broken_stream: Option<String>,
    /// One or two cameras.
    pub cameras: Vec<EventStatistics>,
}

/// Letter of a recording.
pub(super) fn letter(index: usize) -> char {
    (b'A' + (index % 26) as u8) as char
}

/// The recording in words.
pub(super) fn source((index, recording): (usize, &Recording)) -> String {
    format!(
        "{}  {} ({})",
        letter(index),
        recording.name,
        recording.origin
    )
}

/// Each camera with its name in tables.
pub(super) fn cameras<'a>(
    recordings: impl Iterator<Item = (usize, &'a Recording)>,
) -> Vec<(String, &'a EventStatistics)> {
    let of = |(index, recording): (usize, &'a Recording)| {
        let name = move |c: &'a EventStatistics| match recording.cameras.len() {
            1 => (letter(index).to_string(), c),
            _ => (format!("{} {}", letter(index), c.camera), c),
        };
        recording.cameras.iter().map(name)
    };
    recordings.flat_map(of).collect()
}

/// Value of one camera as text.
pub(super) type Cell = fn(&EventStatistics) -> String;

fn percent(share: Option<f64>) -> String {
    number(share.map(|s| 100.0 * s), 1)
}

fn of_law(
    camera: &EventStatistics,
    value: impl Fn(&IntervalLaw) -> Option<f64>,
    digits: usize,
) -> String {
    number(camera.intervals.as_ref().and_then(value), digits)
}

fn of_presses(camera: &EventStatistics, value: impl Fn(&PressPolarity) -> Option<f64>) -> String {
    percent(camera.polarity.as_ref().and_then(value))
}

/// How many times chance an event has one in the millisecond before, in the cells at this distance.
pub(super) fn correlation(camera: &EventStatistics, distance_px: f64) -> Option<f64> {
    let chance = camera.correlation_by_chance.filter(|c| *c > 0.0)?;
    let mut rings = camera.correlation.iter();
    let ring = rings.find(|ring| ring.distance_px == distance_px)?;
    Some(ring.active / chance)
}

pub(super) const ROWS: [(&str, Cell); 17] = [
    ("events per second", |c| {
        number(
            (c.duration_s > 0.0).then(|| c.events as f64 / c.duration_s),
            0,
        )
    }),
    ("variance / mean of counts in 10 ms", |c| {
        number(c.dispersion, 1)
    }),
    ("ON, %", |c| percent(c.on_share)),
    ("ON in the 200 ms from a contact, %", |c| {
        of_presses(c, |p| p.on_at_press)
    }),
    ("ON in the 200 ms from a lift, %", |c| {
        of_presses(c, |p| p.on_at_lift)
    }),
    ("pixels with events, %", |c| percent(Some(c.active_pixels))),
    ("events of the busiest 1 % of pixels, %", |c| {
        percent(c.hottest_share)
    }),
    ("timestamp of the event before, %", |c| {
        percent(c.equal_times)
    }),
    ("near an event of the last ms, %", |c| percent(c.supported)),
    ("the same by chance, %", |c| percent(c.supported_by_chance)),
    ("events 8 px away, times chance", |c| {
        number(correlation(c, 8.0), 1)
    }),
    ("events 28 px away, times chance", |c| {
        number(correlation(c, 28.0), 1)
    }),
    ("interval of a pixel, mean, ms", |c| {
        of_law(c, |law| Some(1e-3 * law.mean_us), 1)
    }),
    ("refractory floor, us", |c| {
        of_law(c, |law| law.floor_us.map(f64::from), 0)
    }),
    ("inverse Gaussian, nats per interval", |c| {
        of_law(c, |law| Some(law.inverse_gaussian), 2)
    }),
    ("exponential, nats per interval", |c| {
        of_law(c, |law| Some(law.exponential), 2)
    }),
    ("law of the intervals", |c| match &c.intervals {
        None => NONE.to_owned(),
        Some(law) if law.inverse_gaussian < law.exponential => "inv. Gaussian".to_owned(),
        Some(_) => "exponential".to_owned(),
    }),
];

/// Which sessions lack presses, and which streams have gaps.
pub(super) fn remarks(recordings: &[Recording]) -> Vec<String> {
    let rows = recordings.iter().enumerate();
    rows.flat_map(|(k, r)| {
        let letter = letter(k);
        let without = r.without_presses.as_ref();
        let without = without.map(|why| format!("{letter}: no contacts and lifts: {why}"));
        let broken = r.broken_stream.as_ref();
        let broken = broken.map(|what| format!("{letter}: the stream has {what}"));
        without.into_iter().chain(broken)
    })
    .collect()
}
