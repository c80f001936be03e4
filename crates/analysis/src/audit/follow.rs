//! Law: a camera's centroid column follows the viewing angle of the press.
//!
//! The audit interprets the session in every known way (cameras swapped, an axis mirrored, rows shifted, ...) and scores
//! each reading by the best-fitting cameras near the nominal ones ([`super::readings`]). A reading that is much likelier
//! than the session as recorded identifies the fault.

use skinrig_model::{CameraId, Point2};

use super::exchanged::exchanged_rows;
use super::finding::finding;
use super::fixed_pixel;
use super::observed_press::ObservedPress;
use super::permuted::permuted_rows;
use super::readings::{MIN_SPREAD_DEG, Path, Reading, ScoredReading, scatter_deg};
use super::rearranged::{MIN_GAIN, RearrangedRows, rearranged_rows};
use super::resection::{MAX_PLACES, residuals, spread_deg};
use super::scale::stretched;
use super::segments::{ShiftedSegment, locally_shifted_segment, shifted_segment};
use super::statistics::median;
use crate::result::{Analysis, Evidence, Fault, Finding, Law};

/// Minimum number of locations for a statement; the nominal geometry compensates for a small number.
const MIN_PLACES: usize = 3;
/// A reading must be this much likelier than the session as recorded, nats: 3000 to 1, because about forty are compared.
const CLEARLY: f64 = 8.0;
/// And a displaced list so much per location that counts, nats: residuals a quarter smaller in both cameras. What a skin bends in one place
/// it bends beside it too, as if the list were elsewhere.
const DISPLACED_PER_PLACE: f64 = 0.6;
/// Streams follow the presses if their residual is below this share of the ignorance residual.
const FOLLOWS: f64 = 1.0 / 3.0;
/// They do not follow if it is above this share.
const FOLLOWS_NOT: f64 = 0.7;
/// Minimum number of locations to state that.
const MANY_PLACES: usize = 6;
/// Distance from the nominal camera worth a finding: four standard deviations of the prior, mm and degrees.
const FAR_MM: f64 = 20.0;
const FAR_DEG: f64 = 10.0;
/// Two streams are identical if their columns differ by less than this, px, at this share of the presses.
const SAME_PX: f64 = 0.5;
const SAME_SHARE: f64 = 0.9;
/// Presses in another order cover the same area as the list, within this factor along each axis.
const SAME_EXTENT: f64 = 1.5;

