//! Pixel regions: blocks of pixels of one polarity, over which events are counted.

use skinrig_model::{CdEvent, Polarity, SENSOR_HEIGHT, SENSOR_WIDTH};

/// Width of a region, px.
const SIDE_X: u16 = 16;
/// Height of a region, px.
const SIDE_Y: u16 = 24;
/// Regions along a row of the sensor.
pub(crate) const COLUMNS: usize = (SENSOR_WIDTH / SIDE_X) as usize;
/// Regions along a column of the sensor.
pub(crate) const ROWS: usize = (SENSOR_HEIGHT / SIDE_Y) as usize;
/// Regions of a camera, both polarities.
pub(crate) const REGIONS: usize = 2 * COLUMNS * ROWS;

/// Region of an event; `None` off the sensor. The lowest bit is 1 for ON events.
pub(crate) fn region(event: &CdEvent) -> Option<usize> {
    let on = usize::from(event.polarity == Polarity::On);
    block(event.x, event.y).map(|block| 2 * block + on)
}

/// Block of a pixel; `None` off the sensor.
pub(crate) fn block(x: u16, y: u16) -> Option<usize> {
    let (column, row) = (usize::from(x / SIDE_X), usize::from(y / SIDE_Y));
    (column < COLUMNS && row < ROWS).then_some(row * COLUMNS + column)
}

/// The region of the other polarity.
pub(crate) const fn opposite(region: usize) -> usize {
    region ^ 1
}

/// Column and row of a region.
pub(crate) const fn place(region: usize) -> (usize, usize) {
    let block = region / 2;
    (block % COLUMNS, block / COLUMNS)
}

/// The region `by` columns to the right; `None` beyond the sensor.
pub(crate) fn shifted(region: usize, by: isize) -> Option<usize> {
    let (column, _) = place(region);
    let to = column.checked_add_signed(by).filter(|c| *c < COLUMNS)?;
    Some(region - 2 * column + 2 * to)
}

/// The region `by` rows below; `None` beyond the sensor.
pub(crate) fn below(region: usize, by: isize) -> Option<usize> {
    let (_, row) = place(region);
    let to = row.checked_add_signed(by).filter(|r| *r < ROWS)?;
    Some(region + 2 * COLUMNS * to - 2 * COLUMNS * row)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_have_the_same_polarity_and_end_at_the_edges() {
        let at = |x, y, on| {
            let polarity = Polarity::from_bit(on);
            region(&CdEvent {
                t_us: 0,
                x,
                y,
                polarity,
            })
        };
        let middle = at(100, 100, true).unwrap();
        assert_eq!(shifted(middle, 1), at(116, 100, true));
        assert_eq!(below(middle, -1), at(100, 76, true));
        assert_eq!(opposite(middle), at(100, 100, false).unwrap());
        assert_eq!(shifted(at(639, 0, false).unwrap(), 1), None);
        assert_eq!(below(at(5, 3, false).unwrap(), -1), None);
        assert_eq!(at(640, 0, true), None);
        assert_eq!(at(639, 479, true), Some(REGIONS - 1));
    }
}
