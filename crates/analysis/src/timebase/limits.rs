//! Checks the limits of the certificate: untimed presses, and values beyond the settings.

use skinrig_model::{AlignmentSettings, CameraId, HostTime};

use super::base::{TimeBase, TimeBaseInput};
use super::drifting::{drifting, drifts};
use crate::leg::{leg_at, recorded_of};
use crate::result::{
    Alignment, AlignmentViolation, ClockMap, LineCounts, MapName, Warning, WarningCause,
};

/// Minimum number of held-out points to check coverage: with fewer, two misses are not evidence.
const MIN_HELD_OUT: u32 = 40;

impl TimeBase {
    /// Instants that are close enough to ties of every clock.
    pub(super) fn timed(&self, used_at_us: &[f64], limits: &AlignmentSettings) -> Vec<f64> {
        let far = |k: usize, at: f64| self.is_untimed(k, at, limits);
        let each = used_at_us.iter().copied();
        each.filter(|at| !far(0, *at) && !far(1, *at)).collect()
    }

    fn is_untimed(&self, k: usize, host_us: f64, limits: &AlignmentSettings) -> bool {
        let tie = self.tie_distance_us(k, host_us);
        tie.is_some_and(|(_, distance)| distance > limits.max_tie_distance_us)
    }

    /// Warns about contacts and releases that the clock of `camera` does not time. Too many while it was recording make
    /// the session invalid; a camera that was not recording is not a clock fault.
    pub(super) fn judge_untimed(
        &self,
        camera: CameraId,
        ties: &TimeBaseInput<'_>,
        limits: &AlignmentSettings,
        warnings: &mut Vec<Warning>,
        violations: &mut Vec<AlignmentViolation>,
    ) {
        let k = camera.index();
        let is_recorded = |host_us: f64| {
            let leg = leg_at(ties.legs, HostTime((host_us * 1e3) as i64));
            let spans = recorded_of(ties.recorded[k], ties.legs, leg, k);
            let at = self.camera_us(k, host_us).map_or(f64::NAN, |r| r.us);
            let holds = |(from, to): &(u64, u64)| (*from as f64..=*to as f64).contains(&at);
            ties.recorded[k].is_empty() || spans.iter().any(holds)
        };
        let far = ties.used_at_us.iter().copied();
        let far: Vec<f64> = far.filter(|at| self.is_untimed(k, *at, limits)).collect();
        if far.is_empty() {
            return;
        }
        let all = ties.used_at_us.len();
        let limit_s = limits.max_tie_distance_us * 1e-6;
        let untimed = WarningCause::PressesFarFromTies {
            instants: far.len(),
            of: all,
            limit_s,
        };
        warnings.push(Warning::of_camera(camera, untimed));
        let lost = far.iter().filter(|at| is_recorded(**at)).count() as f64 / all as f64;
        if lost > limits.max_lost {
            violations.push(AlignmentViolation::FarFromTies {
                camera,
                tie_limit_s: limit_s,
                limit_percent: 100.0 * limits.max_lost,
                found_percent: 100.0 * lost,
            });
        }
    }

    /// Exceeded limits.
    pub(super) fn beyond(
        &self,
        alignment: &Alignment,
        limits: &AlignmentSettings,
    ) -> Vec<AlignmentViolation> {
        let off_line = [0, 1].map(|k| self.off_line(k));
        let drifts = [0, 1].map(|k| drifts(k, off_line[k], alignment, limits));
        let maps = alignment
            .maps
            .iter()
            .flat_map(|map| map_beyond(map, limits));
        let lines = alignment.lines.iter().zip(CameraId::ALL).zip(drifts);
        // Trains away from the line are neither lost nor spurious.
        let lines = lines.filter(|(_, drifts)| !drifts);
        drifting(drifts, off_line, alignment)
            .into_iter()
            .chain(maps)
            .chain(lines.flat_map(|((line, camera), _)| line_beyond(camera, line, limits)))
            .collect()
    }
}

/// Exceeded limits of one map.
fn map_beyond(
    clocks: &ClockMap,
    limits: &AlignmentSettings,
) -> impl Iterator<Item = AlignmentViolation> {
    let map = clocks.map;
    let by_trains = matches!(
        map,
        MapName::Camera1FromBox | MapName::Camera2FromBox | MapName::Camera2FromCamera1
    );
    let residuals = clocks.residual_rms_us.filter(|_| by_trains);
    let residuals = residuals.filter(|rms_us| *rms_us > limits.max_residual_us);
    let residuals = residuals.map(|found_us| AlignmentViolation::Residuals {
        map,
        limit_us: limits.max_residual_us,
        found_us,
    });
    let interval = clocks
        .interval_us
        .zip(clocks.bound_us)
        .filter(|_| by_trains);
    let interval = interval.map(|((_, noise), (_, bound))| noise + bound);
    let interval = interval.filter(|sum_us| *sum_us > limits.max_camera_interval_us);
    let interval = interval.map(|found_us| AlignmentViolation::Interval {
        map,
        limit_us: limits.max_camera_interval_us,
        found_us,
    });
    let coverage = clocks.coverage.filter(|_| by_trains);
    let coverage = coverage.filter(|_| clocks.coverage_n >= MIN_HELD_OUT);
    let coverage = coverage.and_then(|share| {
        // Chance alone leaves some outside.
        let least = limits.min_coverage;
        let error = (least * (1.0 - least) / f64::from(clocks.coverage_n)).sqrt();
        let limit_percent = 100.0 * (1.0 - least + 3.0 * error);
        let found_percent = 100.0 * (1.0 - share);
        (found_percent > limit_percent).then_some(AlignmentViolation::Coverage {
            map,
            limit_percent,
            found_percent,
        })
    });
    let bound = clocks.bound_us.filter(|_| map == MapName::HostFromBox);
    let bound = bound.map(|(_, largest)| largest);
    let bound = bound.filter(|largest| *largest > limits.max_host_interval_us);
    let bound = bound.map(|found_us| AlignmentViolation::Bound {
        map,
        limit_us: limits.max_host_interval_us,
        found_us,
    });
    let drift = clocks.drift_ppm.map(f64::abs);
    let drift = drift.filter(|ppm| *ppm > limits.max_drift_ppm);
    let drift = drift.map(|found_ppm| AlignmentViolation::Drift {
        map,
        limit_ppm: limits.max_drift_ppm,
        found_ppm,
    });
    [residuals, interval, coverage, bound, drift]
        .into_iter()
        .flatten()
}

/// Exceeded limits of the trigger input of one camera.
fn line_beyond(
    camera: CameraId,
    line: &LineCounts,
    limits: &AlignmentSettings,
) -> impl Iterator<Item = AlignmentViolation> {
    let lost = line.share(line.lost);
    let lost = (lost > limits.max_lost).then_some(AlignmentViolation::LostEdges {
        camera,
        limit_percent: 100.0 * limits.max_lost,
        found_percent: 100.0 * lost,
    });
    let extra = line.share(line.doubled + line.spurious);
    let extra = (extra > limits.max_spurious).then_some(AlignmentViolation::ExtraEdges {
        camera,
        limit_percent: 100.0 * limits.max_spurious,
        found_percent: 100.0 * extra,
    });
    [lost, extra].into_iter().flatten()
}
