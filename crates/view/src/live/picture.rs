//! Owns the picture of a camera's newest events.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;
use skinrig_formats::{Decoder, Scanner};
use skinrig_model::{CdEvent, Polarity, SENSOR_HEIGHT, SENSOR_WIDTH, StreamFormat};
use skinrig_recorder::{ChunkMeta, RecorderError, SessionReader};

/// Chunks to look at.
pub(super) const CHUNKS: u32 = 4;
/// Events of this long before the newest one are shown, µs.
const ACCUMULATION_US: u64 = 200_000;
/// Side of a bin, px.
const BIN: usize = 4;
const WIDTH: usize = SENSOR_WIDTH as usize / BIN;
const HEIGHT: usize = SENSOR_HEIGHT as usize / BIN;

/// Newest events of a camera, counted in square bins.
#[derive(Debug, PartialEq, Serialize)]
pub(super) struct Picture {
    width: usize,
    height: usize,
    accumulation_s: f64,
    events: u64,
    /// When the run took the events from the camera, s since 1970; `None` for events from the file.
    unix_s: Option<f64>,
    /// Bins with events, as base64: index row by row (u16, little endian), ON count and OFF count (one byte each, 255: or more).
    bins: String,
}

impl Picture {
    fn new(counts: &[u8], events: u64, unix_s: Option<f64>) -> Self {
        let (on, off) = counts.split_at(WIDTH * HEIGHT);
        let mut bins = Vec::new();
        for (index, (on, off)) in (0u16..).zip(on.iter().zip(off)) {
            if (*on, *off) != (0, 0) {
                bins.extend(index.to_le_bytes());
                bins.extend([*on, *off]);
            }
        }
        Self {
            width: WIDTH,
            height: HEIGHT,
            accumulation_s: ACCUMULATION_US as f64 * 1e-6,
            events,
            unix_s,
            bins: STANDARD.encode(&bins),
        }
    }
}

/// The picture from bytes that a run has just received; `None` without an event.
pub(super) fn from_bytes(format: StreamFormat, bytes: &[u8], unix_s: f64) -> Option<Picture> {
    let mut newest_us = None;
    Decoder::new(format).for_each_slice(bytes, |slice| {
        newest_us = slice.last().map(|e| e.t_us).or(newest_us);
    });
    let to_us = newest_us?;
    let from_us = to_us.saturating_sub(ACCUMULATION_US);
    let mut counts = vec![0u8; 2 * WIDTH * HEIGHT];
    let mut events = 0;
    Decoder::new(format).for_each_slice(bytes, |slice| {
        // The first words may have another time: what it depends on is cut off.
        let new = slice.iter().filter(|e| (from_us..=to_us).contains(&e.t_us));
        for event in new {
            events += u64::from(count(&mut counts, event));
        }
    });
    Some(Picture::new(&counts, events, Some(unix_s)))
}

/// The picture from the last chunks, which are in stream order; `None` without an event.
pub(super) fn picture(
    reader: &SessionReader,
    format: StreamFormat,
    chunks: &[ChunkMeta],
) -> Result<Option<Picture>, RecorderError> {
    let mut first = chunks.len();
    let newest = chunks.iter().rev().find_map(|c| c.facts.last_us);
    let Some(newest_us) = newest else {
        return Ok(None);
    };
    // Back to the chunk that holds the beginning, and within one leg.
    while first > 0 {
        first -= 1;
        let chunk = &chunks[first];
        let begins = chunk
            .facts
            .first_us
            .is_some_and(|t| t + ACCUMULATION_US <= newest_us);
        if begins || chunk.restart_us.is_some() {
            break;
        }
    }
    let mut counts = vec![0u8; 2 * WIDTH * HEIGHT];
    let mut events = 0;
    for chunk in &chunks[first..] {
        let bytes = reader.chunk_bytes(chunk.camera, chunk.seq)?;
        // Decoded by itself a chunk has times of its own; both end with the same word.
        let alone = Scanner::new(format).push(&bytes).0.last_us;
        let (Some(alone), Some(last_us)) = (alone, chunk.facts.last_us) else {
            continue;
        };
        let from_us =
            (newest_us - ACCUMULATION_US.min(newest_us)) as i64 - last_us as i64 + alone as i64;
        Decoder::new(format).for_each_slice(&bytes, |slice| {
            let new = slice.iter().filter(|e| e.t_us as i64 >= from_us);
            for event in new {
                events += u64::from(count(&mut counts, event));
            }
        });
    }
    Ok(Some(Picture::new(&counts, events, None)))
}

/// Counts an event; false if it is off the sensor.
fn count(counts: &mut [u8], event: &CdEvent) -> bool {
    if event.x >= SENSOR_WIDTH || event.y >= SENSOR_HEIGHT {
        return false;
    }
    let at = usize::from(event.y) / BIN * WIDTH + usize::from(event.x) / BIN;
    let plane = match event.polarity {
        Polarity::On => 0,
        Polarity::Off => WIDTH * HEIGHT,
    };
    counts[plane + at] = counts[plane + at].saturating_add(1);
    true
}

#[cfg(test)]
mod tests {
    use skinrig_formats::evt2;

    use super::*;

    #[test]
    fn a_picture_shows_the_newest_events_alone() {
        let mut encoder = evt2::Encoder::new(0);
        let mut bytes = Vec::new();
        for (t_us, x) in [(1_000, 0), (900_000, 4), (1_000_000, 8), (1_000_000, 8)] {
            let event = CdEvent {
                t_us,
                x,
                y: 4,
                polarity: Polarity::On,
            };
            encoder.cd(event, &mut bytes).unwrap();
        }
        let picture = from_bytes(StreamFormat::Evt2, &bytes, 7.0).unwrap();
        assert_eq!((picture.events, picture.unix_s), (3, Some(7.0)));
        let bins = STANDARD.decode(&picture.bins).unwrap();
        let row = WIDTH as u16;
        let index = |x: u16| (row + x).to_le_bytes();
        let [a, b] = [index(1), index(2)];
        assert_eq!(bins, [a[0], a[1], 1, 0, b[0], b[1], 2, 0]);
        assert!(from_bytes(StreamFormat::Evt2, &[], 7.0).is_none());
    }
}
