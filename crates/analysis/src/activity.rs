//! Events per pixel over a whole recording, in cells of a few pixels.

use skinrig_model::{CameraId, CdEvent, SENSOR_HEIGHT, SENSOR_WIDTH};

use crate::result::Activity;

/// Side of a cell, px; divides both sides of the sensor.
const CELL_PX: u16 = 2;
const WIDTH: u16 = SENSOR_WIDTH / CELL_PX;
const HEIGHT: u16 = SENSOR_HEIGHT / CELL_PX;

/// The counters, their lowest bytes apart: few bytes are touched by many events, so that they stay in the processor's caches.
pub struct ActivityGrid {
    low: Vec<u8>,
    /// How often each has gone round, and stopped at the most that can be told.
    rounds: Vec<u32>,
}

impl ActivityGrid {
    pub fn new() -> Self {
        let cells = usize::from(WIDTH) * usize::from(HEIGHT);
        Self {
            low: vec![0; cells],
            rounds: vec![0; cells],
        }
    }

    /// Counts an event that lies on the sensor.
    pub fn add(&mut self, event: &CdEvent) {
        let cell =
            usize::from(event.y / CELL_PX) * usize::from(WIDTH) + usize::from(event.x / CELL_PX);
        if let Some(low) = self.low.get_mut(cell) {
            *low = low.wrapping_add(1);
            if *low == 0 {
                self.rounds[cell] = self.rounds[cell].saturating_add(1);
            }
        }
    }

    pub fn result(&self, camera: CameraId) -> Activity {
        let counts = self.low.iter().zip(&self.rounds);
        Activity {
            camera,
            cell_px: CELL_PX,
            width: WIDTH,
            height: HEIGHT,
            counts: counts
                .map(|(low, rounds)| u64::from(*rounds) << u8::BITS | u64::from(*low))
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use skinrig_model::Polarity;

    use super::*;

    #[test]
    fn counts_go_on_beyond_a_byte() {
        let mut grid = ActivityGrid::new();
        let mut add = |x, y, n| {
            let event = CdEvent {
                t_us: 0,
                x,
                y,
                polarity: Polarity::On,
            };
            (0..n).for_each(|_| grid.add(&event));
        };
        add(639, 479, 255);
        add(2, 0, 256);
        add(3, 1, 70_000);
        let counts = grid.result(CameraId::One).counts;
        assert_eq!((counts[1], *counts.last().unwrap()), (70_256, 255));
        assert_eq!(counts.iter().sum::<u64>(), 70_511);
    }
}
