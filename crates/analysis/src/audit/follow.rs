//! Law: a camera's centroid column follows the viewing angle of the press in rank.
//!
//! The angle grows with the column in any lens, and skew only adds to it: the rank correlation of the two needs no
//! calibration, only roughly known camera positions, and no calibration can absorb what it shows. If another reading
//! of the session (cameras exchanged, an axis mirrored, presses shifted) orders the columns clearly better, that is
//! the likely fault. Where ranks cannot tell readings apart (few places, or all on a line), the viewing angles
//! themselves decide, as far as the nominal geometry is good to some degrees.

use std::collections::BTreeSet;
use std::fmt;

use skinrig_model::{CameraId, Point2, PressRole, SkinOutline, StereoGeometry};

use super::finding;
use super::statistics::{compare, fisher_z, median, spearman};
use super::touch::Touch;
use crate::result::{Analysis, Fault, Finding, Law};

/// Places that a statement about ranks needs.
const LEAST_PLACES: usize = 6;
/// Largest shift that is looked for, presses.
const MOST_SHIFT: i32 = 5;
/// A reading must be better than the session's own by this normal score: about 20 readings are tried, 6e-5 each.
const CLEARLY: f64 = 4.0;
/// And order the columns of each camera at least this well: a poor nominal geometry fits nothing.
const LEAST_FIT: f64 = 0.85;
/// Viewing angles off by more than this in the median, in both cameras, are no error of a drawn geometry, degrees:
/// the paper's guess of the positions is up to 6 mm off, its skews 2 degrees.
const FAR_DEG: f64 = 10.0;
/// A reading explains them when it leaves less than this in the median, in both cameras, degrees,
const NEAR_DEG: f64 = 5.0;
/// and less than this share of what the session as it is leaves.
const NEAR_SHARE: f64 = 1.0 / 3.0;
/// Below this correlation a camera does not follow, when nothing explains it.
const NOT_FOLLOWING: f64 = 0.5;
/// Columns of a fixed pixel scatter less than this in the median, px.
const FIXED_PX: f64 = 2.0;
/// Angles must scatter more than this in the median for columns to have to move, degrees.
const LEAST_SPREAD_DEG: f64 = 5.0;
/// Points farther off the axis than this have no rank in a picture, degrees.
const MOST_ANGLE_DEG: f64 = 90.0;

/// A way to read the session.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Reading {
    AsIs,
    Swapped,
    Mirrored { x: bool, y: bool, about: Point2 },
    Shifted(i32),
}

impl Reading {
    fn alternatives(outline: &SkinOutline) -> Vec<Self> {
        let mut all = vec![Self::Swapped];
        for about in [Point2::new(0.0, 0.0), outline.centre] {
            for (x, y) in [(true, false), (false, true), (true, true)] {
                all.push(Self::Mirrored { x, y, about });
            }
        }
        let shifts = (1..=MOST_SHIFT).flat_map(|k| [k, -k]);
        all.extend(shifts.map(Self::Shifted));
        all
    }

    const fn fault(self) -> Fault {
        match self {
            Self::AsIs => Fault::Unknown,
            Self::Swapped => Fault::CamerasSwapped,
            Self::Mirrored { .. } => Fault::AxisMirrored,
            Self::Shifted(_) => Fault::IndexShifted,
        }
    }
}

impl fmt::Display for Reading {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::AsIs => f.write_str("as it is"),
            Self::Swapped => f.write_str("cameras exchanged"),
            Self::Mirrored { x, y, about } => {
                let axes = match (x, y) {
                    (true, true) => "x and y",
                    (true, false) => "x",
                    _ => "y",
                };
                let zero = about == Point2::new(0.0, 0.0);
                let about = if zero { "0" } else { "the skin's centre" };
                write!(f, "{axes} mirrored about {about}")
            }
            Self::Shifted(by) => write!(f, "press list shifted by {by:+}"),
        }
    }
}

/// What a reading says: correlations per camera, and how much better than the session as it is.
struct Judged {
    reading: Reading,
    fit: [Option<f64>; 2],
    fit_as_is: [Option<f64>; 2],
    score: f64,
    /// Mean Fisher z over the cameras, to choose among readings.
    strength: f64,
    /// Median difference of the viewing angles per camera, degrees.
    off_deg: [Option<f64>; 2],
}

