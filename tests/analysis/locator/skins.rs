//! Planted skins as columns: a fast stand-in for recordings.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use skinrig_analysis::calibrate::{ModelChoice, choose};
use skinrig_analysis::locator::{Features, LocatorChoice, choose_locator};
use skinrig_analysis::result::{LocationOutcome, PressResult};
use skinrig_analysis::sets::CalibrationSet;
use skinrig_model::{
    AnalysisSettings, LocationId, Locator, Point2, PressId, PressRole, RepetitionId,
    StereoGeometry, Verdict,
};
use skinrig_planted::view;

/// The drawn rig: where calibrations start.
pub(crate) const DRAWN: StereoGeometry =
    StereoGeometry::paper_like([45.0, -36.0, 45.0, 40.0, 0.0, 0.0, 0.0, 0.0]);

pub(crate) struct Noise(Xoshiro256PlusPlus);

impl Noise {
    pub(crate) fn new(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed))
    }
    pub(crate) fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }
    /// Standard normal but for the farthest tails.
    pub(crate) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }
}

/// How far the events of a press spread in a camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Spreads {
    /// The cameras report none.
    Absent,
    /// The nearer the camera, the wider; relative scatter of a press with 100 cluster events, and every twentieth press three
    /// times as wide.
    Near(f64),
    /// By chance.
    Chance,
}

/// A skin with its presses.
#[derive(Debug, Clone)]
pub(crate) struct Skin {
    pub(crate) seed: u64,
    /// Presses along each side of the grid; every other one calibrates.
    pub(crate) side: u32,
    /// At most this many calibrate.
    pub(crate) calibrating: usize,
    /// Only presses in the lower left quarter calibrate.
    pub(crate) corner: bool,
    /// Amplitude of the smooth distortion of columns, px.
    pub(crate) bend_px: f64,
    /// Scatter of a column with 100 cluster events, px.
    pub(crate) noise_px: f64,
    /// Share of presses with a column far off.
    pub(crate) outliers: f64,
    /// Factor on the cluster events and its spread.
    pub(crate) weak: f64,
    /// Factor on the scatter of camera 2.
    pub(crate) blind: f64,
    pub(crate) repeats: u32,
    /// How far the events of a press spread.
    pub(crate) spreads: Spreads,
    /// Depths, mm, one repetition after another.
    pub(crate) depths: &'static [f64],
    /// Presses of another session with the same skin have other scatter.
    pub(crate) session: u64,
    /// How the skin was mounted since the session 0.
    pub(crate) remount: Remount,
}

/// Skin and cameras turn about (10, 2) mm and shift; then each camera shifts and turns.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Remount {
    pub(crate) shift_mm: [f64; 2],
    /// Counter-clockwise.
    pub(crate) turn_deg: f64,
    /// x and y, mm; clockwise turn, degrees.
    pub(crate) cameras: [[f64; 3]; 2],
}

impl Remount {
    /// A remount with normal parts of these standard deviations: of the whole in mm and degrees, of a camera.
    pub(crate) fn drawn(seed: u64, whole: f64, camera: f64) -> Self {
        let mut noise = Noise::new(0x4e_0017 ^ seed);
        let mut part = |sd: f64| sd * noise.normal();
        Self {
            shift_mm: [part(whole), part(whole)],
            turn_deg: part(whole),
            cameras: [0; 2].map(|_| [part(camera), part(camera), part(camera)]),
        }
    }

    pub(crate) fn forth(&self, at: Point2) -> Point2 {
        let (sin, cos) = libm::sincos(self.turn_deg.to_radians());
        let (x, y) = (at.x_mm - 10.0, at.y_mm - 2.0);
        let [dx, dy] = self.shift_mm;
        Point2::new(10.0 + dx + cos * x - sin * y, 2.0 + dy + sin * x + cos * y)
    }

    fn back(&self, at: Point2) -> Point2 {
        let (sin, cos) = libm::sincos(self.turn_deg.to_radians());
        let [dx, dy] = self.shift_mm;
        let (x, y) = (at.x_mm - 10.0 - dx, at.y_mm - 2.0 - dy);
        Point2::new(10.0 + cos * x + sin * y, 2.0 - sin * x + cos * y)
    }

