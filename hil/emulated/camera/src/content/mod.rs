//! What the pixels of a camera do.

mod dense;
mod recorded;
mod scene;

use skinrig_model::{Polarity, SENSOR_HEIGHT, SENSOR_WIDTH};
pub use skinrig_sim::scene::PixelEvent;

use crate::bus::BusError;
use crate::config::Content;
use crate::world::World;
use dense::Dense;
use recorded::Recorded;
use scene::Scene;

/// Pixel events of one camera on the monotonic clock.
pub(crate) enum Source {
    Silence,
    Noise {
        mean_ns: f64,
        random: Splitmix,
        next_ns: f64,
    },
    Dense(Dense),
    Recorded(Recorded),
    Scene(Box<Scene>),
}

impl Source {
    pub fn new(content: &Content) -> Result<Self, BusError> {
        let positive = |what: &'static str, value: f64| {
            if value.is_finite() && value > 0.0 {
                Ok(value)
            } else {
                Err(BusError::Content(format!(
                    "expected {what} above 0, found {value}"
                )))
            }
        };
        Ok(match content {
            Content::Silence => Self::Silence,
            Content::Noise { events_per_s, seed } => Self::Noise {
                mean_ns: 1e9 / positive("a rate in events/s", *events_per_s)?,
                random: Splitmix(*seed),
                next_ns: f64::NEG_INFINITY,
            },
            Content::Dense { mev_per_s } => {
                Self::Dense(Dense::new(positive("a rate in Mev/s", *mev_per_s)?))
            }
            Content::File { path } => Self::Recorded(Recorded::open(path)?),
            Content::Scene(scene) => Self::Scene(Box::new(Scene::new(scene)?)),
        })
    }

    /// The time base starts.
    pub fn start(&mut self, world: &World, from_ns: i64) {
        match self {
            Self::Silence | Self::Dense(_) => {}
            Self::Noise { next_ns, .. } => *next_ns = from_ns as f64,
            Self::Recorded(recorded) => recorded.start(from_ns),
            Self::Scene(scene) => scene.start(world, from_ns),
        }
    }

    /// The source whose words need no events.
    pub fn dense(&mut self) -> Option<&mut Dense> {
        match self {
            Self::Dense(dense) => Some(dense),
            _ => None,
        }
    }

    /// Appends the events of `from_ns..until_ns` in the order of time. Spans follow one another.
    pub fn events(
        &mut self,
        world: &World,
        from_ns: i64,
        until_ns: i64,
        out: &mut Vec<PixelEvent>,
    ) {
        match self {
            Self::Silence => {}
            Self::Noise {
                mean_ns,
                random,
                next_ns,
            } => {
                while *next_ns < until_ns as f64 {
                    if *next_ns >= from_ns as f64 {
                        out.push(random.event(*next_ns as i64));
                    }
                    *next_ns += random.exponential() * *mean_ns;
                }
            }
            Self::Dense(dense) => dense.events(from_ns, until_ns, out),
            Self::Recorded(recorded) => recorded.events(until_ns, out),
            Self::Scene(scene) => scene.events(world, until_ns, out),
        }
    }
}

/// A small generator of pseudo-random numbers (Steele, Lea, Flood: Fast splittable pseudorandom number generators,
/// 2014). Good enough for noise and jitter, and the same everywhere.
pub(crate) struct Splitmix(pub u64);

impl Splitmix {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// 0..`end`; `end` is not 0.
    pub fn below(&mut self, end: u64) -> u64 {
        ((u128::from(self.next()) * u128::from(end)) >> 64) as u64
    }

    /// Exponentially distributed with mean 1.
    fn exponential(&mut self) -> f64 {
        // In (0, 1], so that the logarithm is finite.
        let unit = ((self.next() >> 11) + 1) as f64 / (1u64 << 53) as f64;
        -unit.ln()
    }

    fn event(&mut self, t_ns: i64) -> PixelEvent {
        PixelEvent {
            t_ns,
            x: self.below(SENSOR_WIDTH.into()) as u16,
            y: self.below(SENSOR_HEIGHT.into()) as u16,
            polarity: Polarity::from_bit(self.next() >> 63 == 1),
        }
    }
}
