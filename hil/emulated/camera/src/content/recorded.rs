//! The events of an EVT2 file, shifted in time.

use std::path::Path;

use skinrig_formats::raw::RawReader;
use skinrig_model::CdEvent;

use skinrig_sim::scene::PixelEvent;

use crate::error::BusError;

pub(crate) struct RecordedEvents {
    /// In the order of time.
    events: Vec<CdEvent>,
    next: usize,
    from_ns: i64,
}

impl RecordedEvents {
    pub(crate) fn open(path: &Path) -> Result<Self, BusError> {
        let message = |e: skinrig_formats::FormatsError| BusError::Content(e.to_string());
        let mut reader = RawReader::open(path).map_err(message)?;
        let mut decoder = reader.decoder();
        let (mut events, mut triggers) = (Vec::new(), Vec::new());
        loop {
            let chunk = reader.next_chunk().map_err(message)?;
            if chunk.is_empty() {
                break;
            }
            decoder.push_cd(chunk, &mut events, &mut triggers);
        }
        events.sort_by_key(|e| e.t_us);
        Ok(Self {
            events,
            next: 0,
            from_ns: 0,
        })
    }

    pub(crate) fn start(&mut self, from_ns: i64) {
        (self.next, self.from_ns) = (0, from_ns);
    }

    pub(crate) fn events(&mut self, until_ns: i64, out: &mut Vec<PixelEvent>) {
        let first_us = self.events.first().map_or(0, |e| e.t_us);
        while let Some(event) = self.events.get(self.next) {
            let t_ns = self.from_ns + (event.t_us - first_us) as i64 * 1_000;
            if t_ns >= until_ns {
                break;
            }
            out.push(PixelEvent {
                t_ns,
                x: event.x,
                y: event.y,
                polarity: event.polarity,
            });
            self.next += 1;
        }
    }
}
