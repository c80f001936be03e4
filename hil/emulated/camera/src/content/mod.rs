//! Content of a camera's pixel events.

mod dense;
mod recorded;
mod scene;

pub use skinrig_sim::scene::PixelEvent;

use crate::config::Content;
use crate::error::BusError;
use crate::random::Splitmix;
use crate::world::World;
use dense::DenseContent;
use recorded::RecordedEvents;
use scene::Scene;

/// Pixel events of one camera on the monotonic clock.
pub(crate) enum Source {
    Silence,
    Noise {
        mean_ns: f64,
        random: Splitmix,
        next_ns: f64,
    },
    Dense(DenseContent),
    RecordedEvents(RecordedEvents),
    Scene(Box<Scene>),
}

impl Source {
    pub(crate) fn new(content: &Content) -> Result<Self, BusError> {
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
                Self::Dense(DenseContent::new(positive("a rate in Mev/s", *mev_per_s)?))
            }
            Content::File { path } => Self::RecordedEvents(RecordedEvents::open(path)?),
            Content::Scene(scene) => Self::Scene(Box::new(Scene::new(scene)?)),
        })
    }

    /// Handles a start of the time base.
    pub(crate) fn start(&mut self, world: &World, from_ns: i64) {
        match self {
            Self::Silence | Self::Dense(_) => {}
            Self::Noise { next_ns, .. } => *next_ns = from_ns as f64,
            Self::RecordedEvents(recorded) => recorded.start(from_ns),
            Self::Scene(scene) => scene.start(world, from_ns),
        }
    }

    /// The source, if it provides encoded words instead of events.
    pub(crate) fn dense(&mut self) -> Option<&mut DenseContent> {
        match self {
            Self::Dense(dense) => Some(dense),
            _ => None,
        }
    }

    /// Appends the events of `from_ns..until_ns` in order of time. Ranges must be consecutive.
    pub(crate) fn events(
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
            Self::RecordedEvents(recorded) => recorded.events(until_ns, out),
            Self::Scene(scene) => scene.events(world, until_ns, out),
        }
    }
}
