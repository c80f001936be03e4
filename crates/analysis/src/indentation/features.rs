//! Owns the features of a press from which its depth is estimated. None depends on how long a phase lasts: the duration of a
//! motion at a known speed would reveal the depth.

use skinrig_model::{Point2, StereoGeometry};

use super::collector::PressPhases;
use super::phases::{IDLE, PRESS, RELEASE};

/// Features per camera: events by polarity, spreads, peaks and sums of the change, of press and release; and the distance,
/// because near dents cover more pixels.
const PER_CAMERA: usize = 15;
/// Features of a press.
pub(super) const FEATURES: usize = 2 * PER_CAMERA;
/// Millimetres that make one unit of place: the prior length scale.
const PLACE_MM: f64 = 20.0;
/// Smallest distance of a press from a camera, mm.
const NEAREST_MM: f64 = 1.0;
/// Smallest number of events that a logarithm distinguishes, and how many standard deviations of the idle events it covers.
const FAINT_EVENTS: f64 = 10.0;
const FAINT_SIGMAS: f64 = 3.0;

/// Features of a press, and where it was located.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Observation {
    /// Logarithms; see [`Scales`].
    pub features: [f64; FEATURES],
    /// Located position in units of 20 mm.
    pub place: [f64; 2],
    /// Events of press and release, both cameras.
    pub events: f64,
}

/// Idle events of a session.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scales {
    /// ON and OFF events per second, each camera.
    idle_per_s: [[f64; 2]; 2],
}

impl Scales {
    /// Medians over the presses: single idle times are short.
    pub(super) fn new(cameras: [&[PressPhases]; 2]) -> Self {
        let rate = |k: usize, polarity: usize| {
            let each = cameras[k].iter().filter(|p| p.seconds[IDLE] > 0.0);
            let mut rates: Vec<f64> = each
                .map(|p| f64::from(p.events[IDLE][polarity]) / p.seconds[IDLE])
                .collect();
            rates.sort_unstable_by(f64::total_cmp);
            rates.get(rates.len() / 2).copied().unwrap_or(0.0)
        };
        Self {
            idle_per_s: [0, 1].map(|k| [rate(k, 0), rate(k, 1)]),
        }
    }

    /// Features of a press that was located here, mm.
    pub(super) fn observe(
        &self,
        cameras: [&PressPhases; 2],
        geometry: &StereoGeometry,
        at: Point2,
    ) -> Observation {
        let mut features = [0.0; FEATURES];
        let mut events = 0.0;
        for (k, camera) in cameras.into_iter().enumerate() {
            let own = &mut features[k * PER_CAMERA..(k + 1) * PER_CAMERA];
            let from = geometry.cameras[k].position;
            let distance = libm::hypot(at.x_mm - from.x_mm, at.y_mm - from.y_mm);
            own[14] = libm::log(distance.max(NEAREST_MM));
            for (i, phase) in [PRESS, RELEASE].into_iter().enumerate() {
                for polarity in 0..2 {
                    let idle = self.idle_per_s[k][polarity] * camera.seconds[phase];
                    let added = f64::from(camera.events[phase][polarity]) - idle;
                    own[2 * i + polarity] = logarithm(added, self.idle_per_s[k][polarity]);
                    events += added.max(0.0);
                }
                let image = &camera.images[i];
                let idle: f64 = self.idle_per_s[k].iter().sum();
                let changed = image.changed as f64 - idle * camera.seconds[phase];
                own[12 + i] = logarithm(changed, idle);
                for axis in 0..2 {
                    own[4 + 2 * i + axis] = libm::log(image.spread[axis].max(1.0));
                    own[8 + 2 * i + axis] = libm::log(image.peaks[axis].max(1) as f64);
                }
            }
        }
        Observation {
            features,
            place: [at.x_mm, at.y_mm].map(|v| v / PLACE_MM),
            events: events.max(1.0),
        }
    }
}

/// Logarithm of events beyond the idle ones; flat where these hide them. Idle events of a fixed time, not of the phase.
fn logarithm(added: f64, idle_per_s: f64) -> f64 {
    libm::log(added.max(0.0) + FAINT_EVENTS + FAINT_SIGMAS * (0.1 * idle_per_s).sqrt())
}

#[cfg(test)]
mod tests {
    use super::super::image::{ImageSums, ReturnSums};
    use super::super::phases::PHASES;
    use super::*;

    fn phases(seconds: f64) -> PressPhases {
        // 1,000 idle events per second and polarity, 4,000 events of the press, whatever time it takes.
        let idle = (1_000.0 * seconds) as u32;
        PressPhases {
            row: 0,
            events: [
                [500; 2],
                [4_000 + idle; 2],
                [0; 2],
                [3_000 + idle; 2],
                [0; 2],
            ],
            seconds: [0.5, seconds, 0.3, seconds, 1.0],
            images: [ImageSums {
                changed: 5_000 + u64::from(2 * idle),
                spread: [20.0, 10.0],
                peaks: [40, 7],
            }; 2],
            rest: ReturnSums::default(),
        }
    }

    #[test]
    fn a_slower_robot_changes_no_feature() {
        let fast: [PressPhases; 3] = [phases(0.02); PHASES - 2];
        let scales = Scales::new([&fast, &fast]);
        let of = |seconds: f64| {
            let press = phases(seconds);
            scales.observe(
                [&press, &press],
                &StereoGeometry::PAPER,
                Point2::new(30.0, -20.0),
            )
        };
        let (fast, slow) = (of(0.02), of(0.5));
        for (a, b) in fast.features.iter().zip(slow.features) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
        assert_eq!(fast.place, [1.5, -1.0]);
        assert!((fast.events - 28_000.0).abs() < 1e-6);
    }
}
