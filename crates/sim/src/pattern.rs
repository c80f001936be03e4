//! The test pattern of a simulated camera.

use skinrig_device::PatternScan;
use skinrig_model::Polarity;

use crate::scene::{PixelEvent, PixelModel, TipSample};

/// A scan of all pixels, column by column, at a constant rate.
pub(crate) struct ScanModel {
    scan: PatternScan,
    /// Pixel of the next event.
    next: u32,
    /// Fraction of the next event.
    due: f64,
}

impl ScanModel {
    /// A scan that starts at the first pixel.
    pub(crate) fn new(scan: PatternScan) -> Self {
        Self {
            scan,
            next: 0,
            due: 0.0,
        }
    }
}

impl PixelModel for ScanModel {
    fn advance(&mut self, tips: &[TipSample], out: &mut Vec<PixelEvent>) {
        let rows = u32::from(self.scan.rows);
        let pixels = u32::from(self.scan.columns) * rows;
        for pair in tips.windows(2) {
            let span_ns = pair[1].t_ns - pair[0].t_ns;
            self.due += self.scan.rate_ev_s * span_ns as f64 * 1e-9;
            let count = self.due as i64;
            self.due -= count as f64;
            for k in 0..count {
                out.push(PixelEvent {
                    t_ns: pair[0].t_ns + span_ns * k / count,
                    x: (self.next / rows) as u16,
                    y: (self.next % rows) as u16,
                    polarity: Polarity::On,
                });
                self.next = (self.next + 1) % pixels;
            }
        }
    }
}
