//! The certificate: points, residuals, and uncertainty at the presses for every map.

use std::cell::Cell;

use skinrig_model::AlignmentSettings;

use super::base::TimeBase;
use super::epoch_maps::{EpochMaps, pairs, trains};
use super::held_out::coverage;
use super::reading::Reading;
use super::smooth::SmoothMap;
use crate::metrics::quantile;
use crate::result::{ClockMap, Knot, LineCounts, MapName};
use skinrig_statistics::distributions::student_quantile;

impl TimeBase {
    pub(super) fn counts(&self, k: usize) -> LineCounts {
        let each = self.pieces.iter().filter_map(|p| p.cameras[k].as_ref());
        each.fold(LineCounts::default(), |sum, c| LineCounts {
            trains_sent: sum.trains_sent + c.counts.trains_sent,
            trains_seen: sum.trains_seen + c.counts.trains_seen,
            trains_unrecorded: sum.trains_unrecorded + c.counts.trains_unrecorded,
            sent: sum.sent + c.counts.sent,
            seen: sum.seen + c.counts.seen,
            lost: sum.lost + c.counts.lost,
            doubled: sum.doubled + c.counts.doubled,
            spurious: sum.spurious + c.counts.spurious,
        })
    }

    pub(super) fn knots(&self, k: usize) -> Vec<Knot> {
        let mut out = Vec::new();
        for piece in &self.pieces {
            let Some(camera) = &piece.cameras[k] else {
                continue;
            };
            let mut at = piece.host.knots_us.clone();
            at.extend(camera.map.knots());
            at.sort_by(f64::total_cmp);
            at.dedup();
            out.extend(at.into_iter().map(|box_us| Knot {
                host_us: piece.host.host_us(box_us),
                camera_us: camera.reference_us as f64 + camera.map.value(box_us),
            }));
        }
        out
    }

    pub(super) fn maps(&self, used_at_us: &[f64], limits: &AlignmentSettings) -> Vec<ClockMap> {
        let mut maps = Vec::new();
        if self.pieces.is_empty() {
            return maps;
        }
        let read = |map: ClockMap, of: &dyn Fn(&EpochMaps, f64) -> Option<Reading>| {
            let each = used_at_us.iter();
            let all: Vec<Reading> = each.filter_map(|at| of(self.at(*at)?, *at)).collect();
            let usual = |of: &dyn Fn(&Reading) -> f64| {
                let mut widths: Vec<f64> = all.iter().map(of).collect();
                let largest = widths.iter().copied().reduce(f64::max)?;
                Some((quantile(&mut widths, 0.5)?, largest))
            };
            // Consecutive readings share their degrees of freedom, and a quantile takes longer than all the rest.
            let last = Cell::new((f64::NAN, f64::NAN));
            let interval = |r: &Reading| {
                let (free, factor) = last.get();
                if free != r.free {
                    last.set((r.free, student_quantile(0.975, r.free)));
                    return r.se_us * last.get().1;
                }
                r.se_us * factor
            };
            ClockMap {
                interval_us: usual(&interval),
                bound_us: usual(&|r| r.bound_us),
                ..map
            }
        };
        let fits: Vec<&SmoothMap> = self.pieces.iter().map(|p| &p.host.fit).collect();
        maps.push(read(summary(MapName::HostFromBox, &fits), &|p, at| {
            Some(p.host_us_of_box(p.host.box_us(at)))
        }));
        for (k, name) in [(0, MapName::Camera1FromBox), (1, MapName::Camera2FromBox)] {
            let cameras = self.pieces.iter().filter_map(|p| p.cameras[k].as_ref());
            let fits: Vec<&SmoothMap> = cameras.map(|c| &c.map).collect();
            if fits.is_empty() {
                continue;
            }
            let held_out: Vec<(u32, u32)> = self
                .pieces
                .iter()
                .filter_map(|p| coverage(&trains(p, k)?))
                .collect();
            let map = covered(summary(name, &fits), &held_out);
            maps.push(read(map, &|p, at| p.camera_us_of_box(k, p.host.box_us(at))));
        }
        let between = self.pieces.iter().filter_map(|p| p.between.as_ref());
        let fits: Vec<&SmoothMap> = between.collect();
        if !fits.is_empty() {
            let pairs = self.pieces.iter().map(|p| pairs(&p.cameras));
            let held_out: Vec<(u32, u32)> = pairs.filter_map(|p| coverage(&p)).collect();
            let map = covered(summary(MapName::Camera2FromCamera1, &fits), &held_out);
            maps.push(read(map, &|p, at| {
                let one = p.cameras[0].as_ref()?;
                p.camera_2_of_camera_1(one.map.value(p.host.box_us(at)))
            }));
        }
        maps.push(ClockMap {
            bound_us: (!used_at_us.is_empty())
                .then_some((limits.robot_delay_us, limits.robot_delay_us)),
            ..summary(MapName::RobotFromHost, &[])
        });
        for (k, name) in [(0, MapName::Camera1FromHost), (1, MapName::Camera2FromHost)] {
            let Some(fit) = self.clocks[k] else { continue };
            let map = ClockMap {
                pieces: (self.knots(k).len().max(2) - 1) as u32,
                ..ClockMap::of_line(name, &fit)
            };
            maps.push(read(map, &|p, at| p.camera_us(k, at)));
        }
        maps
    }
}

fn covered(map: ClockMap, held_out: &[(u32, u32)]) -> ClockMap {
    let (inside, n) = held_out.iter().fold((0, 0), |s, h| (s.0 + h.0, s.1 + h.1));
    ClockMap {
        coverage: (n > 0).then(|| f64::from(inside) / f64::from(n)),
        coverage_n: n,
        ..map
    }
}

fn summary(map: MapName, fits: &[&SmoothMap]) -> ClockMap {
    let n: usize = fits.iter().map(|f| f.n()).sum();
    let all: usize = fits.iter().map(|f| f.used.len()).sum();
    let squares: f64 = fits
        .iter()
        .map(|f| f.rms_us * f.rms_us * f.n() as f64)
        .sum();
    let largest = fits.iter().map(|f| f.max_us).reduce(f64::max);
    ClockMap {
        map,
        pieces: fits
            .iter()
            .map(|f| f.knots().len() as u32 - 1)
            .sum::<u32>()
            .max(1),
        n: n as u32,
        rejected: (all - n) as u32,
        // From the epoch with the most points.
        drift_ppm: fits
            .iter()
            .max_by_key(|f| f.n())
            .map(|f| f.drift.value * 1e6),
        residual_rms_us: largest.map(|_| (squares / n as f64).sqrt()),
        residual_max_us: largest,
        interval_us: None,
        bound_us: None,
        coverage: None,
        coverage_n: 0,
    }
}
