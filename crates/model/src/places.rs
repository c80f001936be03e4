//! Places: presses at one planned position have one location, however often a plan lists it.

use std::collections::BTreeMap;

use crate::frame::Point2;
use crate::press::{PlannedPress, PressRole};

/// Largest distance between planned positions of one place, mm: far below the size of a tip, and above rounding in tables.
pub const SAME_PLACE_MM: f64 = 0.05;

/// Distinct places, numbered in the order in which they were added.
#[derive(Debug, Clone, Default)]
pub struct Places {
    at: Vec<Point2>,
    /// Numbers of the places in a square of [`SAME_PLACE_MM`].
    squares: BTreeMap<[i64; 2], Vec<u32>>,
}

impl Places {
    /// The places.
    #[must_use]
    pub fn all(&self) -> &[Point2] {
        &self.at
    }

    /// Number of the first place within [`SAME_PLACE_MM`] of `at`; `None` without one.
    #[must_use]
    pub fn find(&self, at: Point2) -> Option<u32> {
        let [x, y] = square(at);
        let near = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (dx, dy)));
        let near = near.filter_map(|(dx, dy)| {
            let square = [x.saturating_add(dx), y.saturating_add(dy)];
            self.squares.get(&square)
        });
        near.flatten()
            .copied()
            .filter(|place| self.at[*place as usize].distance_mm(at) <= SAME_PLACE_MM)
            .min()
    }

    /// Number of the place of `at`, which is added if it is new.
    pub fn add(&mut self, at: Point2) -> u32 {
        if let Some(known) = self.find(at) {
            return known;
        }
        let new = self.at.len() as u32;
        self.squares.entry(square(at)).or_default().push(new);
        self.at.push(at);
        new
    }
}

fn square(at: Point2) -> [i64; 2] {
    [at.x_mm, at.y_mm].map(|mm| (mm / SAME_PLACE_MM).floor() as i64)
}

/// Gives all presses at one place the location of the first of them. Statistics treat locations as independent, but a place that is
/// pressed again says the same again. Sync presses keep theirs.
pub fn merge_places(presses: &mut [PlannedPress]) {
    let (mut places, mut locations) = (Places::default(), Vec::new());
    for press in presses.iter_mut().filter(|p| p.role != PressRole::Sync) {
        let place = places.add(press.at) as usize;
        match locations.get(place) {
            Some(location) => press.location = *location,
            None => locations.push(press.location),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::id::{LocationId, PressId, RepetitionId};

    fn merged(places: &[[f64; 2]]) -> Vec<u32> {
        let press = |(i, at): (u32, &[f64; 2])| PlannedPress {
            id: PressId::from_index(i),
            role: PressRole::Score,
            repetition: RepetitionId::default(),
            location: LocationId::from_index(i),
            at: Point2::new(at[0], at[1]),
            depth_mm: 1.0,
        };
        let mut presses: Vec<_> = (0..).zip(places).map(press).collect();
        merge_places(&mut presses);
        presses.iter().map(|p| p.location.index()).collect()
    }

    #[test]
    fn a_place_that_is_listed_again_is_the_first_location() {
        let listed = [[1.0, 2.0], [5.0, 2.0], [1.0, 2.0], [-3.0, 0.0], [5.0, 2.0]];
        assert_eq!(merged(&listed), [0, 1, 0, 3, 1]);
        // Also across the cells of the search, and with rounded positions.
        let rounded = [[0.0, 0.0], [-0.01, 0.02], [0.04, -0.01], [0.06, 0.0]];
        assert_eq!(merged(&rounded), [0, 0, 0, 3]);
        // Neighbours of a fine grid stay apart, and what is no position equals nothing.
        let fine: Vec<[f64; 2]> = (0..50).map(|i| [0.1 * f64::from(i), 0.0]).collect();
        assert_eq!(merged(&fine), (0..50).collect::<Vec<u32>>());
        assert_eq!(
            merged(&[[f64::NAN, 0.0], [f64::NAN, 0.0], [1e300, 0.0]]),
            [0, 1, 2]
        );
    }

    #[test]
    fn sync_presses_keep_their_location() {
        let sync = PlannedPress {
            id: PressId::from_index(0),
            role: PressRole::Sync,
            repetition: RepetitionId::default(),
            location: LocationId::from_index(0),
            at: Point2::new(1.0, 2.0),
            depth_mm: 1.0,
        };
        let scored = PlannedPress {
            role: PressRole::Score,
            location: LocationId::from_index(7),
            ..sync
        };
        let mut presses = [sync, scored];
        merge_places(&mut presses);
        assert_eq!(presses, [sync, scored]);
    }
}
