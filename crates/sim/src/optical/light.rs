//! The light in the undisturbed skin: emitters, fluence, and the light that each column of the camera receives.
//!
//! Light travels in the skin's plane (the 4 mm guide it). A column's light comes from the wall at the
//! far end of its ray, with its emitters, plus the light that the skin scatters into the ray, plus stray
//! light.

use skinrig_model::{CameraModel, Point2, SENSOR_WIDTH, SkinOutline};

use crate::random::{Purpose, Stream};

use super::config::OpticalConfig;
use super::parts::UnevenLight;

/// Spacing of the points at which a ray is followed, mm, or a little less.
const RAY_STEP_MM: f64 = 4.0;
/// Pieces into which each rounded corner is cut for placing emitters.
const ARC_PIECES: u32 = 16;

/// Shorthand: a vector in the skin's plane, mm or unit length.
pub(super) type Vec2 = [f64; 2];

pub(super) fn dot(a: Vec2, b: Vec2) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn length(a: Vec2) -> f64 {
    dot(a, a).sqrt()
}

/// One emitter: where it sits and where it points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Emitter {
    pub(super) at: Vec2,
    pub(super) axis: Vec2,
    /// Power relative to the mean emitter's.
    pub(super) power: f64,
}

/// The light of all emitters.
#[derive(Debug, Clone)]
pub(super) struct Illumination {
    pub(super) emitters: Vec<Emitter>,
    /// Exponent of the lobe `cos^n`.
    lobe: f64,
    attenuation_per_mm: f64,
    cloud: Option<Cloud>,
}

impl Illumination {
    /// Emitters evenly spaced along the edges at small and large y and small x (the edge at large x has the
    /// cameras), each aimed at the middle of the camera edge (paper, section "Sensor Design").
    pub(super) fn new(outline: &SkinOutline, config: &OpticalConfig, skin_seed: u64) -> Self {
        let uneven = config.parts.uneven_light;
        let mut random = Stream::new(skin_seed, Purpose::Skin, 1);
        let path = emitter_path(outline);
        let total: f64 = path.windows(2).map(|w| distance(w[0], w[1])).sum();
        let target = [
            outline.centre.x_mm + outline.width_mm / 2.0,
            outline.centre.y_mm,
        ];
        let emitters = (0..config.emitters)
            .filter_map(|i| {
                let s = (f64::from(i) + 0.5) / f64::from(config.emitters) * total;
                let at = along(&path, s)?;
                Some(Emitter {
                    at,
                    axis: unit([target[0] - at[0], target[1] - at[1]])?,
                    power: uneven.map_or(1.0, |u| libm::exp(u.emitters * random.gauss())),
                })
            })
            .collect();
        // cos^n is one half at the half-intensity angle.
        let lobe =
            -core::f64::consts::LN_2 / libm::log(libm::cos(config.half_intensity_deg.to_radians()));
        Self {
            emitters,
            lobe,
            attenuation_per_mm: config.attenuation_per_mm,
            cloud: uneven.map(|u| Cloud::new(&u, skin_seed)),
        }
    }

    /// Intensity of `emitter` in the unit direction `d`, its power on its axis.
    fn lobe(&self, emitter: &Emitter, d: Vec2) -> f64 {
        let c = dot(emitter.axis, d);
        emitter.power
            * if c <= 0.0 {
                0.0
            } else if (self.lobe - 1.0).abs() < 1e-9 {
                c
            } else {
                libm::pow(c, self.lobe)
            }
    }

    /// Light of one emitter at `p`: direction of travel and fluence (per mm: light spreads in a
    /// plane).
    pub(super) fn at(&self, emitter: &Emitter, p: Vec2) -> (Vec2, f64) {
        let to = [p[0] - emitter.at[0], p[1] - emitter.at[1]];
        let r = length(to).max(1.0);
        let d = [to[0] / r, to[1] / r];
        (
            d,
            self.lobe(emitter, d) * libm::exp(-self.attenuation_per_mm * r) / r,
        )
    }

    /// Fluence at `p`, weighted with the scattering there.
    fn scattered(&self, p: Vec2) -> f64 {
        let fluence = self.emitters.iter().map(|e| self.at(e, p).1).sum();
        match &self.cloud {
            Some(cloud) => cloud.at(p) * fluence,
            None => fluence,
        }
    }

