//! Pixels of one camera in their refractory time.

use skinrig_model::{SENSOR_HEIGHT, SENSOR_WIDTH};

use crate::random::{Purpose, Stream};
use crate::scene::SceneConfig;

use super::config::OpticalConfig;

const WIDTH: usize = SENSOR_WIDTH as usize;

/// Pixels that emitted an event a short time ago. Few at a time; noise may meet any of them.
#[derive(Debug, Clone)]
pub(super) struct Refractory {
    /// (column, row, end of the refractory time). Each pixel occurs once.
    pub(super) pixels: Vec<(u16, u16, i64)>,
    /// One bit per pixel of the sensor: whether it is in `pixels`. Small enough to stay in the processor's cache.
    members: Vec<u64>,
}

impl Refractory {
    pub(super) fn new() -> Self {
        let sensor = WIDTH * usize::from(SENSOR_HEIGHT);
        Self {
            pixels: Vec::new(),
            members: vec![0; sensor.div_ceil(64)],
        }
    }

    fn bit(x: u16, y: u16) -> (usize, u64) {
        let pixel = usize::from(y) * WIDTH + usize::from(x);
        (pixel / 64, 1 << (pixel % 64))
    }

    /// The pixel's refractory time ends at `end_ns`.
    pub(super) fn set(&mut self, x: u16, y: u16, end_ns: i64) {
        if let Some(k) = self.position(x, y) {
            self.pixels[k].2 = end_ns;
            return;
        }
        let (word, mask) = Self::bit(x, y);
        self.members[word] |= mask;
        self.pixels.push((x, y, end_ns));
    }

    /// Where the pixel is in the list.
    pub(super) fn position(&self, x: u16, y: u16) -> Option<usize> {
        let (word, mask) = Self::bit(x, y);
        let same = |p: &(u16, u16, i64)| (p.0, p.1) == (x, y);
        (self.members[word] & mask != 0)
            .then(|| self.pixels.iter().position(same))
            .flatten()
    }

    pub(super) fn remove(&mut self, k: usize) {
        let (x, y, _) = self.pixels.swap_remove(k);
        let (word, mask) = Self::bit(x, y);
        self.members[word] &= !mask;
    }
}

/// Length of the refractory time, µs: one for all pixels, or one each.
#[derive(Debug, Clone)]
pub(super) enum RefractoryTimes {
    Equal(i64),
    Each(Vec<u32>),
}

impl RefractoryTimes {
    pub(super) fn new(scene: &SceneConfig, config: &OpticalConfig) -> Self {
        let Some(part) = config.parts.uneven_pixels else {
            return Self::Equal(i64::from(config.refractory_us));
        };
        let mut random = Stream::new(scene.seed, Purpose::Pixels, 4);
        let mut one = || part.refractory_least_us + part.refractory_mean_us * random.exponential();
        let sensor = WIDTH * usize::from(SENSOR_HEIGHT);
        Self::Each((0..sensor).map(|_| one().max(1.0) as u32).collect())
    }

    pub(super) fn of(&self, x: u16, y: u16) -> i64 {
        match self {
            Self::Equal(us) => *us,
            Self::Each(all) => i64::from(all[usize::from(y) * WIDTH + usize::from(x)]),
        }
    }
}
