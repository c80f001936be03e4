//! Events per pixel over a whole recording, in cells of a few pixels.

use skinrig_model::{CameraId, CdEvent, SENSOR_HEIGHT, SENSOR_WIDTH};

use crate::counters::Counters;
use crate::result::Activity;

/// Side of a cell, px; divides both sides of the sensor.
const CELL_PX: u16 = 2;
const WIDTH: u16 = SENSOR_WIDTH / CELL_PX;
const HEIGHT: u16 = SENSOR_HEIGHT / CELL_PX;

/// One counter per cell.
pub(crate) struct ActivityGrid(Counters);

impl ActivityGrid {
    pub(crate) fn new() -> Self {
        Self(Counters::new(usize::from(WIDTH) * usize::from(HEIGHT)))
    }

    /// Counts an event on the sensor.
    pub(crate) fn add(&mut self, event: &CdEvent) {
        let cell =
            usize::from(event.y / CELL_PX) * usize::from(WIDTH) + usize::from(event.x / CELL_PX);
        self.0.add(cell);
    }

    pub(crate) fn result(&self, camera: CameraId) -> Activity {
        Activity {
            camera,
            cell_px: CELL_PX,
            width: WIDTH,
            height: HEIGHT,
            counts: self.0.iter().collect(),
        }
    }
}