pub fn findings(analysis: &Analysis, touches: &[Touch<'_>]) -> Vec<Finding> {
    let path: Vec<&Touch<'_>> = touches
        .iter()
        .filter(|t| t.role != PressRole::Sync)
        .collect();
    let places: BTreeSet<(u64, u64)> = path
        .iter()
        .filter(|t| t.sights.iter().any(|s| s.column.is_some()))
        .map(|t| (t.planned.x_mm.to_bits(), t.planned.y_mm.to_bits()))
        .collect();
    if places.len() < LEAST_PLACES {
        return Vec::new();
    }
    let nominal = &analysis.rig.nominal;
    let fixed = CameraId::ALL.map(|camera| fixed_pixel(nominal, &path, camera));
    if let Some(finding) = on_a_fixed_pixel(fixed) {
        return vec![finding];
    }
    let readings = Reading::alternatives(&analysis.rig.outline);
    let judged: Vec<Judged> = readings
        .iter()
        .filter_map(|reading| judge(nominal, &path, places.len(), *reading))
        .collect();
    let clear: Vec<&Judged> = judged
        .iter()
        .filter(|j| j.score > CLEARLY && j.fit.iter().flatten().all(|r| *r > LEAST_FIT))
        .collect();
    if let Some(best) = likeliest(&clear, places.len()) {
        return vec![by_rank(best, places.len())];
    }
    if let Some(finding) = by_angle(&judged, nominal, &path) {
        return vec![finding];
    }
    let lost = |camera| not_following(analysis, &path, places.len(), camera);
    CameraId::ALL.into_iter().filter_map(lost).collect()
}

/// The strongest reading; among those that are as strong within a standard error, the one that leaves the smallest
/// angles.
fn likeliest<'a>(clear: &[&'a Judged], places: usize) -> Option<&'a Judged> {
    let strongest = clear.iter().map(|j| j.strength).fold(f64::MIN, f64::max);
    let error = 1.0 / (places as f64 - 3.0).sqrt();
    let tied = clear.iter().filter(|j| j.strength >= strongest - error);
    let off = |j: &Judged| j.off_deg.iter().flatten().copied().fold(0.0, f64::max);
    tied.min_by(|a, b| off(a).total_cmp(&off(b))).copied()
}

