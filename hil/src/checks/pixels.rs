//! Decodes camera streams for checks: counts events per pixel and time base jumps, and follows a
//! test pattern.

use skinrig_device::CameraCapabilities;
use skinrig_formats::{Decoder, Discontinuity, EventSink, Geometry};
use skinrig_model::{CameraId, CdEvent, HostDuration, RawChunk, TriggerEdge};

use crate::findings::Findings;
use crate::streams::{StreamStats, Streams};

/// Decodes one camera's stream from its start. Counts only in the measuring period of [`watch`].
pub(super) struct Reader {
    decoder: Decoder,
    pub counts: Counts,
}

/// Counts of a camera's stream.
pub(super) struct Counts {
    counting: bool,
    width: usize,
    /// Events per pixel, row by row; empty if not needed.
    pub by_pixel: Vec<u32>,
    /// Number of events.
    pub events: u64,
    /// Time base steps that are neither progress nor a wrap.
    pub jumps: u64,
    /// State of the expected scan, if the events form one.
    pub scan: Option<Scan>,
}

/// A scan: each event is one row below the previous one; after the last row the next column starts
/// at the top.
pub(super) struct Scan {
    columns: u32,
    rows: u32,
    next: Option<u32>,
    /// Events outside the scan, or not at the expected position.
    pub breaks: u64,
    /// Largest column and row seen.
    pub largest: (u16, u16),
}

impl Reader {
    /// Counts events per pixel.
    pub(crate) fn per_pixel(capabilities: &CameraCapabilities) -> Self {
        let geometry = Geometry {
            width: capabilities.width,
            height: capabilities.height,
        };
        let pixels = usize::from(capabilities.width) * usize::from(capabilities.height);
        Self::new(capabilities, geometry, vec![0; pixels], None)
    }

    /// Follows a scan over `columns` and `rows`, which may differ from the sensor's size.
    pub(crate) fn following_scan(
        capabilities: &CameraCapabilities,
        columns: u16,
        rows: u16,
    ) -> Self {
        let scan = Scan {
            columns: columns.into(),
            rows: rows.into(),
            next: None,
            breaks: 0,
            largest: (0, 0),
        };
        Self::new(capabilities, Geometry::ANY, Vec::new(), Some(scan))
    }

    /// Checks the time base only.
    pub(crate) fn time_base_only(capabilities: &CameraCapabilities) -> Self {
        Self::new(capabilities, Geometry::ANY, Vec::new(), None)
    }

    fn new(
        capabilities: &CameraCapabilities,
        geometry: Geometry,
        by_pixel: Vec<u32>,
        scan: Option<Scan>,
    ) -> Self {
        Self {
            decoder: Decoder::with_geometry(capabilities.format, geometry),
            counts: Counts {
                counting: false,
                width: capabilities.width.into(),
                by_pixel,
                events: 0,
                jumps: 0,
                scan,
            },
        }
    }

    /// Decodes a chunk.
    pub(super) fn push(&mut self, chunk: &RawChunk) {
        if chunk.lost_before > 0 {
            self.decoder.lost(chunk.lost_before);
            // Data loss is counted separately, so accept any position after it.
            if let Some(scan) = &mut self.counts.scan {
                scan.next = None;
            }
        }
        self.decoder.push(&chunk.bytes, &mut self.counts);
    }
}

/// Lets the streams settle, counts for `duration`, and stops the cameras. Returns the results of each camera that streamed to the end.
pub(super) fn watch(
    streams: Streams<'_>,
    [settle, duration]: [HostDuration; 2],
    mut readers: [Option<Reader>; 2],
    findings: &mut Findings,
    metrics: &[&'static str],
) -> Vec<(CameraId, StreamStats, Reader)> {
    let mut streams = streams.without_box();
    let on_chunk = |readers: &mut [Option<Reader>; 2], chunk: &RawChunk| {
        if let Some(reader) = &mut readers[chunk.camera.index()] {
            reader.push(chunk);
        }
    };
    streams.pass(settle, &mut |chunk| on_chunk(&mut readers, chunk));
    streams.start_counting(&mut |chunk| on_chunk(&mut readers, chunk));
    for reader in readers.iter_mut().flatten() {
        reader.counts.counting = true;
    }
    streams.pass(duration, &mut |chunk| on_chunk(&mut readers, chunk));
    let stats = streams.finish(findings, metrics, &mut |chunk| {
        on_chunk(&mut readers, chunk)
    });
    let each = CameraId::ALL.into_iter().zip(stats).zip(readers);
    each.filter_map(|((camera, stats), reader)| Some((camera, stats?, reader?)))
        .collect()
}

impl Counts {
    /// Coordinates of a pixel for messages.
    pub(crate) fn pixel_name(&self, at: usize) -> String {
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
            let is_expected = inside && self.next.is_none_or(|next| next == at);
            self.breaks += u64::from(!is_expected);
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
        // Events before counting starts are never breaks.
        scan.follow(9, 9, false);
        for (x, y) in [(0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (0, 0)] {
            scan.follow(x, y, true);
        }
        assert_eq!((scan.breaks, scan.largest), (0, (1, 2)));
        scan.follow(0, 2, true); // skips one
        scan.follow(1, 0, true);
        scan.follow(1, 3, true); // outside
        scan.follow(1, 1, true);
        assert_eq!(scan.breaks, 2);
    }
}
