//! Optical effect of the tip on the skin: shape of the dent, light that it blocks in each column and light that its
//! flanks return.
//!
//! For a dent that is `a` mm deep, column `u` loses the part `x = 1 - exp(-a loss(u))` of the light that
//! arrives from behind it. Everything else is computed once per dent.

use std::ops::Range;

use skinrig_model::SENSOR_WIDTH;

use crate::scene::SceneConfig;

use super::column::LANES;
use super::config::OpticalConfig;
use super::light::{Column, Illumination, Vec2, dot};
use super::optics::Optics;

/// Step of the integrals across the dent, mm.
const STEP_MM: f64 = 0.5;
/// The dent's flank is followed over this many decay lengths (e^-5 = 0.7 % of its depth is left there).
const FLANK_DECAYS: f64 = 5.0;
/// Directions for which the light that falls on a flank is tabulated.
const FLANK_DIRECTIONS: usize = 64;
/// Columns that lose a smaller part of their light than this at 1 mm of indentation are ignored.
const LEAST_LOSS_PER_MM: f64 = 0.002;
/// Rows are followed over this many standard deviations of the dent's image.
const ROW_SIGMAS: f64 = 3.0;

/// The fixed part of a dent's geometry: tip and skin.
#[derive(Debug, Clone, Copy)]
pub(super) struct DentShape {
    half_side_mm: f64,
    decay_mm: f64,
    thickness_mm: f64,
}

impl DentShape {
    pub(super) fn new(scene: &SceneConfig, config: &OpticalConfig) -> Self {
        Self {
            half_side_mm: scene.tip_side_mm / 2.0,
            decay_mm: config.dent_decay_thicknesses * scene.skin_thickness_mm,
            thickness_mm: scene.skin_thickness_mm,
        }
    }

    /// Radius outside which the skin counts as undisturbed, mm.
    fn reach_mm(&self) -> f64 {
        self.half_side_mm * core::f64::consts::SQRT_2 + FLANK_DECAYS * self.decay_mm
    }

    /// Depth at `offset` from the tip's axis as a part of the depth under the tip, and the outward direction
    /// of the flank (zero under the tip). The surface follows the tip's flat end and rises exponentially
    /// outside.
    fn depth(&self, offset: Vec2) -> (f64, Vec2) {
        let over = |v: f64| (v.abs() - self.half_side_mm).max(0.0).copysign(v);
        let out = [over(offset[0]), over(offset[1])];
        let square = dot(out, out);
        if square == 0.0 {
            return (1.0, [0.0, 0.0]);
        }
        let distance = square.sqrt();
        (
            libm::exp(-distance / self.decay_mm),
            [out[0] / distance, out[1] / distance],
        )
    }
}

/// Effect of one dent on the image of one camera.
#[derive(Debug, Clone)]
pub(super) struct Dent {
    /// Columns that it changes.
    pub(super) columns: Range<usize>,
    /// Loss per mm of indentation, for each column of the sensor.
    pub(super) loss_per_mm: Vec<f64>,
    pub(super) largest_loss_per_mm: f64,
    /// Part of the light that comes from behind the dent, for each column; 0 where it blocks nothing.
    pub(super) shadow: Vec<f64>,
    /// Light returned by the flanks in units of the column's undisturbed light and of `x`, for each column.
    pub(super) shine: Vec<f64>,
    /// Weights of shadow and shine, for each row of the skin, in whole blocks of rows.
    pub(super) shadow_rows: Vec<f32>,
    pub(super) shine_rows: Vec<f32>,
}

