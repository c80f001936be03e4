//! From what both cameras saw to touches.

use skinrig_model::{Point2, SkinOutline};

use super::mixture::{Component, Mixture, Start, Widths, column_nats, divide};
use super::profile::{Example, Profile};
use super::sight::TouchSight;
use super::timing::Ends;
use crate::locator::{CameraFeatures, Features, FittedLocator};

/// Log odds at which times decide.
const DECIDED_NATS: f64 = 6.0;
/// A crossing this far outside the outline is no touch, mm.
const MARGIN_MM: f64 = 3.0;
/// Pairings whose touches are this close to one another are the same, mm.
const SAME_MM: f64 = 1.0;
/// Permitted deviation from the expected width, in standard deviations: overlapping touches need the prior more than it errs.
const WIDTH_DEVIATIONS: f64 = 0.3;
/// A press has two touches if the second one explains more than in this share of the calibration presses, times a margin.
const SINGLE_SHARE: f64 = 0.95;
const SINGLE_MARGIN: f64 = 1.25;
/// Rounds in which positions tell widths and widths positions.
const ROUNDS: usize = 6;

/// A touch of a press.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// Position, mm.
    pub at: Point2,
    /// Mean column of its events in each camera, px.
    pub columns: [f64; 2],
}

/// Why a press with two touches has no positions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ambiguity {
    /// Both pairings lie on the skin, and the times of the touches do not tell them apart.
    Times {
        /// Log odds of the likelier pairing by time.
        nats: f64,
    },
    /// No pairing lies on the skin.
    NoPairing,
}

/// Result of a separation.
#[derive(Debug, Clone, PartialEq)]
pub enum Separation {
    /// One touch.
    Single,
    /// Two touches.
    Pair {
        /// The touches.
        touches: [Touch; 2],
        /// Log odds of the pairing by time; `None` if geometry alone decides.
        nats: Option<f64>,
    },
    /// Two touches that cannot be paired.
    Ambiguous(Ambiguity),
}

/// A calibration press for learning.
#[derive(Debug, Clone, Copy)]
pub struct SingleTouch<'a> {
    /// Measured position.
    pub at: Point2,
    /// What each camera saw.
    pub sights: [&'a TouchSight; 2],
}

/// Separates presses into touches.
#[derive(Debug, Clone, PartialEq)]
pub struct Separator {
    profiles: [Profile; 2],
    /// Nats per event in each camera beyond which a second touch is real.
    singles: [f64; 2],
}