    fn of_geometry(&self, mut geometry: StereoGeometry) -> StereoGeometry {
        for (camera, [dx, dy, turn]) in geometry.cameras.iter_mut().zip(self.cameras) {
            for point in [&mut camera.position, &mut camera.aim] {
                let moved = self.forth(*point);
                *point = Point2::new(moved.x_mm + dx, moved.y_mm + dy);
            }
            camera.skew_deg += turn;
        }
        geometry
    }
}

impl Skin {
    pub(crate) fn new(seed: u64) -> Self {
        Self {
            seed,
            side: 13,
            calibrating: usize::MAX,
            corner: false,
            bend_px: 0.0,
            noise_px: 3.0,
            outliers: 0.0,
            weak: 0.5,
            blind: 1.0,
            repeats: 1,
            spreads: Spreads::Absent,
            depths: &[2.0],
            session: 0,
            remount: Remount::default(),
        }
    }

    /// Presses of both roles.
    pub(crate) fn presses(&self) -> Vec<PressResult> {
        let mut noise = Noise::new(0x5eed ^ self.seed.wrapping_mul(0x9e37_79b9));
        let planted = [43.0, -33.5, 46.0, 38.0, -1.2, 0.9, -0.11, 0.05];
        let shifts = [2.0, 2.0, 2.0, 2.0, 1.0, 1.0, 0.04, 0.04];
        let planted = [0, 1, 2, 3, 4, 5, 6, 7].map(|i| planted[i] + shifts[i] * noise.normal());
        let geometry = StereoGeometry::paper_like(planted);
        // A few smooth waves per camera.
        let waves: Vec<[f64; 4]> = (0..8)
            .map(|_| {
                [
                    noise.normal(),
                    0.03 + 0.07 * noise.unit(),
                    std::f64::consts::TAU * noise.unit(),
                    std::f64::consts::TAU * noise.unit(),
                ]
            })
            .collect();
        let bend = |camera: usize, at: Point2| {
            let part = waves[4 * camera..4 * camera + 4].iter();
            let sum: f64 = part
                .map(|[a, k, direction, phase]| {
                    let (sin, cos) = libm::sincos(*direction);
                    a * libm::sin(k * (cos * at.x_mm + sin * at.y_mm) + phase)
                })
                .sum();
            0.5 * self.bend_px * sum
        };
        let geometry = self.remount.of_geometry(geometry);
        let bend = |camera: usize, at: Point2| bend(camera, self.remount.back(at));
        if self.session > 0 {
            noise = Noise::new((0x5e55 ^ self.seed).wrapping_mul(0x9e37_79b9) + self.session);
        }
        // Apart from the rest: a skin differs from the same one without spreads in nothing else.
        let mut chance = Noise::new(0x59ead ^ self.seed ^ (self.session << 32));
        let mut widths = |camera: usize, at: Point2, events: u32| {
            let eye = geometry.cameras[camera].position;
            let outlier = if chance.unit() < 0.05 { 3.0 } else { 1.0 };
            let mut scatter = || chance.normal() * (100.0 / f64::from(events)).sqrt();
            match self.spreads {
                Spreads::Absent => None,
                Spreads::Near(relative) => {
                    let width = outlier * 1500.0 / at.distance_mm(eye).max(10.0);
                    Some([width, 0.5 * width].map(|w| w * libm::exp(relative * scatter())))
                }
                Spreads::Chance => Some([30.0, 15.0].map(|w| w * libm::exp(0.2 * scatter()))),
            }
        };
        let step = 64.0 / f64::from(self.side - 1);
        let mut rows = Vec::new();
        let mut calibrating = 0;
        for repetition in 0..self.repeats {
            let depth_mm = self.depths[repetition as usize % self.depths.len()];
            for location in 0..self.side * self.side {
                let at = Point2::new(
                    -22.0 + step * f64::from(location / self.side),
                    -30.0 + step * f64::from(location % self.side),
                );
                let columns = geometry.cameras.map(|c| c.column_of_point(at));
                let [Some(one), Some(two)] = columns else {
                    continue;
                };
                let strength = depth_mm / 2.0 * libm::exp(self.weak * noise.normal());
                let events = (100.0 * strength).round().max(1.0) as u32;
                let spread = self.noise_px * (100.0 / f64::from(events)).sqrt();
                let far = noise.unit() < self.outliers;
                let mut column = |k: usize, u: f64| {
                    let factor = if k == 1 { self.blind } else { 1.0 };
                    let off = if far { 60.0 * noise.normal() } else { 0.0 };
                    u + bend(k, at) + factor * spread * noise.normal() + off
                };
                let mut views = [view(column(0, one), events), view(column(1, two), events)];
                for (k, view) in views.iter_mut().flatten().enumerate() {
                    let both = widths(k, at, events);
                    (view.spread_u, view.spread_v) = (both.map(|s| s[0]), both.map(|s| s[1]));
                }
                let lower_left = at.x_mm < 6.0 && at.y_mm < 0.0;
                let mut role = PressRole::Score;
                let turn = (location + location / self.side).is_multiple_of(2);
                if turn && (lower_left || !self.corner) && calibrating < self.calibrating {
                    role = PressRole::Calibrate;
                    calibrating += usize::from(repetition == 0);
                }
                rows.push(PressResult {
                    press: PressId::from_index(rows.len() as u32),
                    role,
                    repetition: RepetitionId::from_index(repetition),
                    location: LocationId::from_index(location),
                    planned: at,
                    depth_mm,
                    truth: Some(at),
                    verdict: Verdict::Valid,
                    cause: None,
                    timing: None,
                    views,
                    location_outcome: LocationOutcome::Missing,
                    region: None,
                    extrapolated: false,
                });
            }
        }
        rows
    }

