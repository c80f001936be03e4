//! Law: a camera's centroid column follows the viewing angle of the press.
//!
//! The session is read in every way that has a name - cameras exchanged, an axis mirrored, rows shifted - and each reading is
//! judged by the cameras near the drawn ones that explain it best ([`super::readings`]). A reading that is much likelier than the
//! session as it is names the fault.

use skinrig_model::{CameraId, Point2};

use super::finding::finding;
use super::readings::{Judged, Path, Reading};
use super::resection::{residuals, spread_deg};
use super::segments::shifted_rest;
use super::statistics::median;
use super::touch::Touch;
use crate::result::{Analysis, Fault, Finding, Law};

/// Places that a statement needs; the drawn geometry makes up for few.
const LEAST_PLACES: usize = 3;
/// A reading is named when it is this much likelier than the session as it is, nats: 3000 to 1, where some forty are tried.
const CLEARLY: f64 = 8.0;
/// Streams follow the presses when they leave less than this share of what knowing nothing leaves.
const FOLLOWS: f64 = 1.0 / 3.0;
/// They do not when they leave more than this share.
const FOLLOWS_NOT: f64 = 0.7;
/// Places that it takes to say so.
const MANY_PLACES: usize = 6;
/// A camera this far from where it is drawn is worth a remark: four standard deviations of the prior, mm and degrees.
const FAR_MM: f64 = 20.0;
const FAR_DEG: f64 = 10.0;
/// Columns of a fixed pixel scatter less than this in the median, px.
const FIXED_PX: f64 = 2.0;
/// Angles must scatter more than this in the median for columns to have to move, degrees.
const LEAST_SPREAD_DEG: f64 = 5.0;
/// Two streams whose columns differ by less than this, px, at this share of the presses are one.
const SAME_PX: f64 = 0.5;
const SAME_SHARE: f64 = 0.9;
/// Located presses of another order cover the same area as the list: within this factor, each way.
const SAME_EXTENT: f64 = 1.5;

