//! Map of the locations from above, as characters.

use skinrig_model::PressRole;
use skinrig_text::{LongWords, wrap};

use super::frame::{Frame, LocationStatus};

/// Maximum size of the map, columns and rows.
const MAX_CELLS: [usize; 2] = [36, 18];
/// Columns beside the cells.
const MARGIN: usize = 2;
/// Meaning of the characters.
const LEGEND: &str = ". to do, o begun, # done, x not all valid, @ now";

/// Map of the locations from above, y up: one character each, or several locations per character if there are too many.
pub(super) fn map(frame: &Frame, columns: usize) -> Vec<String> {
    let most = [MAX_CELLS[0].min((columns - MARGIN) / 2), MAX_CELLS[1]];
    let axis = |k: usize| Axis::new(frame.places.iter().map(|p| p.at_mm[k]), most[k]);
    let (Some(x), Some(y)) = (axis(0), axis(1)) else {
        return Vec::new();
    };
    let mut cells = vec![vec![None::<LocationStatus>; x.cells]; y.cells];
    for place in &frame.places {
        let cell = &mut cells[y.cells - 1 - y.of(place.at_mm[1])][x.of(place.at_mm[0])];
        match cell {
            None => *cell = Some(place.clone()),
            Some(sum) => {
                sum.planned += place.planned;
                sum.valid += place.valid;
                sum.failed += place.failed;
            }
        }
    }
    let live = frame.live.as_ref().and_then(|live| live.press.as_ref());
    let now = live
        .filter(|press| press.role != PressRole::Sync)
        .map(|press| (y.cells - 1 - y.of(press.at_mm[1]), x.of(press.at_mm[0])));
    let row = |(i, row): (usize, &Vec<Option<LocationStatus>>)| {
        let cell = |(j, cell): (usize, &Option<LocationStatus>)| match cell {
            _ if now == Some((i, j)) => "@ ",
            None => "  ",
            Some(place) => mark(place),
        };
        let text: String = row.iter().enumerate().map(cell).collect();
        format!("  {}", text.trim_end())
    };
    let mut lines: Vec<String> = cells.iter().enumerate().map(row).collect();
    lines.extend(
        wrap(LEGEND, columns - MARGIN, LongWords::Keep)
            .iter()
            .map(|l| format!("  {l}")),
    );
    lines
}

fn mark(place: &LocationStatus) -> &'static str {
    match (place.valid, place.failed) {
        (_, 1..) => "x ",
        (0, 0) => ". ",
        (valid, 0) if valid < place.planned => "o ",
        _ => "# ",
    }
}

/// Maps coordinates along one axis to cells.
struct Axis {
    from: f64,
    span: f64,
    cells: usize,
}

impl Axis {
    fn new(values: impl Iterator<Item = f64>, most: usize) -> Option<Self> {
        let mut values: Vec<f64> = values.filter(|v| v.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        values.dedup_by(|a, b| (*a - *b).abs() < 0.01);
        let (from, to) = (*values.first()?, *values.last()?);
        Some(Self {
            from,
            span: to - from,
            cells: values.len().min(most),
        })
    }

    fn of(&self, value: f64) -> usize {
        if self.span == 0.0 {
            return 0;
        }
        let last = (self.cells - 1) as f64;
        // Only non-finite values are outside; they become 0.
        ((value - self.from) / self.span * last)
            .round()
            .clamp(0.0, last) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_place_shows_its_progress() {
        let place = |planned, valid, failed| LocationStatus {
            at_mm: [0.0; 2],
            planned,
            valid,
            failed,
        };
        let marks = [(2, 0, 0), (2, 1, 0), (2, 2, 0), (2, 1, 1)];
        let marks = marks.map(|(p, v, f)| mark(&place(p, v, f)));
        assert_eq!(marks, [". ", "o ", "# ", "x "]);
    }

    #[test]
    fn places_spread_over_the_map() {
        let axis = Axis::new([4.0, -4.0, 0.0, 4.0].into_iter(), 18).unwrap();
        assert_eq!(axis.cells, 3);
        assert_eq!([-4.0, 0.0, 4.0].map(|v| axis.of(v)), [0, 1, 2]);
        let many = Axis::new((0..100).map(f64::from), 18).unwrap();
        assert_eq!((many.cells, many.of(0.0), many.of(99.0)), (18, 0, 17));
        assert_eq!(Axis::new([1.0].into_iter(), 5).unwrap().of(1.0), 0);
        assert!(Axis::new([].into_iter(), 5).is_none());
    }
}
