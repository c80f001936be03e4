//! Residuals of each map, thinned for drawing.

use super::base::TimeBase;
use super::epoch_maps::EpochMaps;
use crate::result::{ClockResidual, ClockResiduals, MapName};
use crate::timebase::smooth::SmoothMap;

/// Maximum number of points per map.
const MOST: usize = 600;

impl TimeBase {
    /// Residuals of every fitted map, in the order of the certificate.
    pub(super) fn residuals(&self) -> Vec<ClockResiduals> {
        let of_host = |p: &EpochMaps| left(p, &p.host.fit, |at| at);
        let of_camera = |k: usize| {
            let each = self.pieces.iter();
            each.filter_map(move |p| Some(left(p, &p.cameras[k].as_ref()?.map, |at| at)))
        };
        let maps = [
            (
                MapName::HostFromBox,
                self.pieces.iter().flat_map(of_host).collect(),
            ),
            (MapName::Camera1FromBox, of_camera(0).flatten().collect()),
            (MapName::Camera2FromBox, of_camera(1).flatten().collect()),
            (
                MapName::Camera2FromCamera1,
                self.pieces.iter().flat_map(of_cameras).collect(),
            ),
            (MapName::Camera1FromHost, self.of_line(0)),
            (MapName::Camera2FromHost, self.of_line(1)),
        ];
        let there = maps.into_iter().filter(|(_, points)| !points.is_empty());
        there
            .map(|(map, points)| ClockResiduals {
                map,
                n: points.len() as u32,
                points: thinned(points),
            })
            .collect()
    }

    /// Trains of camera `k` relative to one line through all of them.
    fn of_line(&self, k: usize) -> Vec<ClockResidual> {
        let Some(line) = self.clocks[k] else {
            return Vec::new();
        };
        let of = |p: &EpochMaps| {
            let Some(camera) = &p.cameras[k] else {
                return Vec::new();
            };
            let trains = camera.sent_us.iter().zip(&camera.instants);
            let seen = trains.filter_map(|(sent, at)| Some((p.host.host_us(*sent), (*at)?)));
            seen.map(|(host_us, at)| ClockResidual {
                host_s: host_us * 1e-6,
                residual_us: camera.reference_us as f64 + at - line.camera_us(host_us),
                used: true,
            })
            .collect()
        };
        self.pieces.iter().flat_map(of).collect()
    }
}

/// Residuals of a fit over box time; `box_us` converts from the fit's own clock.
fn left(piece: &EpochMaps, fit: &SmoothMap, box_us: impl Fn(f64) -> f64) -> Vec<ClockResidual> {
    let points = fit.residuals.iter().zip(&fit.used);
    points
        .map(|((at, residual_us), used)| ClockResidual {
            host_s: piece.host.host_us(box_us(*at)) * 1e-6,
            residual_us: *residual_us,
            used: *used,
        })
        .collect()
}

/// Camera 2 over camera 1 at the trains that both saw.
fn of_cameras(piece: &EpochMaps) -> Vec<ClockResidual> {
    let (Some(fit), Some(one)) = (&piece.between, &piece.cameras[0]) else {
        return Vec::new();
    };
    // Accurate enough for drawing: the deviation is nearly the same at both times.
    left(piece, fit, |at| at - (one.map.value(at) - at))
}

/// Every n-th and the largest of the used points, and every n-th of the rejected ones, in time order.
fn thinned(points: Vec<ClockResidual>) -> Vec<ClockResidual> {
    let (used, left_out): (Vec<ClockResidual>, Vec<ClockResidual>) =
        points.into_iter().partition(|p| p.used);
    let size = |p: &ClockResidual| p.residual_us.abs();
    let largest = (0..used.len()).max_by(|a, b| size(&used[*a]).total_cmp(&size(&used[*b])));
    let each = |of: &[ClockResidual]| of.len().div_ceil(MOST).max(1);
    let step = each(&used);
    let drawn = |k: &usize| k.is_multiple_of(step) || Some(*k) == largest;
    let some = (0..used.len()).filter(drawn).map(|k| used[k]);
    let mut kept: Vec<ClockResidual> = some.collect();
    kept.extend(left_out.iter().step_by(each(&left_out)));
    kept.sort_by(|a, b| a.host_s.total_cmp(&b.host_s));
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_order_and_extremes() {
        let residual_us = |k: u32| match k {
            4001 => -90.0,
            4002 => 9.0,
            k => f64::from(k % 7) - 3.0,
        };
        let points = (0..5006).map(|k| ClockResidual {
            host_s: f64::from(k),
            residual_us: residual_us(k),
            used: k != 4001,
        });
        let kept = thinned(points.collect());
        assert!((500..=602).contains(&kept.len()), "{}", kept.len());
        assert!(kept.is_sorted_by_key(|p| p.host_s));
        let at = |host_s: f64| kept.iter().find(|p| p.host_s == host_s);
        assert!(at(4001.0).is_some_and(|p| !p.used) && at(4002.0).is_some());
        // The others are drawn as they come: as many near zero as there are.
        let near = kept.iter().filter(|p| p.residual_us == 0.0).count();
        assert!((60..=110).contains(&near), "{near}");
    }
}
