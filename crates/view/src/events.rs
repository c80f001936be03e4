//! Owns the answer with the events of one camera in a window of session time, as bytes.
//!
//! Little endian: per event a u32 with its time after the window's start in µs, and a u32 with column (bits 0-9), row (10-18) and polarity
//! (19, set for ON).

use serde::Deserialize;
use skinrig_model::{CameraId, CdEvent, Polarity};
use skinrig_results::events_between;

use crate::open_session::OpenSession;
use crate::problem::Problem;

/// Most events of one answer: 16 MB.
const MOST_EVENTS: usize = 2_000_000;
/// Longest window, s.
const LONGEST_S: f64 = 60.0;

/// A window of one camera.
#[derive(Debug, Clone, Copy, Deserialize)]
pub(crate) struct Window {
    /// 1 or 2.
    pub camera: u8,
    /// Start, s of session time.
    pub from_s: f64,
    /// End, s; included.
    pub to_s: f64,
}

impl Window {
    /// Camera of the window, if the window is in order.
    pub(crate) fn check(&self) -> Result<CameraId, Problem> {
        check_interval(self.from_s, self.to_s, LONGEST_S)?;
        camera(self.camera)
    }
}

/// Camera 1 or 2.
pub(crate) fn camera(number: u8) -> Result<CameraId, Problem> {
    let found = CameraId::ALL.into_iter().find(|c| c.number() == number);
    found.ok_or_else(|| Problem::request(format!("camera: expected 1 or 2, found {number}")))
}

/// Checks an interval of session time.
pub(crate) fn check_interval(from_s: f64, to_s: f64, longest_s: f64) -> Result<(), Problem> {
    let length = to_s - from_s;
    // Also false for NaN and infinities.
    if (0.0..=longest_s).contains(&length) && from_s.abs() < 1e9 {
        return Ok(());
    }
    Err(Problem::request(format!(
        "expected from_s <= to_s within {longest_s} s of each other, found {from_s} and {to_s}"
    )))
}

/// Events of the window in stream order, each with its time after the start, µs.
pub(crate) fn read(opened: &OpenSession, window: &Window) -> Result<Vec<(u32, CdEvent)>, Problem> {
    let camera = window.check()?;
    let known = &opened.known;
    let clock = known.clocks[camera.index()].as_ref();
    let interval = clock.and_then(|c| c.interval_us(window.from_s, window.to_s));
    let Some((from_us, to_us)) = interval else {
        return Ok(Vec::new());
    };
    let mut events = Vec::new();
    let mut found = 0usize;
    events_between(
        &opened.reader,
        &known.indices[camera.index()],
        (from_us, to_us),
        |event| {
            found += 1;
            if found <= MOST_EVENTS {
                // At most 60 s.
                events.push(((event.t_us - from_us) as u32, event));
            }
        },
    )?;
    if found > MOST_EVENTS {
        return Err(Problem::request(format!(
            "camera {}: expected at most {MOST_EVENTS} events from {} s to {} s, found {found}\n  next: shorten the accumulation time",
            window.camera, window.from_s, window.to_s
        )));
    }
    Ok(events)
}

/// The answer.
pub(crate) fn bytes(opened: &OpenSession, window: &Window) -> Result<Vec<u8>, Problem> {
    let events = read(opened, window)?;
    let mut bytes = Vec::with_capacity(8 * events.len());
    for (after_us, event) in events {
        let on = u32::from(event.polarity == Polarity::On) << 19;
        let place = u32::from(event.x & 0x3ff) | u32::from(event.y & 0x1ff) << 10 | on;
        bytes.extend(after_us.to_le_bytes());
        bytes.extend(place.to_le_bytes());
    }
    Ok(bytes)
}
