//! One line of camera time over host time, and the mean rate that is its slope.

use super::epoch_maps::EpochMaps;
use super::smooth::Figure;
use crate::clock::line::{self, Pair};
use crate::leg::LegLine;
use crate::result::{ClockFit, ClockMethod};

/// One line of camera time over host time at all trains. Its slope is the mean rate from the first train to the last, from
/// the best-known leg.
pub(super) fn clock<'a>(
    pieces: impl Iterator<Item = &'a EpochMaps> + Clone,
    k: usize,
) -> Option<LegLine> {
    let reference_us = pieces
        .clone()
        .find_map(|p| p.cameras[k].as_ref())?
        .reference_us;
    let mut trains = Vec::new();
    let mut contradicted = 0;
    for piece in pieces.clone() {
        let Some(camera) = &piece.cameras[k] else {
            continue;
        };
        contradicted += camera.contradicted;
        let ahead = camera.reference_us.wrapping_sub(reference_us) as i64 as f64;
        for (box_us, at) in camera.sent_us.iter().zip(&camera.instants) {
            if let Some(at) = at {
                trains.push(Pair {
                    host_us: piece.host.host_us(*box_us),
                    camera_us: ahead + at,
                });
            }
        }
    }
    let line = line::fit(&trains, 1.0).ok()?;
    let drift = best_drift(pieces, k)?;
    let off = |t: &Pair| t.camera_us - t.host_us - drift.value * t.host_us;
    let used = || trains.iter().zip(&line.used).filter(|(_, used)| **used);
    let n = line.n() as f64;
    let offset_us = used().map(|(t, _)| off(t)).sum::<f64>() / n;
    let residuals = || used().map(|(t, _)| off(t) - offset_us);
    let fit = ClockFit {
        method: ClockMethod::TimeBase,
        offset_us: reference_us as f64 + offset_us,
        drift_ppm: drift.value * 1e6,
        drift_se_ppm: drift.stated_se() * 1e6,
        residual_rms_us: (residuals().map(|r| r * r).sum::<f64>() / n).sqrt(),
        residual_max_us: residuals().fold(0.0, |m, r| r.abs().max(m)),
        n: line.n() as u32,
        rejected: (trains.len() - line.n()) as u32 + contradicted,
    };
    let sum: f64 = trains.iter().map(|t| t.host_us).sum();
    Some(LegLine {
        fit,
        middle_us: sum / trains.len() as f64,
    })
}

/// Mean rate of camera over host time, from the best-known leg.
pub(super) fn best_drift<'a>(
    pieces: impl Iterator<Item = &'a EpochMaps>,
    k: usize,
) -> Option<Figure> {
    let mut legs: Vec<Vec<&EpochMaps>> = Vec::new();
    for piece in pieces.filter(|p| p.cameras[k].is_some()) {
        match legs.last_mut().filter(|of| of[0].leg == piece.leg) {
            Some(of) => of.push(piece),
            None => legs.push(vec![piece]),
        }
    }
    let drifts = legs.iter().filter_map(|leg| drift(leg, k));
    drifts.min_by(|a, b| a.stated_se().total_cmp(&b.stated_se()))
}

/// Mean rate of camera over host time in a leg, from the first train to the last. Its error is mostly that of the host's
/// slope; an asymmetric delay shifts both ends alike.
pub(super) fn drift(leg: &[&EpochMaps], k: usize) -> Option<Figure> {
    let (first, last) = (leg.first()?, leg.last()?);
    let (from, to) = (first.cameras[k].as_ref()?, last.cameras[k].as_ref()?);
    let (x0, x1) = (from.map.span_us().0, to.map.span_us().1);
    let ahead = to.reference_us.wrapping_sub(from.reference_us) as i64 as f64;
    let camera_us = ahead + to.map.value(x1) - from.map.value(x0);
    let host_us = last.host.host_us(x1) - first.host.host_us(x0);
    let value = (camera_us - host_us) / host_us;
    if host_us.is_nan() || host_us <= 0.0 {
        return None;
    }
    let both = if leg.len() == 1 {
        from.map.drift.less(first.host.drift((x0, x1))?)
    } else {
        // The errors of the two ends are independent.
        let ends = from.at(x0).less(first.host.at(x0));
        let ends = ends.less(to.at(x1).less(last.host.at(x1)));
        Figure {
            se: ends.se / host_us,
            ..ends
        }
    };
    Some(Figure { value, ..both })
}