pub(super) fn findings(analysis: &Analysis, presses_seen: &[ObservedPress<'_>]) -> Vec<Finding> {
    let path = Path::new(&analysis.rig, presses_seen);
    if path.places < MIN_PLACES {
        return Vec::new();
    }
    if path.places >= MANY_PLACES {
        let fixed = fixed_pixel::findings(&path);
        if !fixed.is_empty() {
            return fixed;
        }
    }
    if let Some(finding) = one_camera_twice(presses_seen) {
        return vec![finding];
    }
    let own = path.as_it_is();
    let as_is = path.score(&own);
    if as_is.fits == [None; 2] {
        return Vec::new();
    }
    // A smaller scale makes the residuals of any wrong list smaller: these readings come after all others.
    let stretched = || stretched(&path, &as_is, as_is.follows(FOLLOWS));
    let mut readings = path.alternatives();
    readings.extend(path.displaced(&as_is));
    readings.push(path.as_planned());
    readings.extend(path.streams_apart());
    if let Some((fault, best)) = likelier(&path, &as_is, &readings) {
        // Cameras on one side of the skin see another scale much as another origin.
        let stretched = match fault {
            Fault::PositionsDisplaced => stretched(),
            _ => Vec::new(),
        };
        let (fault, best) = likelier(&path, &best, &stretched).unwrap_or((fault, best));
        return vec![other_reading(&path, &as_is, &best, fault)];
    }
    if let Some(finding) = shifted_later(&path, |cameras| shifted_segment(&path, &as_is, cameras)) {
        return vec![finding];
    }
    if path.places < MANY_PLACES {
        return Vec::new();
    }
    if let Some(found) = rearranged_rows(&path, &as_is) {
        return vec![rearranged(&path, &found)];
    }
    if let Some((fault, best)) = likelier(&path, &as_is, &stretched()) {
        return vec![other_reading(&path, &as_is, &best, fault)];
    }
    let lost: Vec<CameraId> = CameraId::ALL
        .into_iter()
        .filter(|camera| does_not_follow(analysis, &path, &as_is, *camera))
        .collect();
    // Columns that follow nothing may have two faults, which another order of few rows fits in part.
    let least = if lost.is_empty() {
        MIN_GAIN
    } else {
        2.0 * MIN_GAIN
    };
    let other_order =
        || permuted_rows(&path, &as_is, least).or_else(|| exchanged_rows(&path, &as_is, least));
    if let Some(found) = other_order() {
        return vec![rearranged(&path, &found)];
    }
    if !lost.is_empty() {
        return not_following(analysis, &path, &as_is, &lost);
    }
    // Neighbours of a press tell a step of the path only where both streams follow the presses.
    if as_is.follows(FOLLOWS) {
        let locally = |cameras: &[usize]| locally_shifted_segment(&path, &as_is, cameras);
        if let Some(finding) = shifted_later(&path, locally) {
            return vec![finding];
        }
    }
    CameraId::ALL
        .into_iter()
        .filter_map(|camera| far_off(analysis, &path, &as_is, camera))
        .collect()
}

/// Both streams have the same columns.
fn one_camera_twice(presses_seen: &[ObservedPress<'_>]) -> Option<Finding> {
    let both = presses_seen.iter().filter_map(|t| {
        let [one, two] = t.sights;
        Some((one.column? - two.column?).abs())
    });
    let off: Vec<f64> = both.collect();
    let same = off.iter().filter(|o| **o < SAME_PX).count();
    let n = off.len();
    (n >= MIN_PLACES && same as f64 >= SAME_SHARE * n as f64).then(|| {
        let evidence = Evidence::SameColumns {
            within_px: SAME_PX,
            same,
            presses: n,
        };
        finding(
            Law::CentroidFollowsPosition,
            Fault::OneCameraTwice,
            None,
            evidence,
        )
    })
}

/// The likeliest of these readings, if it is clearly likelier than `than` and explains the session, with its fault.
fn likelier<'a>(
    path: &Path<'_>,
    than: &ScoredReading<'_>,
    readings: &'a [Reading],
) -> Option<(Fault, ScoredReading<'a>)> {
    let judged = readings.iter().map(|r| path.score(r));
    let reorders = |j: &ScoredReading<'_>| {
        let fault = j.reading.fault;
        matches!(fault, Some(Fault::OrderOfPresses | Fault::IndexShifted))
    };
    let best = judged
        .filter(|j| j.follows(FOLLOWS))
        .filter(|j| !reorders(j) || path.moved_presses_prefer(than, j))
        .min_by(|a, b| a.cost.total_cmp(&b.cost))?;
    let fault = best.reading.fault?;
    let per_place = match fault {
        Fault::PositionsDisplaced => DISPLACED_PER_PLACE,
        _ => 0.0,
    };
    let least = CLEARLY.max(per_place * MAX_PLACES.min(path.places as f64));
    (than.cost - best.cost > least).then_some((fault, best))
}

/// The session as recorded has this fault: another reading explains it.
fn other_reading(
    path: &Path<'_>,
    as_is: &ScoredReading<'_>,
    best: &ScoredReading<'_>,
    fault: Fault,
) -> Finding {
    let evidence = Evidence::OtherReading {
        off_deg: off_deg(as_is),
        other_off_deg: off_deg(best),
        reading: best.reading.what,
        log_odds: as_is.cost - best.cost,
        places: path.places,
    };
    let mut found = finding(Law::CentroidFollowsPosition, fault, None, evidence);
    // The cameras confirm the plan instead of the measurement.
    found.invalidates = true;
    found
}

/// Robust standard deviations of both streams about their best-fitting cameras.
fn off_deg(judged: &ScoredReading<'_>) -> [Option<f64>; 2] {
    judged.fits.map(|f| f.map(|f| f.spread_deg))
}

