//! Checks the limits of the certificate: untimed presses, and values beyond the settings.

use skinrig_model::{AlignmentSettings, HostTime};

use super::base::{TimeBase, TimeBaseInput};
use super::drifting::{drifting, drifts};
use crate::leg::{leg_at, recorded_of};
use crate::result::{Alignment, MapName};

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

    /// Warns about contacts and releases that the clock of camera `k` does not time. Too many while it was recording make
    /// the session invalid; a camera that was not recording is not a clock fault.
    pub(super) fn judge_untimed(
        &self,
        k: usize,
        ties: &TimeBaseInput<'_>,
        limits: &AlignmentSettings,
        warnings: &mut Vec<String>,
        violations: &mut Vec<String>,
    ) {
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
        warnings.push(format!(
            "camera {}: {} of {all} contacts and releases are more than {limit_s} s from the nearest train seen or the \
             nearest exchange with the box; their presses are not timed",
            k + 1,
            far.len()
        ));
        let lost = far.iter().filter(|at| is_recorded(**at)).count() as f64 / all as f64;
        if lost > limits.max_lost {
            violations.push(format!(
                "camera {} from host, contacts and releases without a tie within {limit_s} s: expected at most {} %, found {:.1} %",
                k + 1,
                (1e5 * limits.max_lost).round() / 1e3,
                100.0 * lost
            ));
        }
    }

    /// Exceeded limits, as text.
    pub(super) fn beyond(&self, alignment: &Alignment, limits: &AlignmentSettings) -> Vec<String> {
        let off_line = [0, 1].map(|k| self.off_line(k));
        let drifts = [0, 1].map(|k| drifts(k, off_line[k], alignment, limits));
        let mut out: Vec<String> = drifting(drifts, off_line, alignment).into_iter().collect();
        let mut judge = |what: String, limit: f64, found: f64, unit: &str| {
            if found > limit {
                out.push(format!(
                    "{what}: expected at most {} {unit}, found {found:.1} {unit}",
                    (limit * 1e3).round() / 1e3
                ));
            }
        };
        for map in &alignment.maps {
            let name = map.map.name();
            let by_trains = matches!(
                map.map,
                MapName::Camera1FromBox | MapName::Camera2FromBox | MapName::Camera2FromCamera1
            );
            if by_trains {
                if let Some(rms) = map.residual_rms_us {
                    judge(
                        format!("{name}, residual rms"),
                        limits.max_residual_us,
                        rms,
                        "µs",
                    );
                }
                if let (Some((_, noise)), Some((_, bound))) = (map.interval_us, map.bound_us) {
                    judge(
                        format!("{name}, 95 % interval at the presses plus systematic bound"),
                        limits.max_camera_interval_us,
                        noise + bound,
                        "µs",
                    );
                }
                if let Some(share) = map.coverage.filter(|_| map.coverage_n >= MIN_HELD_OUT) {
                    // Chance alone leaves some outside.
                    let least = limits.min_coverage;
                    let error = (least * (1.0 - least) / f64::from(map.coverage_n)).sqrt();
                    judge(
                        format!("{name}, share outside the stated interval"),
                        100.0 * (1.0 - least + 3.0 * error),
                        100.0 * (1.0 - share),
                        "%",
                    );
                }
            }
            if map.map == MapName::HostFromBox
                && let Some((_, largest)) = map.bound_us
            {
                judge(
                    format!("{name}, bound at the presses"),
                    limits.max_host_interval_us,
                    largest,
                    "µs",
                );
            }
            if let Some(drift) = map.drift_ppm {
                judge(
                    format!("{name}, drift"),
                    limits.max_drift_ppm,
                    drift.abs(),
                    "ppm",
                );
            }
        }
        for (k, line) in alignment.lines.iter().enumerate() {
            let camera = format!("camera {}, trigger input", k + 1);
            // Trains away from the line are neither lost nor spurious.
            if drifts[k] {
                continue;
            }
            judge(
                format!("{camera}, lost edges"),
                100.0 * limits.max_lost,
                100.0 * line.share(line.lost),
                "%",
            );
            let extra = line.doubled + line.spurious;
            judge(
                format!("{camera}, doubled and spurious edges"),
                100.0 * limits.max_spurious,
                100.0 * line.share(extra),
                "%",
            );
        }
        out
    }
}
