//! Event filters according to the registers: active pixels, enabled inputs, and whether time runs.

use std::sync::Arc;

use super::pattern::Pattern;
use super::registers as r;
use super::registers::Registers;

/// Active pixels: a pixel is active if both its column and its row are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Roi {
    columns: [u32; 20],
    rows: [u32; 15],
}

impl Roi {
    pub(crate) fn read(registers: &Registers) -> Self {
        Self {
            columns: std::array::from_fn(|n| registers.get(r::TD_ROI_X + 4 * n as u32)),
            rows: std::array::from_fn(|n| registers.get(r::TD_ROI_Y + 4 * n as u32)),
        }
    }

    pub(crate) fn has(&self, x: u16, y: u16) -> bool {
        let bit = |words: &[u32], n: u16| {
            words
                .get(usize::from(n / 32))
                .is_some_and(|w| w >> (n % 32) & 1 == 1)
        };
        bit(&self.columns, x) && bit(&self.rows, y)
    }

    pub(crate) fn is_full(&self) -> bool {
        let all = |words: &[u32]| words.iter().all(|w| *w == u32::MAX);
        all(&self.columns) && all(&self.rows)
    }
}

/// Source of a camera's time (section 2.14).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sync {
    Standalone,
    Master,
    Slave,
}

impl Sync {
    pub(super) fn read(registers: &Registers) -> Self {
        match (
            registers.bit(r::ATIS_CONTROL, 12),
            registers.bit(r::ATIS_CONTROL, 14),
        ) {
            (true, true) => Self::Master,
            (false, true) => Self::Slave,
            _ => Self::Standalone,
        }
    }
}

/// Filters while a packet is generated.
#[derive(Debug, Clone)]
pub(crate) struct Gates {
    /// Whether pixels send events.
    pub pixels: bool,
    /// Pattern generator that replaces the pixels.
    pub pattern: Option<Pattern>,
    /// Whether the bias disables OFF events (observed on an EVK1 at code 0, section 2.9).
    pub no_off: bool,
    pub roi: Arc<Roi>,
    /// Noise filter: minimum events per period in µs (section 2.11).
    pub filter: Option<(u32, u32)>,
    /// Enabled trigger inputs, bit by channel.
    pub triggers: u32,
    /// Trigger output, which loops back to input 6: period and width, µs.
    pub pulses: Option<(u32, u32)>,
    /// Duration of a packet, µs.
    pub packet_us: u32,
    /// Whether transfers end with packets.
    pub short_packets: bool,
}

/// Whether the time base runs and bytes flow to the host.
pub(super) fn runs(registers: &Registers) -> bool {
    registers.bit(r::CCAM2_CONTROL, 8) && registers.bit(r::CCAM2_CONTROL, 9)
}

impl Gates {
    pub(crate) fn read(registers: &Registers, roi: &Arc<Roi>) -> Self {
        let atis = |bit| registers.bit(r::ATIS_CONTROL, bit);
        let powered = (0..3).all(atis) && !atis(3);
        let clocked = registers.bit(r::IF_CONTROL, 1) && registers.bit(r::CLK_OUT_CTRL, 0);
        let released = atis(18) && registers.bit(r::ROI_CTRL, 1) && registers.bit(r::ROI_CTRL, 3);
        let thresholds = registers.get(r::NFL_THRESH);
        let filter = registers
            .bit(r::NFL_CTRL, 0)
            .then_some((thresholds & 0x3fff, (thresholds >> 14 & 0x3ff).max(1)));
        let pulses = registers.bit(r::EXT_SYNC_OUT_MODE, 0)
            && registers.bit(r::TRIGGER_OUT_ENABLE, 0)
            && registers.get(r::FPGA_VERSION) >= 0x0003_0000;
        let (period, width) = (
            registers.get(r::TRIGGER_OUT_PERIOD),
            registers.get(r::TRIGGER_OUT_WIDTH),
        );
        // Channel 7 carries the sync clock in slave mode.
        let inputs = if Sync::read(registers) == Sync::Slave {
            0x7f
        } else {
            0xff
        };
        Self {
            pixels: powered && clocked && released,
            pattern: Pattern::read(registers),
            no_off: registers.get(r::BIAS_DIFF_OFF) & 0x0800_00ff == 0x0800_0000,
            roi: Arc::clone(roi),
            filter,
            triggers: registers.get(r::TRIGGER_ENABLE) & inputs,
            pulses: (pulses && width > 0 && width < period).then_some((period, width)),
            packet_us: registers.get(r::PKT_END_INTERVAL_US).clamp(16, 1 << 20),
            short_packets: registers.bit(r::PKT_END_ENABLE, 0),
        }
    }
}