/// A shift that starts at some press, in both streams or in one, of what `segment` finds in the streams of some cameras.
fn shifted_later(
    path: &Path<'_>,
    segment: impl Fn(&[usize]) -> Option<ShiftedSegment>,
) -> Option<Finding> {
    let both = segment(&[0, 1]);
    let alone = [0, 1].map(|k| segment(&[k]));
    let (rest, camera) = match (both, alone) {
        // A shift in one stream is a clock fault; a faulty press list shifts both.
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
    let evidence = Evidence::ShiftedRest {
        from: path.presses_seen[rest.from].press,
        rows: rest.by,
        log_odds: rest.gain,
        presses: rest.to - rest.from,
    };
    let mut found = finding(Law::CentroidFollowsPosition, fault, camera, evidence);
    found.invalidates = true;
    Some(found)
}

/// Rows of the list in another order, in both streams.
fn rearranged(path: &Path<'_>, found: &RearrangedRows) -> Finding {
    let press = |i: usize| path.presses_seen[i].press;
    let evidence = Evidence::RearrangedRows {
        from: press(found.from),
        to: press(found.to),
        rows: found.rows,
        log_odds: found.gain,
    };
    let law = Law::CentroidFollowsPosition;
    let mut found = finding(law, Fault::OrderOfPresses, None, evidence);
    found.invalidates = true;
    found
}

/// Neither cameras near the nominal ones nor the calibrated ones explain the stream.
fn does_not_follow(
    analysis: &Analysis,
    path: &Path<'_>,
    as_is: &ScoredReading<'_>,
    camera: CameraId,
) -> bool {
    let k = camera.index();
    let Some(fit) = as_is.fits[k] else {
        return false;
    };
    // If most presses share one angle, for instance at a single location, columns cannot follow it; but then they do not move either.
    if as_is.ignorance_deg[k].max(fit.spread_deg) < MIN_SPREAD_DEG {
        return false;
    }
    let limit = FOLLOWS_NOT * as_is.ignorance_deg[k];
    let calibrated = spread_deg(&residuals(
        &analysis.geometry.cameras[k],
        &columns(path, as_is.reading, k),
    ));
    fit.spread_deg > limit && calibrated.is_none_or(|spread| spread > limit)
}

/// Difference of a calibrated camera whose columns follow the positions from the nominal one: x and y, mm, and skew, degrees.
fn calibrated_off(
    analysis: &Analysis,
    path: &Path<'_>,
    as_is: &ScoredReading<'_>,
    k: usize,
) -> Option<[f64; 3]> {
    let (nominal, calibrated) = (
        &analysis.rig.nominal.cameras[k],
        &analysis.geometry.cameras[k],
    );
    let pairs = columns(path, as_is.reading, k);
    let spread = spread_deg(&residuals(calibrated, &pairs))?;
    let follows = spread < FOLLOWS * scatter_deg(calibrated, &pairs);
    follows.then_some([
        calibrated.position.x_mm - nominal.position.x_mm,
        calibrated.position.y_mm - nominal.position.y_mm,
        calibrated.skew_deg - nominal.skew_deg,
    ])
}

fn columns(path: &Path<'_>, reading: &Reading, k: usize) -> Vec<(f64, Point2)> {
    let pairs = path.presses_seen.iter().zip(&reading.at);
    pairs
        .filter_map(|(t, at)| Some((t.sights[k].column?, (*at)?)))
        .collect()
}

/// Presses whose columns are unrelated to the positions. If the located presses cover the same area, their order is wrong.
fn not_following(
    analysis: &Analysis,
    path: &Path<'_>,
    as_is: &ScoredReading<'_>,
    lost: &[CameraId],
) -> Vec<Finding> {
    let law = Law::CentroidFollowsPosition;
    if lost.len() == 2 && covers_the_list(analysis, path) {
        let evidence = Evidence::RandomOrder {
            off_deg: off_deg(as_is),
            places: path.places,
        };
        return vec![finding(law, Fault::OrderOfPresses, None, evidence)];
    }
    let one = |camera: &CameraId| {
        let k = camera.index();
        let evidence = Evidence::Unrelated {
            camera: *camera,
            off_deg: as_is.fits[k]?.spread_deg,
            guess_deg: as_is.ignorance_deg[k],
            places: path.places,
        };
        let mut found = finding(law, Fault::Unknown, Some(*camera), evidence);
        found.invalidates = true;
        Some(found)
    };
    lost.iter().filter_map(one).collect()
}

/// True if the presses located with the nominal cameras spread as far as the listed positions, along both axes.
fn covers_the_list(analysis: &Analysis, path: &Path<'_>) -> bool {
    let (nominal, outline) = (&analysis.rig.nominal, &analysis.rig.outline);
    let located: Vec<Point2> = path
        .presses_seen
        .iter()
        .filter_map(|t| {
            let columns = [t.sights[0].column, t.sights[1].column];
            crate::triangulate::locate(nominal, outline, columns).estimate()
        })
        .collect();
    let listed: Vec<Point2> = path.presses_seen.iter().map(|t| t.at()).collect();
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

/// A camera far from its nominal position, by the fit near it or else by the calibration, which compensates for it.
fn far_off(
    analysis: &Analysis,
    path: &Path<'_>,
    as_is: &ScoredReading<'_>,
    camera: CameraId,
) -> Option<Finding> {
    let k = camera.index();
    let fit = as_is.fits[k]?;
    let [x, y, skew] = if fit.spread_deg < FOLLOWS * as_is.ignorance_deg[k] {
        [fit.off[0], fit.off[1], fit.off[2]]
    } else {
        calibrated_off(analysis, path, as_is, k)?
    };
    let far = libm::hypot(x, y) > FAR_MM || skew.abs() > FAR_DEG;
    far.then(|| {
        let evidence = Evidence::CameraFar {
            camera,
            limit_mm: FAR_MM,
            limit_deg: FAR_DEG,
            off_mm: [x, y],
            skew_deg: skew,
        };
        finding(
            Law::CentroidFollowsPosition,
            Fault::GeometryOff,
            Some(camera),
            evidence,
        )
    })
}