    /// Radiance of the wall at `p` towards the unit direction `d`: emitters near `p`, blurred.
    fn wall(&self, p: Vec2, d: Vec2, sigma_mm: f64) -> f64 {
        let term = |e: &Emitter| {
            let offset = [p[0] - e.at[0], p[1] - e.at[1]];
            let square = dot(offset, offset) / (sigma_mm * sigma_mm);
            if square > 36.0 {
                0.0
            } else {
                self.lobe(e, d) * libm::exp(-0.5 * square)
            }
        };
        self.emitters.iter().map(term).sum()
    }
}

/// Scattering of a skin that is cloudier in places, relative to its mean: the exponential of a sum of waves.
#[derive(Debug, Clone)]
struct Cloud {
    /// Wave vector, 1/mm, and phase.
    waves: Vec<(Vec2, f64)>,
    amplitude: f64,
}

impl Cloud {
    const WAVES: u32 = 12;

    fn new(uneven: &UnevenLight, skin_seed: u64) -> Self {
        let mut random = Stream::new(skin_seed, Purpose::Skin, 2);
        let tau = 2.0 * core::f64::consts::PI;
        let waves = (0..Self::WAVES)
            .map(|_| {
                let (sin, cos) = libm::sincos(tau * random.unit());
                let k = tau / (uneven.cloud_mm * random.between(0.7, 1.5));
                ([k * cos, k * sin], tau * random.unit())
            })
            .collect();
        Self {
            waves,
            amplitude: uneven.cloud * (2.0 / f64::from(Self::WAVES)).sqrt(),
        }
    }

    fn at(&self, p: Vec2) -> f64 {
        let sum: f64 = self
            .waves
            .iter()
            .map(|(k, phase)| libm::cos(dot(*k, p) + phase))
            .sum();
        libm::exp(self.amplitude * sum)
    }
}

/// Light that one column of the camera receives from the undisturbed skin.
#[derive(Debug, Clone)]
pub(super) struct Column {
    /// Where the ray begins: the camera, or where it leaves the camera's pod.
    pub(super) origin: Vec2,
    /// Unit direction of the ray, away from the camera.
    pub(super) direction: Vec2,
    /// Where the ray is inside the skin, mm from its origin; `enter == exit` when it misses the skin.
    pub(super) enter_mm: f64,
    pub(super) exit_mm: f64,
    /// Light from the wall at the end of the ray, as it arrives.
    wall: f64,
    /// Light scattered into the ray before `enter + k * step`, as it arrives.
    scattered: Vec<f64>,
    step_mm: f64,
    /// All light, stray light included; above 0.
    pub(super) total: f64,
}

impl Column {
    fn new(
        camera: &CameraModel,
        x: u16,
        outline: &SkinOutline,
        light: &Illumination,
        config: &OpticalConfig,
        enter: impl Fn(Vec2, Vec2) -> (Vec2, Vec2),
    ) -> Self {
        let direction = camera.direction(camera.angle_of_column_deg(f64::from(x)));
        let origin = [camera.position.x_mm, camera.position.y_mm];
        let (origin, direction) = enter(origin, direction);
        let at = |s: f64| [origin[0] + s * direction[0], origin[1] + s * direction[1]];
        let (enter_mm, exit_mm) = inside(
            outline,
            at,
            distance(origin, [outline.centre.x_mm, outline.centre.y_mm]),
        );
        let fade = |s: f64| libm::exp(-config.attenuation_per_mm * (s - enter_mm));
        let steps = ((exit_mm - enter_mm) / RAY_STEP_MM).ceil().max(1.0);
        let step_mm = (exit_mm - enter_mm) / steps;
        let mut scattered = vec![0.0];
        let mut sum = 0.0;
        for k in 0..steps as u32 {
            let middle = enter_mm + (f64::from(k) + 0.5) * step_mm;
            sum += config.scatter_per_mm * step_mm * light.scattered(at(middle)) * fade(middle);
            scattered.push(sum);
        }
        let towards_camera = [-direction[0], -direction[1]];
        let wall = if exit_mm > enter_mm {
            light.wall(at(exit_mm), towards_camera, config.emitter_sigma_mm) * fade(exit_mm)
        } else {
            0.0
        };
        Self {
            origin,
            direction,
            enter_mm,
            exit_mm,
            wall,
            scattered,
            step_mm,
            total: wall + sum + config.stray,
        }
    }