impl Dent {
    /// The dent at `place`.
    pub(super) fn new(optics: &Optics, place: Vec2) -> Self {
        let Optics {
            scene,
            config,
            light,
            columns,
        } = optics;
        let shape = DentShape::new(scene, config);
        let lit = flank_light(light, place);
        let width = columns.len();
        let (mut loss_per_mm, mut shadow, mut shine) =
            (vec![0.0; width], vec![0.0; width], vec![0.0; width]);
        for (u, column) in columns.iter().enumerate() {
            let crossing = cross(&shape, config, column, place, &lit);
            if crossing.loss_per_mm < LEAST_LOSS_PER_MM {
                continue;
            }
            loss_per_mm[u] = crossing.loss_per_mm;
            shadow[u] = column.beyond(crossing.nearest_mm);
            let fade =
                libm::exp(-config.attenuation_per_mm * (crossing.nearest_mm - column.enter_mm));
            shine[u] = config.flank_gain * crossing.shine_per_mm * fade
                / (crossing.loss_per_mm * column.total);
        }
        let image = Image::new(scene, config, place);
        Self {
            columns: extent(&loss_per_mm),
            shadow_rows: image.weights(scene, image.centre, image.sigma),
            shine_rows: image.weights(scene, image.shine_centre, image.shine_sigma),
            largest_loss_per_mm: loss_per_mm.iter().copied().fold(0.0, f64::max),
            loss_per_mm,
            shadow,
            shine,
        }
    }

    /// The part of the far light that column `u` loses at a depth of `amplitude_mm`: 0..1.
    pub(super) fn lost(&self, u: usize, amplitude_mm: f64) -> f64 {
        -libm::expm1(-amplitude_mm * self.loss_per_mm[u])
    }
}

/// First to last column with a loss.
fn extent(loss: &[f64]) -> Range<usize> {
    let first = loss.iter().position(|&k| k > 0.0);
    let last = loss.iter().rposition(|&k| k > 0.0);
    first.zip(last).map_or(0..0, |(a, b)| a..b + 1)
}

/// Losses and gains along a ray through the dent, per mm of indentation.
struct Crossing {
    loss_per_mm: f64,
    shine_per_mm: f64,
    /// Position of the dent along the ray, mm from the camera.
    nearest_mm: f64,
}

fn cross(
    shape: &DentShape,
    config: &OpticalConfig,
    column: &Column,
    place: Vec2,
    lit: &[f64; FLANK_DIRECTIONS],
) -> Crossing {
    let d = column.direction;
    let to = [place[0] - column.origin[0], place[1] - column.origin[1]];
    let along = dot(to, d);
    let half_chord_square = shape.reach_mm() * shape.reach_mm() - (dot(to, to) - along * along);
    let nearest_mm = along.max(column.enter_mm).min(column.exit_mm);
    let mut crossing = Crossing {
        loss_per_mm: 0.0,
        shine_per_mm: 0.0,
        nearest_mm,
    };
    if half_chord_square <= 0.0 {
        return crossing;
    }
    let half = half_chord_square.sqrt();
    let (from, until) = (
        (along - half).max(column.enter_mm),
        (along + half).min(column.exit_mm),
    );
    if until <= from {
        return crossing;
    }
    let steps = ((until - from) / STEP_MM).ceil().max(1.0);
    let ds = (until - from) / steps;
    for k in 0..steps as u32 {
        let s = from + (f64::from(k) + 0.5) * ds - along;
        let offset = [
            along * d[0] - to[0] + s * d[0],
            along * d[1] - to[1] + s * d[1],
        ];
        let (depth, outward) = shape.depth(offset);
        let slope = if depth > 0.0 && depth < 1.0 {
            depth / shape.decay_mm
        } else {
            0.0
        };
        crossing.loss_per_mm += ds
            * (config.thinning_loss_per_mm * depth / shape.thickness_mm
                + config.slope_loss_per_mm * slope);
        // Only flanks that face the camera reflect light into it.
        let facing = -dot(outward, d);
        if facing > 0.0 {
            crossing.shine_per_mm += ds * slope * facing * lit[direction_index(outward)];
        }
    }
    crossing
}

/// Light that falls on a flank with each of the tabulated outward directions: all emitters in front of it.
fn flank_light(light: &Illumination, place: Vec2) -> [f64; FLANK_DIRECTIONS] {
    let mut lit = [0.0; FLANK_DIRECTIONS];
    for emitter in &light.emitters {
        let (travel, fluence) = light.at(emitter, place);
        for (i, sum) in lit.iter_mut().enumerate() {
            *sum += fluence * (-dot(direction_of_index(i), travel)).max(0.0);
        }
    }
    lit
}

/// Index of a unit direction on the diamond |x| + |y| = 1, counted counter-clockwise from +x: fast and exact
/// everywhere.
fn direction_index(d: Vec2) -> usize {
    let t = d[1] / (d[0].abs() + d[1].abs());
    let turn = if d[0] >= 0.0 { t } else { 2.0 - t };
    let turn = if turn < 0.0 { turn + 4.0 } else { turn };
    (turn * (FLANK_DIRECTIONS as f64 / 4.0)) as usize % FLANK_DIRECTIONS
}

