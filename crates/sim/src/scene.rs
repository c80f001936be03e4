//! Interface between the skin world and the pixel models of the cameras.
//!
//! The world moves the tip; a [`PixelModel`] converts the tip's path into the events of one camera. Both use *world time*: nanoseconds of
//! the rig's host clock. The camera's own clock is applied later.

use std::ops::Range;

use skinrig_model::{CameraId, CameraModel, Point3, Polarity, SENSOR_HEIGHT, Skin, SkinOutline};

use crate::contacts::Contacts;
use crate::random::{Purpose, derive_seed};

/// A tip position. Samples lie on a grid of [`GRID_NS`]; the tip moves linearly between them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TipSample {
    /// World time, ns.
    pub t_ns: i64,
    /// True position of the tip's flat end (without measurement noise), skin frame, mm. Below the surface if `z_mm < 0`.
    pub position: Point3<Skin>,
}

/// Interval of tip samples, ns: the robot's 1 kHz.
pub const GRID_NS: i64 = 1_000_000;

/// An event of one pixel in world time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PixelEvent {
    /// World time, ns.
    pub t_ns: i64,
    /// Column, 0..640.
    pub x: u16,
    /// Row, 0..480.
    pub y: u16,
    /// Sign of the brightness change.
    pub polarity: Polarity,
}

/// The pixels of one camera.
pub trait PixelModel: Send {
    /// Advances to the last of `tips` (in strictly increasing time order, on the grid) and appends the events from the end of the previous
    /// call (at the first call: from the first of `tips`) up to but excluding `tips.last().t_ns`, sorted by time.
    ///
    /// Equal seeds and tips give equal events on every machine, however the tips are divided into calls.
    fn advance(&mut self, tips: &[TipSample], out: &mut Vec<PixelEvent>);
}

/// Input of a pixel model: its camera and the skin.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneConfig {
    /// Seed of all random numbers of this camera's pixels.
    pub seed: u64,
    /// Seed of what both cameras see: the skin, its light, the presses.
    pub skin_seed: u64,
    /// Number of earlier starts of the camera. Each start has its own noise; pixel properties, such as hot pixels, stay.
    pub start: u64,
    /// The skin.
    pub outline: SkinOutline,
    /// The camera.
    pub camera_id: CameraId,
    /// The camera's true geometry, which a calibration estimates.
    pub camera: CameraModel,
    /// Rows that see the skin's edge from inside, inclusive (public code: camera 1 185..=360, camera 2 200..=355). Other rows see the mould.
    pub skin_rows: (u16, u16),
    /// Side length of the tip's square end, mm. The paper states "cubic tip" without a size: configurable.
    pub tip_side_mm: f64,
    /// Thickness of the skin, mm (paper: 4).
    pub skin_thickness_mm: f64,
    /// Contacts so far; shared by models built from clones.
    pub contacts: Contacts,
}

impl SceneConfig {
    /// Rows of the sensor that see the skin.
    #[must_use]
    pub(crate) fn rows(&self) -> Range<usize> {
        let first = usize::from(self.skin_rows.0);
        let end = (usize::from(self.skin_rows.1) + 1).min(usize::from(SENSOR_HEIGHT));
        first..end.max(first)
    }

    /// Seed of values drawn again at every start.
    #[must_use]
    pub(crate) const fn seed_of_start(&self) -> u64 {
        match self.start {
            0 => self.seed,
            n => derive_seed(self.seed, Purpose::Pixels, 1_000 + n),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;
    use crate::SimConfig;
    use crate::geometric::GeometricModel;
    use crate::optical::OpticalModel;
    use skinrig_model::SimLevel;

    /// The events of a press, geometric and optical.
    fn press(start: u64, lit: bool) -> [Vec<PixelEvent>; 2] {
        let config = SimConfig::new(3, SimLevel::Geometric);
        let scene = SceneConfig {
            start,
            ..config.scene(CameraId::One)
        };
        let lamps = if lit {
            config.geometric.clone()
        } else {
            config.geometric.dark()
        };
        let optical = if lit {
            OpticalModel::new(&scene)
        } else {
            OpticalModel::dark(&scene)
        };
        let models: [Box<dyn PixelModel>; 2] = [
            Box::new(GeometricModel::new(&scene, &lamps)),
            Box::new(optical),
        ];
        let tips: Vec<TipSample> = (0..=500)
            .map(|ms| TipSample {
                t_ns: ms * GRID_NS,
                position: Point3::new(5.0, 2.0, (ms as f64 / 100.0 - 2.0).abs().min(2.0) - 1.5),
            })
            .collect();
        models.map(|mut model| {
            let mut events = Vec::new();
            model.advance(&tips, &mut events);
            events
        })
    }

    fn hottest(events: &[PixelEvent]) -> Option<(u16, u16)> {
        let mut counts: HashMap<(u16, u16), u32> = HashMap::new();
        for e in events {
            *counts.entry((e.x, e.y)).or_default() += 1;
        }
        counts.into_iter().max_by_key(|(_, n)| *n).map(|(at, _)| at)
    }

    #[test]
    fn in_the_dark_presses_are_invisible_and_hot_pixels_stay() {
        let (lit, dark) = (press(0, true), press(0, false));
        for (lit, dark) in lit.iter().zip(&dark) {
            assert!(5 * dark.len() < lit.len(), "{} {}", dark.len(), lit.len());
            assert!(dark.len() > 100);
            assert_eq!(hottest(dark), hottest(lit));
        }
    }

    #[test]
    fn every_start_has_new_noise_and_the_same_pixels() {
        for (first, second) in press(0, false).iter().zip(&press(1, false)) {
            assert_ne!(first, second);
            assert_eq!(hottest(first), hottest(second));
        }
    }
}