    /// The part of the light that comes from farther than `s` mm from the camera: 0..1.
    pub(super) fn beyond(&self, s: f64) -> f64 {
        let k = (s - self.enter_mm).max(0.0) / self.step_mm.max(f64::MIN_POSITIVE);
        let last = self.scattered.len() - 1;
        let low = (k as usize).min(last);
        let high = (low + 1).min(last);
        let before = self.scattered[low]
            + (self.scattered[high] - self.scattered[low]) * (k - low as f64).min(1.0);
        (self.wall + self.scattered[last] - before) / self.total
    }
}

/// All columns of the camera. `enter` gives the origin and direction in the skin of a ray that leaves the lens.
pub(super) fn columns(
    camera: &CameraModel,
    outline: &SkinOutline,
    light: &Illumination,
    config: &OpticalConfig,
    enter: impl Fn(Vec2, Vec2) -> (Vec2, Vec2),
) -> Vec<Column> {
    (0..SENSOR_WIDTH)
        .map(|x| Column::new(camera, x, outline, light, config, &enter))
        .collect()
}

/// First stretch of the ray `at` inside the outline, searched up to the skin's far side.
fn inside(outline: &SkinOutline, at: impl Fn(f64) -> Vec2, to_centre_mm: f64) -> (f64, f64) {
    const STEP_MM: f64 = 1.0;
    let contains = |s: f64| {
        let [x, y] = at(s);
        outline.contains(Point2::new(x, y))
    };
    // The border between `a` and `b`, one of them inside.
    let border = |mut a: f64, mut b: f64, b_inside: bool| {
        for _ in 0..24 {
            let middle = 0.5 * (a + b);
            if contains(middle) == b_inside {
                b = middle
            } else {
                a = middle
            }
        }
        0.5 * (a + b)
    };
    let reach = to_centre_mm + outline.width_mm + outline.height_mm;
    let steps = (reach / STEP_MM) as u32 + 1;
    let grid = |k: u32| f64::from(k) * STEP_MM;
    let Some(first) = (0..steps).find(|&k| contains(grid(k))) else {
        return (0.0, 0.0);
    };
    let enter = if first == 0 {
        0.0
    } else {
        border(grid(first - 1), grid(first), true)
    };
    let after = (first..steps)
        .find(|&k| !contains(grid(k)))
        .unwrap_or(steps);
    (enter, border(grid(after - 1), grid(after), false))
}

/// The three edges without cameras as a polyline, from the end of the lower edge around to the end of the
/// upper one.
fn emitter_path(outline: &SkinOutline) -> Vec<Vec2> {
    let (hx, hy) = (outline.width_mm / 2.0, outline.height_mm / 2.0);
    let (c, r) = (outline.chamfer_mm, outline.radius_mm);
    let mut path = vec![[hx - c, -hy]];
    let mut arc = |cy: f64, from_deg: f64| {
        for k in 0..=ARC_PIECES {
            let turn = 90.0 * f64::from(k) / f64::from(ARC_PIECES);
            let (sin, cos) = libm::sincos((from_deg - turn).to_radians());
            path.push([r - hx + r * cos, cy + r * sin]);
        }
    };
    arc(r - hy, 270.0);
    arc(hy - r, 180.0);
    path.push([hx - c, hy]);
    path.into_iter()
        .map(|[x, y]| [x + outline.centre.x_mm, y + outline.centre.y_mm])
        .collect()
}

fn distance(a: Vec2, b: Vec2) -> f64 {
    length([a[0] - b[0], a[1] - b[1]])
}

fn unit(a: Vec2) -> Option<Vec2> {
    let l = length(a);
    (l > 0.0).then(|| [a[0] / l, a[1] / l])
}