impl Separator {
    /// Learns from single touches at known places; `None` if they are too few.
    #[must_use]
    pub fn learn(singles: &[SingleTouch<'_>]) -> Option<Self> {
        let profile = |camera: usize| {
            let examples: Vec<Example<'_>> = singles
                .iter()
                .map(|s| Example {
                    at: [s.at.x_mm, s.at.y_mm],
                    sight: s.sights[camera],
                })
                .collect();
            Profile::learn(&examples)
        };
        let profiles = [profile(0)?, profile(1)?];
        let singles = [0, 1].map(|k| {
            let gains = singles.iter().map(|s| gain(&profiles[k], s.sights[k]));
            let mut gains: Vec<f64> = gains.collect();
            gains.sort_unstable_by(f64::total_cmp);
            let at = (SINGLE_SHARE * gains.len() as f64) as usize;
            SINGLE_MARGIN * gains.get(at).copied().unwrap_or(f64::INFINITY)
        });
        Some(Self { profiles, singles })
    }

    /// True if a second touch explains more than in any single touch.
    fn has_two(&self, sights: [&TouchSight; 2]) -> bool {
        (0..2).any(|k| gain(&self.profiles[k], sights[k]) > self.singles[k])
    }

    /// Separates a press.
    #[must_use]
    pub fn separate(
        &self,
        locator: &FittedLocator,
        outline: &SkinOutline,
        sights: [&TouchSight; 2],
    ) -> Separation {
        if !self.has_two(sights) {
            return Separation::Single;
        }
        let mut mixtures = [0, 1].map(|k| {
            let profile = &self.profiles[k];
            divide(profile, sights[k], &[any(profile); 2], None)
        });
        let mut pairing = self.pair(locator, outline, sights, &mixtures);
        for _ in 0..ROUNDS {
            let Some(places) = pairing.places else { break };
            for k in 0..2 {
                let order = if pairing.swapped && k == 1 {
                    [1, 0]
                } else {
                    [0, 1]
                };
                let widths = order.map(|touch| self.limits(k, places[touch]));
                let means: Vec<f64> = mixtures[k].components.iter().map(|c| c.mean).collect();
                let start = Start {
                    means: &means,
                    ends_ms: pairing.ends_ms.map(|ends| order.map(|touch| ends[touch])),
                };
                mixtures[k] = divide(&self.profiles[k], sights[k], &widths, Some(start));
            }
            pairing = self.pair(locator, outline, sights, &mixtures);
        }
        pairing.separation
    }

    fn limits(&self, camera: usize, at: Point2) -> Widths {
        let profile = &self.profiles[camera];
        let width = profile.width_at([at.x_mm, at.y_mm]);
        let factor = libm::exp(WIDTH_DEVIATIONS * profile.scatter);
        [width / factor, width * factor]
    }

    fn pair(
        &self,
        locator: &FittedLocator,
        outline: &SkinOutline,
        sights: [&TouchSight; 2],
        mixtures: &[Mixture; 2],
    ) -> Pairing {
        let touch = |one: &Component, two: &Component| {
            let cameras = [features(one), features(two)];
            let found = locator.locate(&Features::new(cameras)?)?;
            let at = Point2::new(found.at[0], found.at[1]);
            let on_skin = outline.clearance_mm(at) > -MARGIN_MM;
            let columns = [one.centroid, two.centroid];
            on_skin.then_some(Touch { at, columns })
        };
        let [one, two] = mixtures;
        let ([a, b], [c, d]) = (one.components.as_slice(), two.components.as_slice()) else {
            return Pairing::none(Separation::Single);
        };
        let straight = touch(a, c).zip(touch(b, d));
        let crossed = touch(a, d).zip(touch(b, c));
        let ends = self.ends(sights, mixtures);
        let nats = ends.as_ref().map_or(0.0, |[one, two]| Ends::odds(one, two));
        let mut pairing = match (straight, crossed) {
            (None, None) => Pairing::none(Separation::Ambiguous(Ambiguity::NoPairing)),
            (Some(pair), None) => Pairing::of(pair, false, None),
            (None, Some(pair)) => Pairing::of(pair, true, None),
            (Some(straight), Some(crossed)) => {
                let swapped = nats < 0.0;
                let (pair, other) = if swapped {
                    (crossed, straight)
                } else {
                    (straight, crossed)
                };
                let off = pair.0.at.distance_mm(other.0.at);
                let same = off.max(pair.1.at.distance_mm(other.1.at)) < SAME_MM;
                let decided = nats.abs() >= DECIDED_NATS;
                let mut pairing = Pairing::of(pair, swapped, decided.then_some(nats.abs()));
                if !decided && !same {
                    let nats = nats.abs();
                    pairing.separation = Separation::Ambiguous(Ambiguity::Times { nats });
                }
                pairing
            }
        };
        pairing.ends_ms = ends.and_then(|[one, two]| Ends::together(&one, &two, pairing.swapped));
        pairing
    }

    fn ends(&self, sights: [&TouchSight; 2], mixtures: &[Mixture; 2]) -> Option<[Ends; 2]> {
        let ends = |k: usize| Ends::new(&self.profiles[k], sights[k], &mixtures[k]);
        Some([ends(0)?, ends(1)?])
    }
}

/// Widths of any touch.
fn any(profile: &Profile) -> Widths {
    [0.4 * profile.typical, 2.5 * profile.typical]
}

/// Nats per event that a second touch adds.
fn gain(profile: &Profile, sight: &TouchSight) -> f64 {
    let nats = |touches: usize| column_nats(profile, sight, &vec![any(profile); touches]);
    let gain = (nats(2) - nats(1)) / sight.events.len().max(1) as f64;
    if gain.is_nan() { 0.0 } else { gain.max(0.0) }
}

/// Spreads are left out: a locator learns those of whole clusters.
fn features(component: &Component) -> CameraFeatures {
    CameraFeatures {
        column: Some(component.centroid),
        spread: None,
        cluster_events: component.events.round() as u32,
    }
}

struct Pairing {
    separation: Separation,
    /// Positions, in the order of camera 1's touches.
    places: Option<[Point2; 2]>,
    swapped: bool,
    /// Ends of the touches, in the same order, ms.
    ends_ms: Option<[f64; 2]>,
}

impl Pairing {
    const fn none(separation: Separation) -> Self {
        Self {
            separation,
            places: None,
            swapped: false,
            ends_ms: None,
        }
    }

    fn of((one, two): (Touch, Touch), swapped: bool, nats: Option<f64>) -> Self {
        Self {
            places: Some([one.at, two.at]),
            separation: Separation::Pair {
                touches: [one, two],
                nats,
            },
            swapped,
            ends_ms: None,
        }
    }
}
