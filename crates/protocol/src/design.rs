//! Which locations calibrate best: a few of the path's, for a smooth field over all of them.
//!
//! Columns differ from the drawn geometry by the camera's parameters and a Gaussian process. Their variance after some presses
//! depends on where these are, not on what they find, so the best next press is known before the run: the one that most
//! reduces the expected squared error, summed over all locations (Cohn 1996, Neural Networks 9:1071).

use skinrig_model::{CameraModel, Point2, PressRole, StereoGeometry};
use skinrig_settings::{Collector, Field, Settings};

/// Most locations of a path of which some are chosen: each one costs time in their square.
const MOST_LOCATIONS: usize = 1000;

/// The locations of the path that calibrating repetitions press: those that leave the least expected error over all locations.
#[derive(Settings)]
#[settings(name = "calibrate_at")]
pub(crate) struct CalibrateAt {
    /// How many. Presses in a calibrating repetition are as many for each depth.
    #[setting(min = 1, max = 300)]
    pub locations: u32,
    /// Distance over which errors of the skin are alike.
    #[setting(default = "14 mm", above = 0.0, max = 1000.0)]
    pub length_mm: f64,
}

impl CalibrateAt {
    /// Indices of the chosen locations in the order of the path; findings otherwise.
    pub(crate) fn choose(
        &self,
        locations: &[Point2],
        roles: &[PressRole],
        cameras: &StereoGeometry,
        field: &Field,
        out: &mut Collector,
    ) -> Option<Vec<usize>> {
        let (path, count) = (field.path.as_str(), self.locations as usize);
        if !roles.contains(&PressRole::Calibrate) {
            out.error(field.span, path, "no repetition calibrates")
                .expected("a repetition in `evaluation.calibrate`")
                .found("none");
            return None;
        }
        if locations.len() > MOST_LOCATIONS {
            out.error(field.span, path, "too many locations to choose from")
                .expected(format!("a path of at most {MOST_LOCATIONS} locations"))
                .found(locations.len().to_string());
            return None;
        }
        if count > locations.len() {
            let field = field.at("locations");
            out.error(field.span, field.path.as_str(), "more than the path has")
                .expected(format!(
                    "at most {}, the locations of `path`",
                    locations.len()
                ))
                .found(count.to_string());
            return None;
        }
        let mut chosen = best_locations(locations, cameras, count, self.length_mm);
        chosen.sort_unstable();
        Some(chosen)
    }
}

/// Gains that differ by less than this factor are equal: the earlier location wins on every machine.
const TIE: f64 = 1.0 + 1e-9;
/// Standard deviations before the first press, assumed: of the field and of a column, px; of a camera's position, mm, its skew
/// and half field of view, degrees, and the lens's distortion.
const FIELD_PX: f64 = 5.0;
const NOISE_PX: f64 = 3.0;
const PARAMETER_SDS: [f64; 5] = [2.0, 2.0, 1.0, 1.0, 0.05];
/// Step of a numerical slope in standard deviations, and in mm.
const SMALL: f64 = 0.05;
const STEP_MM: f64 = 0.1;
/// Largest squared error of a position by 1 px, mm²: where the rays are nearly parallel, and where a camera does not see.
const MOST_DILUTION: f64 = 9.0;

/// Indices of `count` of the locations, in the order in which each next one most reduces the expected squared error over all
/// locations. `length_mm`: distance over which the correlation of the field falls to exp(-1/2).
#[must_use]
pub fn best_locations(
    locations: &[Point2],
    geometry: &StereoGeometry,
    count: usize,
    length_mm: f64,
) -> Vec<usize> {
    let n = locations.len();
    let mut cameras = [0, 1].map(|k| Columns::new(locations, &geometry.cameras[k], length_mm));
    let weights: Vec<[f64; 2]> = locations.iter().map(|at| dilution(*at, geometry)).collect();
    let mut chosen: Vec<usize> = Vec::new();
    while chosen.len() < count.min(n) {
        let mut best: Option<(usize, f64)> = None;
        for i in (0..n).filter(|i| !chosen.contains(i)) {
            let gains = [0, 1].map(|k| cameras[k].gain(i, weights.iter().map(|w| w[k])));
            let gain = gains[0] + gains[1];
            if best.is_none_or(|(_, most)| gain > most * TIE) {
                best = Some((i, gain));
            }
        }
        let Some((next, _)) = best else { break };
        cameras.iter_mut().for_each(|columns| columns.press(next));
        chosen.push(next);
    }
    chosen
}

/// Covariance of the errors of one camera's columns at all locations, px²: a field, and the parameters of the camera.
struct Columns(Vec<Vec<f64>>);

