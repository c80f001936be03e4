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
    /// ON counts row by row, then OFF counts, one byte each (255: or more), as base64.
    counts: String,
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
    Ok(Some(Picture {
        width: WIDTH,
        height: HEIGHT,
        accumulation_s: ACCUMULATION_US as f64 * 1e-6,
        events,
        counts: STANDARD.encode(&counts),
    }))
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
