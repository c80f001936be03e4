//! The FPGA's pattern generator (EVK1 reference, section 2.17), which replaces the sensor's events.
//!
//! Order and rate are those of the public driver and its checker. It is assumed that the region, the noise filter and the biases, which
//! belong to the sensor, do not affect it, and that the field-of-view filter, which belongs to the FPGA, does.

use skinrig_model::Polarity;

use super::registers as r;
use super::registers::Registers;
use skinrig_sim::scene::PixelEvent;

/// Columns and rows of the scan.
const COLUMNS: u32 = 512;
const ROWS: u32 = 1024;
/// Clock cycles per µs of the camera's time.
const CYCLES_PER_US: f64 = 100.0;

/// Configuration according to the registers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pattern {
    /// Events per µs of the camera's time.
    per_us: f64,
    /// Whether the scan is diagonal instead of column by column.
    diagonal: bool,
    polarity: Polarity,
    /// First column and row that pass, and their number.
    window: Option<[u32; 4]>,
}

impl Pattern {
    /// `None` while it is off or generates exposure measurement events, which this sensor does not support.
    pub(crate) fn read(registers: &Registers) -> Option<Self> {
        let bit = |n| registers.bit(r::TEST_PATTERN_CONTROL, n);
        if !bit(0) || bit(8) {
            return None;
        }
        // The two periods alternate, each for its own time.
        let period = |address| {
            let word = registers.get(address);
            (f64::from(word >> 16), f64::from(word & 0x3ff) / 1024.0)
        };
        let (n, p) = (
            period(r::TEST_PATTERN_N_PERIOD),
            period(r::TEST_PATTERN_P_PERIOD),
        );
        let cycles = n.0 + p.0;
        let share = if cycles > 0.0 {
            (n.0 * n.1 + p.0 * p.1) / cycles
        } else {
            0.0
        };
        let side = |address| {
            let word = registers.get(address);
            (word >> 16 & 0x7ff, word & 0x7ff)
        };
        let ((x, width), (y, height)) = (side(r::OUT_OF_FOV_X), side(r::OUT_OF_FOV_Y));
        Some(Self {
            per_us: share * CYCLES_PER_US,
            diagonal: bit(4),
            polarity: Polarity::from_bit(bit(12)),
            window: registers
                .bit(r::CCAM2_CONTROL, 11)
                .then_some([x, y, width, height]),
        })
    }

    fn passes(&self, x: u32, y: u32) -> bool {
        self.window.is_none_or(|[x0, y0, width, height]| {
            (x0..x0 + width).contains(&x) && (y0..y0 + height).contains(&y)
        })
    }
}

/// State of the scan.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Scan {
    next: u32,
    /// Fraction of the next event.
    due: f64,
}

impl Scan {
    /// The events of a packet: `span_us` of the camera's time, from `from_ns` to `until_ns` of true time.
    pub(super) fn events(
        &mut self,
        pattern: &Pattern,
        span_us: u64,
        from_ns: i64,
        until_ns: i64,
        out: &mut Vec<PixelEvent>,
    ) {
        self.due += pattern.per_us * span_us as f64;
        let count = self.due as i64;
        self.due -= count as f64;
        for k in 0..count {
            let (x, y) = if pattern.diagonal {
                (self.next % COLUMNS, self.next % COLUMNS)
            } else {
                (self.next / ROWS, self.next % ROWS)
            };
            self.next = (self.next + 1) % (COLUMNS * ROWS);
            if pattern.passes(x, y) {
                out.push(PixelEvent {
                    t_ns: from_ns + (until_ns - from_ns) * k / count,
                    x: x as u16,
                    y: y as u16,
                    polarity: pattern.polarity,
                });
            }
        }
    }
}