pub fn findings(analysis: &Analysis, touches: &[Touch<'_>]) -> Vec<Finding> {
    let path = Path::new(&analysis.rig, touches);
    if path.places < LEAST_PLACES {
        return Vec::new();
    }
    if path.places >= MANY_PLACES {
        let fixed = CameraId::ALL.map(|camera| fixed_pixel(&path, camera));
        if let Some(finding) = on_a_fixed_pixel(fixed) {
            return vec![finding];
        }
    }
    if let Some(finding) = one_camera_twice(touches) {
        return vec![finding];
    }
    let own = path.as_it_is();
    let as_is = path.judge(&own);
    if as_is.fits == [None; 2] {
        return Vec::new();
    }
    if let Some(finding) = another_reading(&path, &as_is) {
        return vec![finding];
    }
    if let Some(finding) = shifted_later(&path, &as_is) {
        return vec![finding];
    }
    if path.places < MANY_PLACES {
        return Vec::new();
    }
    let lost: Vec<CameraId> = CameraId::ALL
        .into_iter()
        .filter(|camera| does_not_follow(analysis, &path, &as_is, *camera))
        .collect();
    if !lost.is_empty() {
        return not_following(analysis, &path, &as_is, &lost);
    }
    CameraId::ALL
        .into_iter()
        .filter_map(|camera| far_off(&as_is, camera))
        .collect()
}

/// Both streams show the same columns.
fn one_camera_twice(touches: &[Touch<'_>]) -> Option<Finding> {
    let both = touches.iter().filter_map(|t| {
        let [one, two] = t.sights;
        Some((one.column? - two.column?).abs())
    });
    let off: Vec<f64> = both.collect();
    let same = off.iter().filter(|o| **o < SAME_PX).count();
    let n = off.len();
    (n >= LEAST_PLACES && same as f64 >= SAME_SHARE * n as f64).then(|| {
        let evidence = format!(
            "expected each camera to see a press in a column of its own, found the same column, within {SAME_PX} px, in {same} of {n} presses"
        );
        finding(
            Law::CentroidFollowsPosition,
            Fault::OneCameraTwice,
            None,
            evidence,
        )
    })
}

/// The likeliest other reading, when it is clearly likelier than the session as it is and explains it.
fn another_reading(path: &Path<'_>, as_is: &Judged<'_>) -> Option<Finding> {
    let mut readings = path.alternatives();
    readings.extend(path.displaced(as_is));
    readings.push(path.as_planned());
    let judged = readings.iter().map(|r| path.judge(r));
    let best = judged
        .filter(|j| j.follows(FOLLOWS))
        .min_by(|a, b| a.cost.total_cmp(&b.cost))?;
    let gain = as_is.cost - best.cost;
    let fault = best.reading.fault?;
    (gain > CLEARLY).then(|| {
        let evidence = format!(
            "expected columns on the viewing angles of the presses, found them {} off as the session is and {} off with {}: \
             odds of e^{gain:.0} (n {} places)",
            in_degrees(as_is),
            in_degrees(&best),
            best.reading.words,
            path.places
        );
        let mut found = finding(Law::CentroidFollowsPosition, fault, None, evidence);
        // The cameras bear the plan out, and not what was measured.
        found.invalidates = true;
        found
    })
}

/// Robust standard deviations of both streams about the cameras that explain them best.
fn in_degrees(judged: &Judged<'_>) -> String {
    let [one, two] = judged
        .fits
        .map(|f| f.map_or_else(|| "-".to_owned(), |f| format!("{:.1}", f.spread_deg)));
    format!("{one} and {two} degrees (cameras 1 and 2)")
}

/// A shift from some press on, in both streams or in one.
fn shifted_later(path: &Path<'_>, as_is: &Judged<'_>) -> Option<Finding> {
    let both = shifted_rest(path, as_is, &[0, 1]);
    let alone = [0, 1].map(|k| shifted_rest(path, as_is, &[k]));
    let (rest, camera) = match (both, alone) {
        // One stream that is shifted alone is a clock; the press list concerns both.
        (_, [Some(rest), None]) => (rest, Some(CameraId::One)),
        (_, [None, Some(rest)]) => (rest, Some(CameraId::Two)),
        (Some(rest), _) => (rest, None),
        _ => return None,
    };
    let fault = if camera.is_some() {
        Fault::ClockWrong
    } else {
        Fault::IndexShifted
    };
    let evidence = format!(
        "expected columns on the viewing angles of their own presses, found those from press {} on at the position {:+} rows on: \
         odds of e^{:.0} (n {} presses)",
        path.touches[rest.from].press,
        rest.by,
        rest.gain,
        path.touches.len() - rest.from
    );
    let mut found = finding(Law::CentroidFollowsPosition, fault, camera, evidence);
    found.invalidates = true;
    Some(found)
}

/// Neither the cameras near the drawn ones nor the calibrated ones explain the stream.
fn does_not_follow(
    analysis: &Analysis,
    path: &Path<'_>,
    as_is: &Judged<'_>,
    camera: CameraId,
) -> bool {
    let k = camera.index();
    let Some(fit) = as_is.fits[k] else {
        return false;
    };
    // Where most presses share one angle, as at one place pressed again and again, columns have no way to follow.
    if as_is.ignorance_deg[k] < LEAST_SPREAD_DEG {
        return false;
    }
    let limit = FOLLOWS_NOT * as_is.ignorance_deg[k];
    let calibrated = spread_deg(&residuals(
        &analysis.geometry.cameras[k],
        &columns(path, as_is.reading, k),
    ));
    fit.spread_deg > limit && calibrated.is_none_or(|spread| spread > limit)
}

fn columns(path: &Path<'_>, reading: &Reading, k: usize) -> Vec<(f64, Point2)> {
    let pairs = path.touches.iter().zip(&reading.at);
    pairs
        .filter_map(|(t, at)| Some((t.sights[k].column?, (*at)?)))
        .collect()
}

/// Presses whose columns have nothing to do with the positions: in another order, when the located ones cover the same area.
fn not_following(
    analysis: &Analysis,
    path: &Path<'_>,
    as_is: &Judged<'_>,
    lost: &[CameraId],
) -> Vec<Finding> {
    let law = Law::CentroidFollowsPosition;
    if lost.len() == 2 && covers_the_list(analysis, path) {
        let evidence = format!(
            "expected columns on the viewing angles of the presses, found them {} off, no better than in any order, while the \
             presses are located over the area of the list (n {} places)",
            in_degrees(as_is),
            path.places
        );
        return vec![finding(law, Fault::OrderOfPresses, None, evidence)];
    }
    let one = |camera: &CameraId| {
        let k = camera.index();
        let off = as_is.fits[k].map_or(f64::NAN, |f| f.spread_deg);
        let evidence = format!(
            "expected columns on the viewing angles of the presses, found them {off:.1} degrees off where knowing nothing leaves \
             {:.1} ({camera}, n {} places), and no reading of the session that does better",
            as_is.ignorance_deg[k], path.places
        );
        let mut found = finding(law, Fault::Unknown, Some(*camera), evidence);
        found.invalidates = true;
        found
    };
    lost.iter().map(one).collect()
}

/// The presses that the drawn cameras locate spread as far as the positions of the list, along both axes.
fn covers_the_list(analysis: &Analysis, path: &Path<'_>) -> bool {
    let (nominal, outline) = (&analysis.rig.nominal, &analysis.rig.outline);
    let located: Vec<Point2> = path
        .touches
        .iter()
        .filter_map(|t| {
            let columns = [t.sights[0].column, t.sights[1].column];
            crate::triangulate::locate(nominal, outline, columns).estimate()
        })
        .collect();
    let listed: Vec<Point2> = path.touches.iter().map(|t| t.at()).collect();
    let spread = |points: &[Point2], of: fn(&Point2) -> f64| {
        let middle = median(points.iter().map(of).collect())?;
        median(points.iter().map(|p| (of(p) - middle).abs()).collect())
    };
    let alike = |of: fn(&Point2) -> f64| match (spread(&located, of), spread(&listed, of)) {
        (Some(a), Some(b)) => a < SAME_EXTENT * b && b < SAME_EXTENT * a,
        _ => false,
    };
    2 * located.len() > listed.len() && alike(|p| p.x_mm) && alike(|p| p.y_mm)
}

/// A camera that stands elsewhere than it is drawn: the calibration makes up for it.
fn far_off(as_is: &Judged<'_>, camera: CameraId) -> Option<Finding> {
    let k = camera.index();
    let fit = as_is.fits[k]?;
    if fit.spread_deg >= FOLLOWS * as_is.ignorance_deg[k] {
        return None;
    }
    let [x, y, skew, ..] = fit.off;
    let far = libm::hypot(x, y) > FAR_MM || skew.abs() > FAR_DEG;
    far.then(|| {
        let evidence = format!(
            "expected {camera} within {FAR_MM} mm and {FAR_DEG} degrees of where the rig description draws it, found it about \
             ({x:+.0}, {y:+.0}) mm and {skew:+.0} degrees off"
        );
        finding(
            Law::CentroidFollowsPosition,
            Fault::GeometryOff,
            Some(camera),
            evidence,
        )
    })
}

/// All centroids of a camera on one spot, though the presses are not: the usual column, and how far the columns (px)
/// and the angles (degrees) scatter in the median.
fn fixed_pixel(path: &Path<'_>, camera: CameraId) -> Option<[f64; 3]> {
    let drawn = &path.rig.nominal.cameras[camera.index()];
    let seen = columns(path, &path.as_it_is(), camera.index());
    if seen.len() < MANY_PLACES {
        return None;
    }
    let spread = |values: Vec<f64>| {
        let middle = median(values.clone())?;
        let spread = median(values.iter().map(|v| (v - middle).abs()).collect())?;
        Some((middle, spread))
    };
    let (column, columns) = spread(seen.iter().map(|c| c.0).collect())?;
    let (_, angles) = spread(seen.iter().map(|c| drawn.angle_of_point_deg(c.1)).collect())?;
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
