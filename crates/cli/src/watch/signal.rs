//! Signal-to-noise ratio of a press: the event rate during contact over the rate before it.

use std::collections::BTreeMap;

use serde::Serialize;
use skinrig_formats::{Decoder, Scanner};
use skinrig_model::{AttemptId, CameraId, PressOutcome, StreamFormat};
use skinrig_recorder::{ChunkMeta, RecorderError, SessionReader};

/// Time before a press over which noise is measured, µs.
const IDLE_US: i64 = 300_000;
/// Number of latest chunks read per camera: a press ends a chunk.
const CHUNKS: u32 = 8;

/// Event rates of a camera for one press.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct Signal {
    /// Events per second from contact to release.
    pub press_per_s: f64,
    /// Events per second in the 0.3 s before the motion for it.
    pub idle_per_s: f64,
}

impl Signal {
    /// Signal over noise; without noise, over one event.
    #[must_use]
    pub(super) fn ratio(self) -> f64 {
        self.press_per_s / self.idle_per_s.max(1e6 / IDLE_US as f64)
    }
}

/// Two intervals of a camera's time in which events are counted, from and to, µs.
struct Count {
    attempt: AttemptId,
    spans: [(i64, i64); 2],
    events: [u64; 2],
}

/// Signals of these presses, as far as the last chunks cover them. The clocks are aligned by the smallest delay between the last
/// event of a chunk and its arrival, which is accurate to a few milliseconds.
pub(super) fn signals(
    reader: &SessionReader,
    formats: [StreamFormat; 2],
    outcomes: &[&PressOutcome],
) -> Result<BTreeMap<AttemptId, [Option<Signal>; 2]>, RecorderError> {
    let mut found: BTreeMap<AttemptId, [Option<Signal>; 2]> =
        outcomes.iter().map(|o| (o.attempt, [None; 2])).collect();
    for camera in CameraId::ALL {
        let k = camera.index();
        let mut last = reader.last_chunks(camera, CHUNKS)?;
        // Chunks before the start of the leg have another clock.
        if let Some(leg) = last.iter().rposition(|c| c.restart_us.is_some()) {
            last.drain(..leg);
        }
        for count in counts(reader, formats[k], &last, outcomes)? {
            let per_s = |i: usize| {
                let (from, to) = count.spans[i];
                count.events[i] as f64 * 1e6 / (to - from).max(1) as f64
            };
            if let Some(signals) = found.get_mut(&count.attempt) {
                signals[k] = Some(Signal {
                    press_per_s: per_s(0),
                    idle_per_s: per_s(1),
                });
            }
        }
    }
    Ok(found)
}

fn counts(
    reader: &SessionReader,
    format: StreamFormat,
    chunks: &[ChunkMeta],
    outcomes: &[&PressOutcome],
) -> Result<Vec<Count>, RecorderError> {
    let times = |c: &ChunkMeta| Some((c.facts.first_us? as i64, c.facts.last_us? as i64));
    let ahead = |c: &ChunkMeta| Some(c.host_time.0 / 1000 - times(c)?.1);
    let (Some(ahead_us), Some(begin_us), Some(end_us)) = (
        chunks.iter().filter_map(ahead).min(),
        chunks.iter().find_map(|c| Some(times(c)?.0)),
        chunks.iter().rev().find_map(|c| Some(times(c)?.1)),
    ) else {
        return Ok(Vec::new());
    };
    let mut counts: Vec<Count> = outcomes
        .iter()
        .filter_map(|outcome| {
            let timing = outcome.timing?;
            let [approach, contact, release] =
                [timing.approach, timing.contact, timing.release].map(|t| t.0 / 1000 - ahead_us);
            let spans = [(contact, release), (approach - IDLE_US, approach)];
            // Skip presses that the chunks do not cover completely.
            (spans[1].0 >= begin_us && release <= end_us).then_some(Count {
                attempt: outcome.attempt,
                spans,
                events: [0; 2],
            })
        })
        .collect();
    let touches = |c: &&ChunkMeta| {
        let Some((first, last)) = times(c) else {
            return false;
        };
        let spans = counts.iter().flat_map(|count| count.spans);
        let mut overlaps = spans.map(|(from, to)| first <= to && from <= last);
        overlaps.any(|it| it)
    };
    let selected: Vec<ChunkMeta> = chunks.iter().filter(touches).copied().collect();
    for chunk in selected {
        let bytes = reader.chunk_bytes(chunk.camera, chunk.seq)?;
        // A chunk decoded alone has its own time origin; align it by its last word.
        let alone = Scanner::new(format).push(&bytes).0.last_us;
        let (Some(alone), Some((_, last))) = (alone, times(&chunk)) else {
            continue;
        };
        let move_us = last - alone as i64;
        Decoder::new(format).for_each_slice(&bytes, |events| {
            for event in events {
                let t = event.t_us as i64 + move_us;
                for count in &mut counts {
                    for (span, n) in count.spans.iter().zip(&mut count.events) {
                        *n += u64::from((span.0..span.1).contains(&t));
                    }
                }
            }
        });
    }
    Ok(counts)
}