    pub(crate) fn set(&self) -> CalibrationSet {
        CalibrationSet::from_presses(&self.presses())
    }
}

pub(crate) fn settings(locator: Locator) -> AnalysisSettings {
    AnalysisSettings {
        locator,
        bootstrap_resamples: 20,
        ..AnalysisSettings::default()
    }
}

pub(crate) fn calibrated(set: &CalibrationSet) -> ModelChoice {
    choose(set, &DRAWN, &settings(Locator::Auto))
}

pub(crate) fn learn(skin: &Skin, locator: Locator) -> LocatorChoice {
    learn_set(&skin.set(), locator)
}

pub(crate) fn learn_set(set: &CalibrationSet, locator: Locator) -> LocatorChoice {
    let model = calibrated(set);
    let calibration = model.calibration.as_ref();
    choose_locator(set, &model.geometry, calibration, &settings(locator)).unwrap()
}

pub(crate) fn features(press: &PressResult) -> Features {
    Features::of_press(press).unwrap()
}

/// A scored press that was located: press, error vector, location.
pub(crate) fn scored(
    skin: &Skin,
    choice: &LocatorChoice,
) -> Vec<(PressResult, [f64; 2], skinrig_analysis::locator::Location)> {
    let presses = skin.presses().into_iter();
    presses
        .filter(|p| p.role == PressRole::Score)
        .filter_map(|p| {
            let location = choice.fitted.locate(&features(&p))?;
            let truth = p.truth?;
            let error = [location.at[0] - truth.x_mm, location.at[1] - truth.y_mm];
            Some((p, error, location))
        })
        .collect()
}

/// Lengths of the errors of the scored presses, mm; one without position counts the skin's diagonal, the largest error.
pub(crate) fn errors(skin: &Skin, choice: &LocatorChoice) -> Vec<f64> {
    let located = scored(skin, choice);
    let all = skin
        .presses()
        .iter()
        .filter(|p| p.role == PressRole::Score)
        .count();
    let lengths = located
        .iter()
        .map(|(_, e, _)| libm::hypot(e[0], e[1]).min(141.4));
    lengths.chain((located.len()..all).map(|_| 141.4)).collect()
}

pub(crate) fn rms(skin: &Skin, choice: &LocatorChoice) -> f64 {
    let errors = errors(skin, choice);
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
}
