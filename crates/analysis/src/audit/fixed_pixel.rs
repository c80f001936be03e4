//! Law: a camera's columns move with the presses, throughout the session.
//!
//! A stuck pixel or column, or a constant picture, gives every press a column that says nothing about its position. The
//! centroids count whether or not the press stands out of the noise, because the analysis locates with all of them.

use std::ops::Range;

use skinrig_model::{CameraId, PressId};

use super::finding::finding;
use super::readings::{MIN_SPREAD_DEG, Path};
use super::statistics::median;
use crate::distinct::distinct;
use crate::result::{Evidence, Fault, Finding, Law};
use crate::stretch::prevailing;

/// Columns of a fixed pixel scatter by less than this, px.
const FIXED_PX: f64 = 2.0;
/// Minimum number of presses for a statement.
const MIN_PRESSES: usize = 6;
/// Minimum share of a fixed stretch in all presses with a centroid,
const MIN_SHARE: f64 = 0.1;
/// and weight of a press elsewhere in it, against 1 of a press on the pixel.
const ELSEWHERE: i64 = 3;

/// Presses of the path with a centroid: press, column, viewing angle by the nominal camera.
type Columns = Vec<(PressId, f64, f64)>;

pub(super) fn findings(path: &Path<'_>) -> Vec<Finding> {
    let columns = CameraId::ALL.map(|camera| columns(path, camera));
    let law = Law::CentroidFollowsPosition;
    let found = |camera, evidence| {
        let mut found = finding(law, Fault::CameraBlind, camera, evidence);
        // The presses were located with columns that are not theirs.
        found.invalidates = true;
        found
    };
    let whole = columns.each_ref().map(whole_session);
    let both = whole.iter().all(Option::is_some);
    if let Some((camera, fixed)) = CameraId::ALL
        .into_iter()
        .zip(whole)
        .find_map(|(c, fixed)| Some((c, fixed?)))
    {
        let evidence = Evidence::FixedColumn {
            camera,
            within_px: fixed.within_px,
            column_px: fixed.column_px,
            angle_deg: fixed.angle_deg,
            both,
        };
        return vec![found((!both).then_some(camera), evidence)];
    }
    let stretches = CameraId::ALL.into_iter().zip(&columns);
    stretches
        .filter_map(|(camera, own)| {
            let fixed = own.get(longest_stretch(own)?)?;
            let evidence = Evidence::FixedStretch {
                camera,
                first: fixed.first()?.0,
                last: fixed.last()?.0,
                column_px: median(fixed.iter().map(|c| c.1).collect())?,
                angle_deg: scatter(fixed.iter().map(|c| c.2).collect())?.1,
                presses: fixed.len(),
            };
            Some(found(Some(camera), evidence))
        })
        .collect()
}

fn columns(path: &Path<'_>, camera: CameraId) -> Columns {
    let drawn = &path.rig.nominal.cameras[camera.index()];
    let seen = path.presses_seen.iter();
    seen.filter_map(|t| {
        let column = t.sights[camera.index()].centroid?;
        Some((t.press, column, drawn.angle_of_point_deg(t.at())))
    })
    .collect()
}

/// A camera whose columns do not move although the presses do.
#[derive(Debug, Clone, Copy)]
struct FixedColumns {
    column_px: f64,
    within_px: f64,
    angle_deg: f64,
}

fn whole_session(columns: &Columns) -> Option<FixedColumns> {
    if columns.len() < MIN_PRESSES {
        return None;
    }
    let (column_px, within_px) = scatter(columns.iter().map(|c| c.1).collect())?;
    let (_, angle_deg) = scatter(columns.iter().map(|c| c.2).collect())?;
    (within_px < FIXED_PX && angle_deg > MIN_SPREAD_DEG).then_some(FixedColumns {
        column_px,
        within_px,
        angle_deg,
    })
}

/// Median, and median distance from it.
fn scatter(values: Vec<f64>) -> Option<(f64, f64)> {
    let middle = median(values.clone())?;
    let distance = median(values.iter().map(|v| (v - middle).abs()).collect())?;
    Some((middle, distance))
}

/// The stretch that prevails on one column, and whose presses have different angles.
fn longest_stretch(columns: &Columns) -> Option<Range<usize>> {
    let least = MIN_PRESSES.max((MIN_SHARE * columns.len() as f64).ceil() as usize) as i64;
    let candidates = distinct(columns.iter().map(|c| libm::round(c.1) as i64));
    let stretches = candidates.into_iter().filter_map(|column| {
        let at = columns
            .iter()
            .map(|c| (c.1 - column as f64).abs() < FIXED_PX);
        let (sum, stretch) = prevailing(at, ELSEWHERE);
        let (_, angle_deg) = scatter(columns[stretch.clone()].iter().map(|c| c.2).collect())?;
        (sum >= least && angle_deg > MIN_SPREAD_DEG).then_some((sum, stretch))
    });
    Some(stretches.max_by_key(|s| s.0)?.1)
}