impl Columns {
    fn new(locations: &[Point2], camera: &CameraModel, length_mm: f64) -> Self {
        let slopes: Vec<[f64; 5]> = locations.iter().map(|at| slopes(*at, camera)).collect();
        let covariance = |(a, u): (&Point2, &[f64; 5]), (b, v): (&Point2, &[f64; 5])| {
            let distance = a.distance_mm(*b) / length_mm;
            let field = FIELD_PX * FIELD_PX * libm::exp(-0.5 * distance * distance);
            field + u.iter().zip(v).map(|(u, v)| u * v).sum::<f64>()
        };
        let all = || locations.iter().zip(&slopes);
        Self(
            all()
                .map(|a| all().map(|b| covariance(a, b)).collect())
                .collect(),
        )
    }

    /// Reduction of the weighted sum of variances by a press at location `i`.
    fn gain(&self, i: usize, weights: impl Iterator<Item = f64>) -> f64 {
        let row = &self.0[i];
        let reduced: f64 = row.iter().zip(weights).map(|(c, w)| w * c * c).sum();
        reduced / (row[i] + NOISE_PX * NOISE_PX)
    }

    fn press(&mut self, i: usize) {
        let column = self.0[i].clone();
        let scale = 1.0 / (column[i] + NOISE_PX * NOISE_PX);
        for (row, a) in self.0.iter_mut().zip(&column) {
            for (c, b) in row.iter_mut().zip(&column) {
                *c -= a * b * scale;
            }
        }
    }
}

/// Change of the column of a point by one standard deviation of each parameter.
fn slopes(at: Point2, camera: &CameraModel) -> [f64; 5] {
    let (half_fov_deg, w) = camera.lens.coefficients();
    let moved = |[dx, dy, skew, fov, bend]: [f64; 5]| CameraModel {
        position: Point2::new(camera.position.x_mm + dx, camera.position.y_mm + dy),
        skew_deg: camera.skew_deg + skew,
        lens: camera.lens.with(half_fov_deg + fov, w + bend),
        ..*camera
    };
    let here = camera.column_of_point(at);
    std::array::from_fn(|i| {
        let mut step = [0.0; 5];
        step[i] = SMALL * PARAMETER_SDS[i];
        let there = moved(step).column_of_point(at);
        let both = there.zip(here);
        both.map_or(0.0, |(there, here)| (there - here) / SMALL)
    })
}

/// Squared error of a position for 1 px of either camera's column, mm².
fn dilution(at: Point2, geometry: &StereoGeometry) -> [f64; 2] {
    let slope = |camera: &CameraModel, dx_mm: f64, dy_mm: f64| {
        let column = |by: f64| {
            camera.column_of_point(Point2::new(at.x_mm + by * dx_mm, at.y_mm + by * dy_mm))
        };
        Some((column(1.0)? - column(-1.0)?) / (2.0 * STEP_MM))
    };
    let rows = geometry.cameras.each_ref().map(|camera| {
        let slopes = slope(camera, STEP_MM, 0.0).zip(slope(camera, 0.0, STEP_MM));
        slopes.map_or([0.0; 2], |(x, y)| [x, y])
    });
    let [[a, b], [c, d]] = rows;
    let determinant = (a * d - b * c).powi(2);
    [c * c + d * d, a * a + b * b].map(|squares| {
        if squares >= MOST_DILUTION * determinant {
            MOST_DILUTION
        } else {
            squares / determinant
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The published part of the skin in steps of 7 mm.
    fn grid(side: u32) -> Vec<Point2> {
        let at = |i: u32| {
            Point2::new(
                f64::from(i / side) * 7.0 - 25.0,
                f64::from(i % side) * 7.0 - 26.0,
            )
        };
        (0..side * side).map(at).collect()
    }

    #[test]
    fn chosen_locations_are_distinct_and_spread_over_the_skin() {
        let locations = grid(9);
        let chosen = best_locations(&locations, &StereoGeometry::PAPER, 27, 15.0);
        let mut sorted = chosen.clone();
        sorted.sort_unstable();
        sorted.dedup();
        assert_eq!(sorted.len(), 27);
        // Every location has a chosen one within the length over which errors are alike.
        for at in &locations {
            let near = chosen.iter().map(|i| locations[*i].distance_mm(*at));
            let nearest_mm = near.fold(f64::INFINITY, f64::min);
            assert!(nearest_mm < 15.0, "{at:?}: {nearest_mm} mm");
        }
        // More presses begin with the same ones.
        assert_eq!(
            best_locations(&locations, &StereoGeometry::PAPER, 9, 15.0),
            chosen[..9]
        );
        assert_eq!(
            best_locations(&locations, &StereoGeometry::PAPER, 100, 15.0).len(),
            81
        );
    }

    #[test]
    fn a_location_counts_as_much_as_its_columns_tell() {
        let weight = |x, y| dilution(Point2::new(x, y), &StereoGeometry::PAPER);
        // Between the cameras both rays have one direction.
        assert!(weight(44.0, 2.0)[0] > 4.0 * weight(10.0, 2.0)[0]);
        assert_eq!(weight(500.0, 2.0), [MOST_DILUTION; 2]);
    }
}