/// A reading that puts the angles right in both cameras, where the session as it is has them far off.
fn by_angle(judged: &[Judged], nominal: &StereoGeometry, path: &[&Touch<'_>]) -> Option<Finding> {
    let as_is = CameraId::ALL.map(|c| off_deg(nominal, path, c, Reading::AsIs));
    let [Some(one), Some(two)] = as_is else {
        return None;
    };
    if one.min(two) < FAR_DEG {
        return None;
    }
    let left = |j: &Judged| match j.off_deg {
        [Some(a), Some(b)] => (a < NEAR_SHARE * one && b < NEAR_SHARE * two).then(|| a.max(b)),
        _ => None,
    };
    // A shift moves the angles too little to tell it from an error of the geometry.
    let best = judged
        .iter()
        .filter(|j| !matches!(j.reading, Reading::Shifted(_)))
        .filter_map(|j| Some((j, left(j)?)))
        .filter(|(_, left)| *left < NEAR_DEG)
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    let evidence = format!(
        "expected viewing angles within some degrees of the nominal geometry's, found them {one:.0} and {two:.0} degrees off \
         in the median (cameras 1 and 2) as the session is, and within {:.1} with {}",
        best.1, best.0.reading
    );
    let fault = best.0.reading.fault();
    Some(finding(Law::CentroidFollowsPosition, fault, None, evidence))
}

/// Median difference between the viewing angles of the columns and those of the presses, degrees.
fn off_deg(
    geometry: &StereoGeometry,
    path: &[&Touch<'_>],
    camera: CameraId,
    reading: Reading,
) -> Option<f64> {
    let k = match reading {
        Reading::Swapped => 1 - camera.index(),
        _ => camera.index(),
    };
    let model = &geometry.cameras[k];
    let compared = compared(geometry, path, camera, reading);
    let off = |&(column, _, angle): &(f64, f64, f64)| {
        (model.angle_of_column_deg(column) - model.skew_deg - angle).abs()
    };
    median(compared.iter().map(off).collect())
}

fn by_rank(best: &Judged, places: usize) -> Finding {
    let list = |fit: [Option<f64>; 2]| {
        let values = fit.map(|r| r.map_or_else(|| "-".to_owned(), |r| format!("{r:.3}")));
        values.join(" and ")
    };
    let evidence = format!(
        "expected columns that follow the viewing angles in rank, found rank correlations {} (cameras 1 and 2) as the \
         session is and {} with {}: {:.1} standard errors better (n {places} places)",
        list(best.fit_as_is),
        list(best.fit),
        best.reading,
        best.score
    );
    finding(
        Law::CentroidFollowsPosition,
        best.reading.fault(),
        None,
        evidence,
    )
}

/// A column with the viewing angle of the press as it is and in another reading.
type Compared = Vec<(f64, f64, f64)>;

fn judge(
    geometry: &StereoGeometry,
    path: &[&Touch<'_>],
    places: usize,
    reading: Reading,
) -> Option<Judged> {
    let mut judged = Judged {
        reading,
        fit: [None; 2],
        fit_as_is: [None; 2],
        score: 0.0,
        strength: 0.0,
        off_deg: CameraId::ALL.map(|c| off_deg(geometry, path, c, reading)),
    };
    let mut cameras = 0.0;
    for camera in CameraId::ALL {
        let compared = compared(geometry, path, camera, reading);
        let pairs = |first: fn(&(f64, f64, f64)) -> f64, second: fn(&(f64, f64, f64)) -> f64| {
            let pairs: Vec<(f64, f64)> = compared.iter().map(|c| (first(c), second(c))).collect();
            spearman(&pairs)
        };
        let (Some(as_is), Some(fit), Some(between)) = (
            pairs(|c| c.0, |c| c.1),
            pairs(|c| c.0, |c| c.2),
            pairs(|c| c.1, |c| c.2),
        ) else {
            continue;
        };
        let n = places.min(compared.len());
        judged.fit_as_is[camera.index()] = Some(as_is);
        judged.fit[camera.index()] = Some(fit);
        judged.score += compare(fit, as_is, between, n);
        judged.strength += fisher_z(fit, n);
        cameras += 1.0;
    }
    // Both cameras are independent: normal scores add up with the root of their number (Stouffer).
    let enough = cameras == 2.0 || (cameras == 1.0 && reading != Reading::Swapped);
    enough.then(|| Judged {
        score: judged.score / f64::sqrt(cameras),
        strength: judged.strength / cameras,
        ..judged
    })
}

fn compared(
    geometry: &StereoGeometry,
    path: &[&Touch<'_>],
    camera: CameraId,
    reading: Reading,
) -> Compared {
    let angle = |k: usize, at: Point2| {
        let model = &geometry.cameras[k];
        let angle = model.angle_of_point_deg(at) - model.skew_deg;
        (angle.abs() < MOST_ANGLE_DEG).then_some(angle)
    };
    let k = camera.index();
    let one = |(i, touch): (usize, &&Touch<'_>)| {
        let column = touch.sights[k].column?;
        let own = angle(k, touch.at())?;
        let other = match reading {
            Reading::AsIs => own,
            Reading::Swapped => angle(1 - k, touch.at())?,
            Reading::Mirrored { x, y, about } => {
                let at = touch.at();
                let flip = |v: f64, centre: f64, yes| if yes { 2.0 * centre - v } else { v };
                angle(
                    k,
                    Point2::new(flip(at.x_mm, about.x_mm, x), flip(at.y_mm, about.y_mm, y)),
                )?
            }
            Reading::Shifted(by) => {
                let there = usize::try_from(i as i64 + i64::from(by)).ok()?;
                angle(k, path.get(there)?.at())?
            }
        };
        Some((column, own, other))
    };
    path.iter().enumerate().filter_map(one).collect()
}

/// All centroids of a camera on one spot, though the presses are not: the usual column, and how far the columns (px)
/// and the angles (degrees) scatter in the median.
fn fixed_pixel(
    geometry: &StereoGeometry,
    path: &[&Touch<'_>],
    camera: CameraId,
) -> Option<[f64; 3]> {
    let seen = compared(geometry, path, camera, Reading::AsIs);
    if seen.len() < LEAST_PLACES {
        return None;
    }
    let spread = |values: Vec<f64>| {
        let middle = median(values.clone())?;
        let spread = median(values.iter().map(|v| (v - middle).abs()).collect())?;
        Some((middle, spread))
    };
    let (column, columns) = spread(seen.iter().map(|c| c.0).collect())?;
    let (_, angles) = spread(seen.iter().map(|c| c.1).collect())?;
    (columns < FIXED_PX && angles > LEAST_SPREAD_DEG).then_some([column, columns, angles])
}

fn on_a_fixed_pixel(fixed: [Option<[f64; 3]>; 2]) -> Option<Finding> {
    let (camera, [column, columns, angles], both) = match fixed {
        [None, None] => return None,
        [Some(one), None] => (Some(CameraId::One), one, ""),
        [None, Some(two)] => (Some(CameraId::Two), two, ""),
        [Some(one), Some(_)] => (None, one, "; the other camera likewise"),
    };
    let name = camera.unwrap_or(CameraId::One);
    let evidence = format!(
        "expected columns that move with the presses, found them within {columns:.1} px of column {column:.0} in the median \
         while the viewing angle scatters by {angles:.0} degrees ({name}{both})"
    );
    let law = Law::CentroidFollowsPosition;
    Some(finding(law, Fault::CameraBlind, camera, evidence))
}

/// A camera that follows neither by the nominal geometry nor by the one that located the presses.
fn not_following(
    analysis: &Analysis,
    path: &[&Touch<'_>],
    places: usize,
    camera: CameraId,
) -> Option<Finding> {
    let fit = |geometry: &StereoGeometry| {
        let seen = compared(geometry, path, camera, Reading::AsIs);
        let pairs: Vec<(f64, f64)> = seen.iter().map(|c| (c.0, c.1)).collect();
        Some((spearman(&pairs)?, pairs.len().min(places)))
    };
    let (nominal, n) = fit(&analysis.rig.nominal)?;
    let located = fit(&analysis.geometry).map_or(nominal, |f| f.0);
    if n < LEAST_PLACES {
        return None;
    }
    let error = 1.0 / (n as f64 - 3.0).sqrt();
    let below = |r: f64| fisher_z(r, n) + 2.0 * error < fisher_z(NOT_FOLLOWING, n) + error;
    (below(nominal) && below(located)).then(|| {
        let evidence = format!(
            "expected columns that follow the viewing angles in rank, found rank correlation {nominal:.2} ({camera}, n {n} \
             places), and no reading of the session that does better"
        );
        finding(Law::CentroidFollowsPosition, Fault::Unknown, Some(camera), evidence)
    })
}
