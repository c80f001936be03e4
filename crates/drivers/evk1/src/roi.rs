//! The region of interest: one bit per column and one per row.

use skinrig_device::Roi;
use skinrig_model::{SENSOR_HEIGHT, SENSOR_WIDTH};

use crate::access::Registers;
use crate::error::Evk1Error;
use crate::registers::{
    ROI_TD_EN, ROI_TD_SHADOW_TRIGGER, ROI_X_WORDS, ROI_Y_WORDS, Register, roi_x, roi_y,
};

/// A pixel is live when both its column's and its row's bit are set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Map {
    /// Bit x % 32 of word x / 32 is column x.
    pub columns: [u32; ROI_X_WORDS],
    /// Bit y % 32 of word y / 32 is row y.
    pub rows: [u32; ROI_Y_WORDS],
}

impl Map {
    /// All pixels.
    pub const ALL: Self = Self {
        columns: [u32::MAX; ROI_X_WORDS],
        rows: [u32::MAX; ROI_Y_WORDS],
    };

    /// The pixels of `roi`; all when absent.
    ///
    /// # Errors
    /// [`Evk1Error::Refused`] for an empty region or one that is not within the sensor.
    pub fn of(roi: Option<Roi>) -> Result<Self, Evk1Error> {
        let Some(roi) = roi else { return Ok(Self::ALL) };
        let fits = |from: u16, size: u16, limit: u16| {
            size > 0 && u32::from(from) + u32::from(size) <= u32::from(limit)
        };
        if !fits(roi.x, roi.width, SENSOR_WIDTH) || !fits(roi.y, roi.height, SENSOR_HEIGHT) {
            return Err(Evk1Error::refused(
                format!("a non-empty region within {SENSOR_WIDTH} x {SENSOR_HEIGHT}"),
                describe(roi),
            ));
        }
        Ok(Self {
            columns: bits(roi.x, roi.width),
            rows: bits(roi.y, roi.height),
        })
    }

    /// The registers of a map.
    pub fn registers() -> impl Iterator<Item = Register> {
        (0..ROI_X_WORDS)
            .map(roi_x)
            .chain((0..ROI_Y_WORDS).map(roi_y))
    }

    /// Writes the map and makes the sensor take it over.
    ///
    /// # Errors
    /// [`Evk1Error::Usb`], [`Evk1Error::ReadBack`].
    pub fn write(&self, registers: &mut Registers<'_>) -> Result<(), Evk1Error> {
        for (n, word) in self.columns.into_iter().enumerate() {
            registers.write(roi_x(n), word)?;
        }
        for (n, word) in self.rows.into_iter().enumerate() {
            registers.write(roi_y(n), word)?;
        }
        registers.set(ROI_TD_EN, 1)?;
        registers.set(ROI_TD_SHADOW_TRIGGER, 1)?;
        registers.set(ROI_TD_SHADOW_TRIGGER, 0)
    }

    /// Reads the map.
    ///
    /// # Errors
    /// [`Evk1Error::Usb`].
    pub fn read(registers: &mut Registers<'_>) -> Result<Self, Evk1Error> {
        let mut map = Self {
            columns: [0; ROI_X_WORDS],
            rows: [0; ROI_Y_WORDS],
        };
        for (n, word) in map.columns.iter_mut().enumerate() {
            *word = registers.read(roi_x(n))?;
        }
        for (n, word) in map.rows.iter_mut().enumerate() {
            *word = registers.read(roi_y(n))?;
        }
        Ok(map)
    }

    /// In words: `all`, a rectangle, or how many columns and rows are live.
    #[must_use]
    pub fn describe(&self) -> String {
        if *self == Self::ALL {
            return "all".to_owned();
        }
        match (span(&self.columns), span(&self.rows)) {
            (Some((x, width)), Some((y, height))) => describe(Roi {
                x,
                y,
                width,
                height,
            }),
            _ => format!(
                "{} columns and {} rows, not a rectangle",
                count(&self.columns),
                count(&self.rows)
            ),
        }
    }
}

fn describe(roi: Roi) -> String {
    format!("{} x {} at ({}, {})", roi.width, roi.height, roi.x, roi.y)
}

/// A map whose bits `from..from + size` are set.
fn bits<const N: usize>(from: u16, size: u16) -> [u32; N] {
    let mut words = [0; N];
    for k in usize::from(from)..usize::from(from) + usize::from(size) {
        words[k / 32] |= 1 << (k % 32);
    }
    words
}

fn count(words: &[u32]) -> u32 {
    words.iter().map(|w| w.count_ones()).sum()
}

/// First bit and number of bits, when the set bits are one run.
fn span<const N: usize>(words: &[u32; N]) -> Option<(u16, u16)> {
    let first = (0..32 * N).find(|k| words[k / 32] >> (k % 32) & 1 == 1)? as u16;
    let size = count(words) as u16;
    (bits(first, size) == *words).then_some((first, size))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_map_is_its_rectangle(x in 0..640_u16, y in 0..480_u16, w in 1..=640_u16, h in 1..=480_u16) {
            let roi = Roi { x, y, width: w.min(640 - x), height: h.min(480 - y) };
            let map = Map::of(Some(roi)).unwrap();
            for column in 0..640_u16 {
                let live = map.columns[usize::from(column / 32)] >> (column % 32) & 1 == 1;
                prop_assert_eq!(live, (x..x + roi.width).contains(&column));
            }
            for row in 0..480_u16 {
                let live = map.rows[usize::from(row / 32)] >> (row % 32) & 1 == 1;
                prop_assert_eq!(live, (y..y + roi.height).contains(&row));
            }
            let expected = if map == Map::ALL { "all".to_owned() } else { describe(roi) };
            prop_assert_eq!(map.describe(), expected);
        }
    }

    #[test]
    fn other_shapes_are_described_as_such() {
        let mut map = Map::ALL;
        map.columns[3] = 0;
        assert_eq!(map.describe(), "608 columns and 480 rows, not a rectangle");
    }

    #[test]
    fn regions_outside_are_rejected() {
        for (x, width) in [(0, 0), (639, 2), (640, 1), (1, u16::MAX)] {
            let roi = Roi {
                x,
                y: 0,
                width,
                height: 1,
            };
            let error = Map::of(Some(roi)).unwrap_err();
            assert!(matches!(error, Evk1Error::Refused { .. }), "{error}");
        }
    }
}