/// The point `s` mm along `path`, or `None` on an empty path.
fn along(path: &[Vec2], mut s: f64) -> Option<Vec2> {
    for w in path.windows(2) {
        let l = distance(w[0], w[1]);
        if s <= l && l > 0.0 {
            let f = s / l;
            return Some([
                w[0][0] + f * (w[1][0] - w[0][0]),
                w[0][1] + f * (w[1][1] - w[0][1]),
            ]);
        }
        s -= l;
    }
    path.last().copied()
}

#[cfg(test)]
mod tests {
    use super::*;
    use skinrig_model::StereoGeometry;

    #[test]
    fn emitters_sit_on_the_three_edges_without_cameras() {
        let skin = SkinOutline::PAPER;
        let light = Illumination::new(&skin, &OpticalConfig::default(), 0);
        assert_eq!(light.emitters.len(), 32);
        for e in &light.emitters {
            let p = Point2::new(e.at[0], e.at[1]);
            // On the outline (a chord of an arc runs up to 0.03 mm inside), never on the chamfers or the
            // right edge.
            assert!(skin.clearance_mm(p).abs() < 0.05, "{p:?}");
            assert!(p.x_mm < 40.0, "{p:?}");
            let aimed = [60.0 - e.at[0], 2.0 - e.at[1]];
            assert!((dot(aimed, e.axis) - length(aimed)).abs() < 1e-9);
        }
        let mirrored = light.emitters.iter().zip(light.emitters.iter().rev());
        for (a, b) in mirrored {
            assert!((a.at[0] - b.at[0]).abs() < 1e-9 && (a.at[1] + b.at[1] - 4.0).abs() < 1e-9);
        }
    }

    #[test]
    fn half_intensity_is_at_its_angle() {
        let config = OpticalConfig {
            half_intensity_deg: 35.0,
            ..OpticalConfig::default()
        };
        let light = Illumination::new(&SkinOutline::PAPER, &config, 0);
        let e = Emitter {
            at: [0.0, 0.0],
            axis: [1.0, 0.0],
            power: 1.0,
        };
        let (sin, cos) = libm::sincos(35.0_f64.to_radians());
        assert!((light.lobe(&e, [cos, sin]) - 0.5).abs() < 1e-12);
        assert!((light.lobe(&e, [1.0, 0.0]) - 1.0).abs() < 1e-12);
        assert!(light.lobe(&e, [-1.0, 0.0]).abs() < 1e-12);
    }

    #[test]
    fn rays_end_on_the_outline_and_their_light_adds_up() {
        let skin = SkinOutline::PAPER;
        let config = OpticalConfig::default();
        let light = Illumination::new(&skin, &config, 0);
        for camera in StereoGeometry::PAPER.cameras {
            for column in columns(&camera, &skin, &light, &config, |lens, d| (lens, d))
                .iter()
                .step_by(37)
            {
                let [dx, dy] = column.direction;
                let end = Point2::new(
                    camera.position.x_mm + column.exit_mm * dx,
                    camera.position.y_mm + column.exit_mm * dy,
                );
                assert!(skin.clearance_mm(end).abs() < 1e-4, "{end:?}");
                let all = column.beyond(column.enter_mm);
                assert!((all * column.total + config.stray - column.total).abs() < 1e-12);
                // Light from beyond decreases along the ray and never falls below the wall's.
                let mut before = all;
                for k in 1..=20 {
                    let s = column.exit_mm * f64::from(k) / 20.0;
                    let now = column.beyond(s);
                    assert!(now <= before + 1e-12 && now >= 0.0);
                    before = now;
                }
                assert!((before * column.total - column.wall).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn a_camera_that_looks_away_sees_only_stray_light() {
        let config = OpticalConfig::default();
        let light = Illumination::new(&SkinOutline::PAPER, &config, 0);
        let mut camera = StereoGeometry::PAPER.cameras[0];
        camera.position = Point2::new(300.0, 0.0);
        camera.aim = Point2::new(400.0, 0.0);
        for column in columns(&camera, &SkinOutline::PAPER, &light, &config, |lens, d| {
            (lens, d)
        }) {
            assert_eq!((column.enter_mm, column.exit_mm), (0.0, 0.0));
            assert!((column.total - config.stray).abs() < 1e-15);
            assert!(column.beyond(10.0).abs() < 1e-15);
        }
    }
}
