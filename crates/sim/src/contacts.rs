//! Random properties of contacts, determined by location and number of earlier contacts there.
//!
//! With one counter over all contacts, a resumed run or a retake would get other contacts than the same run without interruption. With a
//! counter per location, events elsewhere have no influence.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use skinrig_model::Point2;

use crate::random::{Purpose, Stream, derive_seed};

/// Size of the grid cells that distinguish locations, mm.
const CELL_MM: f64 = 1.0;
/// Offset of the cell borders as a share of [`CELL_MM`] below whole multiples: far from the round numbers at which protocols press, so that
/// the robot's wander of some 0.01 mm does not change the cell.
const OFFSET: f64 = 0.55;

/// A grid cell of the skin.
type Cell = (i64, i64);

/// Number of contacts per cell so far. Clones share it, across starts of a camera.
#[derive(Debug, Clone, Default)]
pub struct Contacts(Arc<Mutex<BTreeMap<Cell, u32>>>);

/// Identity of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Contact {
    cell: Cell,
    /// Earlier contacts in the cell.
    before: u32,
    /// Earlier contacts in total.
    pub number: u32,
}

impl Contacts {
    /// State after contacts at these points, in any order.
    #[must_use]
    pub fn after(places: &[Point2]) -> Self {
        let contacts = Self::default();
        for place in places {
            contacts.next(*place);
        }
        contacts
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<Cell, u32>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Registers a contact at `place`.
    pub(crate) fn next(&self, place: Point2) -> Contact {
        let cell = (cell(place.x_mm), cell(place.y_mm));
        let mut contacts = self.lock();
        let number = contacts.values().sum();
        let count = contacts.entry(cell).or_default();
        let before = *count;
        *count += 1;
        Contact {
            cell,
            before,
            number,
        }
    }
}

impl PartialEq for Contacts {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0) || *self.lock() == *other.lock()
    }
}

impl Contact {
    /// Random numbers of this contact, for a camera whose pixels have this seed.
    pub(crate) fn random(self, seed: u64) -> Stream {
        let (x, y) = self.cell;
        let seed = [x as u64, y as u64].into_iter().fold(seed, |seed, part| {
            derive_seed(seed, Purpose::Contacts, part)
        });
        Stream::new(seed, Purpose::Contacts, u64::from(self.before))
    }
}

fn cell(mm: f64) -> i64 {
    (mm / CELL_MM + OFFSET).floor() as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn draws(contacts: &Contacts, places: &[Point2]) -> Vec<u64> {
        let draw = |place: &Point2| contacts.next(*place).random(7).bits();
        places.iter().map(draw).collect()
    }

    fn grid() -> Vec<Point2> {
        let place = |k: i32| Point2::new(0.5 * f64::from(k % 10), 0.25 * f64::from(k / 10));
        (0..100).map(place).collect()
    }

    #[test]
    fn contacts_at_other_locations_and_their_order_have_no_effect() {
        let (grid, mut turned) = (grid(), grid());
        turned.reverse();
        let mut back = draws(&Contacts::default(), &turned);
        back.reverse();
        let alone = |place: &Point2| draws(&Contacts::default(), &[*place])[0];
        for (place, drawn) in grid.iter().zip(draws(&Contacts::default(), &grid)) {
            // Places nearer to one another than a square share one, and differ by their number.
            if alone(place) != drawn {
                assert!(back.contains(&drawn));
            }
        }
        let places = [grid[0], grid[40], grid[0]];
        let [first, _, repeated_press] = draws(&Contacts::default(), &places)[..] else {
            panic!("three draws");
        };
        assert_ne!(
            first, repeated_press,
            "the same place again is another contact"
        );
        // A run in two parts meets the same contacts as in one part.
        let whole = draws(&Contacts::default(), &grid);
        let rest = draws(&Contacts::after(&grid[..30]), &grid[30..]);
        assert_eq!(rest, whole[30..]);
    }

    #[test]
    fn a_robot_that_wanders_presses_the_same_place() {
        for place in grid() {
            for by in [-0.04, 0.04] {
                let near = Point2::new(place.x_mm + by, place.y_mm - by);
                let draw = |place| draws(&Contacts::default(), &[place]);
                assert_eq!(draw(place), draw(near), "{place:?}");
            }
        }
    }
}