/// The unit direction in the middle of an index's range.
fn direction_of_index(i: usize) -> Vec2 {
    let turn = (i as f64 + 0.5) * 4.0 / FLANK_DIRECTIONS as f64;
    let [x, y] = match turn {
        t if t < 1.0 => [1.0 - t, t],
        t if t < 2.0 => [1.0 - t, 2.0 - t],
        t if t < 3.0 => [t - 3.0, 2.0 - t],
        t => [t - 3.0, t - 4.0],
    };
    let l = (x * x + y * y).sqrt();
    [x / l, y / l]
}

/// Vertical position and extent of the dent's image.
struct Image {
    centre: f64,
    sigma: f64,
    shine_centre: f64,
    shine_sigma: f64,
}

impl Image {
    /// The nearer the dent, the taller its image: half the skin's thickness spans `rows_per_radian * h / 2r`
    /// rows. The dent comes from the touched surface, so that its lit flank appears in the upper half.
    fn new(scene: &SceneConfig, config: &OpticalConfig, place: Vec2) -> Self {
        let to = [
            place[0] - scene.camera.position.x_mm,
            place[1] - scene.camera.position.y_mm,
        ];
        let distance = dot(to, to).sqrt().max(config.nearest_mm);
        let half_width = f64::from(SENSOR_WIDTH) / 2.0;
        let rows_per_radian = half_width / scene.camera.lens.angle_deg(0.0).1.to_radians();
        let half_height = rows_per_radian * 0.5 * scene.skin_thickness_mm / distance;
        let (first, last) = (
            usize::from(scene.skin_rows.0),
            usize::from(scene.skin_rows.1),
        );
        let centre = 0.5 * (first + last) as f64;
        let sigma =
            (config.dent_sigma_px * config.dent_sigma_px + half_height * half_height).sqrt();
        Self {
            centre,
            sigma,
            shine_centre: centre - half_height - 0.5 * config.dent_sigma_px,
            shine_sigma: 0.7 * sigma,
        }
    }

    /// Gaussian weights of the skin's rows, within the image's extent.
    fn weights(&self, scene: &SceneConfig, centre: f64, sigma: f64) -> Vec<f32> {
        let reach = ROW_SIGMAS * self.sigma;
        let rows = scene.rows();
        let padding = rows.len().next_multiple_of(LANES) - rows.len();
        rows.map(|v| v as f64)
            .map(|v| {
                if (v - self.centre).abs() > reach {
                    return 0.0;
                }
                let z = (v - centre) / sigma;
                libm::exp(-0.5 * z * z) as f32
            })
            .chain(std::iter::repeat_n(0.0, padding))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_and_their_indices_agree() {
        for i in 0..FLANK_DIRECTIONS {
            let d = direction_of_index(i);
            assert!((dot(d, d) - 1.0).abs() < 1e-12);
            assert_eq!(direction_index(d), i);
        }
        for (d, index) in [
            ([1.0, 0.0], 0),
            ([0.0, 1.0], 16),
            ([-1.0, 0.0], 32),
            ([0.0, -1.0], 48),
        ] {
            assert_eq!(direction_index(d), index);
        }
    }

    #[test]
    fn the_dent_is_flat_under_the_tip_and_falls_off_outside() {
        let shape = DentShape {
            half_side_mm: 2.0,
            decay_mm: 3.0,
            thickness_mm: 4.0,
        };
        assert_eq!(shape.depth([1.9, -1.9]), (1.0, [0.0, 0.0]));
        let (depth, outward) = shape.depth([5.0, 0.5]);
        assert!((depth - libm::exp(-1.0)).abs() < 1e-12);
        assert_eq!(outward, [1.0, 0.0]);
        let (corner, outward) = shape.depth([-5.0, 6.0]);
        assert!((corner - libm::exp(-5.0 / 3.0)).abs() < 1e-12);
        assert!((outward[0] + 0.6).abs() < 1e-12 && (outward[1] - 0.8).abs() < 1e-12);
    }
}
