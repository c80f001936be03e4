//! What a check reads out of the cameras' bytes: events by pixel, steps of the time base, the order of a scan.

use skinrig_device::CameraCapabilities;
use skinrig_formats::{Decoder, Discontinuity, EventSink, Geometry};
use skinrig_model::{CameraId, CdEvent, HostDuration, RawChunk, TriggerEdge};

use crate::findings::Findings;
use crate::streams::{Seen, Streams};

/// Reads one camera's stream from its start on; counts between the beginning that [`watch`] tells and the end.
pub(super) struct Reader {
    decoder: Decoder,
    pub counts: Counts,
}

/// What was counted.
pub(super) struct Counts {
    counting: bool,
    width: usize,
    /// Events by pixel, row after row; empty when they are not wanted.
    pub by_pixel: Vec<u32>,
    /// Events.
    pub events: u64,
    /// Steps of the time base that are neither progress nor a wrap.
    pub jumps: u64,
    /// A scan that is followed.
    pub scan: Option<Scan>,
}

/// A scan: each event one row below the last, after the last row at the top of the next column.
pub(super) struct Scan {
    columns: u32,
    rows: u32,
    next: Option<u32>,
    /// Events that were not where the one before led to, and events outside.
    pub breaks: u64,
    /// Largest column and row that were seen.
    pub largest: (u16, u16),
}

impl Reader {
    /// Of a sensor whose pixels are counted one by one.
    pub(crate) fn of_pixels(can: &CameraCapabilities) -> Self {
        let geometry = Geometry {
            width: can.width,
            height: can.height,
        };
        let pixels = usize::from(can.width) * usize::from(can.height);
        Self::new(can, geometry, vec![0; pixels], None)
    }

    /// Of events that come in the order of a scan over `columns` and `rows`, which need not be the sensor's.
    pub(crate) fn of_scan(can: &CameraCapabilities, columns: u16, rows: u16) -> Self {
        let scan = Scan {
            columns: columns.into(),
            rows: rows.into(),
            next: None,
            breaks: 0,
            largest: (0, 0),
        };
        Self::new(can, Geometry::ANY, Vec::new(), Some(scan))
    }

    /// Of the stream alone.
    pub(crate) fn of_time(can: &CameraCapabilities) -> Self {
        Self::new(can, Geometry::ANY, Vec::new(), None)
    }

    fn new(
        can: &CameraCapabilities,
        geometry: Geometry,
        by_pixel: Vec<u32>,
        scan: Option<Scan>,
    ) -> Self {
        Self {
            decoder: Decoder::with_geometry(can.format, geometry),
            counts: Counts {
                counting: false,
                width: can.width.into(),
                by_pixel,
                events: 0,
                jumps: 0,
                scan,
            },
        }
    }

    /// Takes a chunk.
    pub fn see(&mut self, chunk: &RawChunk) {
        if chunk.lost_before > 0 {
            self.decoder.lost(chunk.lost_before);
            // What is lost is counted as such: the scan goes on wherever it is then.
            if let Some(scan) = &mut self.counts.scan {
                scan.next = None;
            }
        }
        self.decoder.push(&chunk.bytes, &mut self.counts);
    }
}

/// Lets the streams settle, counts for the second of the two spans, and stops the cameras. What each camera gave that streamed
/// to the end.
pub(super) fn watch(
    streams: Streams<'_>,
    [settle, duration]: [HostDuration; 2],
    mut readers: [Option<Reader>; 2],
    found: &mut Findings,
    metrics: &[&'static str],
) -> Vec<(CameraId, Seen, Reader)> {
    let mut streams = streams.without_box();
    let see = |readers: &mut [Option<Reader>; 2], chunk: &RawChunk| {
        if let Some(reader) = &mut readers[chunk.camera.index()] {
            reader.see(chunk);
        }
    };
    streams.pass(settle, &mut |chunk| see(&mut readers, chunk));
    streams.begin(&mut |chunk| see(&mut readers, chunk));
    for reader in readers.iter_mut().flatten() {
        reader.counts.counting = true;
    }
    streams.pass(duration, &mut |chunk| see(&mut readers, chunk));
    let seen = streams.finish(found, metrics, &mut |chunk| see(&mut readers, chunk));
    let each = CameraId::ALL.into_iter().zip(seen).zip(readers);
    each.filter_map(|((camera, seen), reader)| Some((camera, seen?, reader?)))
        .collect()
}

impl Counts {
    /// Where a pixel is, in words.
    pub fn place(&self, at: usize) -> String {
        format!(
            "column {}, row {}",
            at % self.width.max(1),
            at / self.width.max(1)
        )
    }
}

impl EventSink for Counts {
    fn on_cd(&mut self, events: &[CdEvent]) {
        if let Some(scan) = &mut self.scan {
            for event in events {
                scan.follow(event.x, event.y, self.counting);
            }
        }
        if !self.counting {
            return;
        }
        self.events += events.len() as u64;
        if !self.by_pixel.is_empty() {
            for event in events {
                let at = usize::from(event.y) * self.width + usize::from(event.x);
                if let Some(count) = self.by_pixel.get_mut(at) {
                    *count = count.saturating_add(1);
                }
            }
        }
    }

    fn on_trigger(&mut self, _edge: TriggerEdge) {}

    fn on_discontinuity(&mut self, _step: Discontinuity) {
        self.jumps += u64::from(self.counting);
    }
}

impl Scan {
    fn follow(&mut self, x: u16, y: u16, counting: bool) {
        let (column, row) = (u32::from(x), u32::from(y));
        let inside = column < self.columns && row < self.rows;
        let at = column * self.rows + row;
        if counting {
            let led_here = inside && self.next.is_none_or(|next| next == at);
            self.breaks += u64::from(!led_here);
            self.largest = (self.largest.0.max(x), self.largest.1.max(y));
        }
        let pixels = self.columns * self.rows;
        self.next = inside.then(|| (at + 1) % pixels.max(1));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scan_is_followed_around_its_corners_and_breaks_are_counted() {
        let mut scan = Scan {
            columns: 2,
            rows: 3,
            next: None,
            breaks: 0,
            largest: (0, 0),
        };
        // Anything before it counts is no break, wherever it begins.
        scan.follow(9, 9, false);
        for (x, y) in [(0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (0, 0)] {
            scan.follow(x, y, true);
        }
        assert_eq!((scan.breaks, scan.largest), (0, (1, 2)));
        scan.follow(0, 2, true); // one is missing
        scan.follow(1, 0, true);
        scan.follow(1, 3, true); // outside
        scan.follow(1, 1, true);
        assert_eq!(scan.breaks, 2);
    }
}
