//! How well touches were felt: delays after measured contacts, and false alarms in the time between presses.

use skinrig_analysis::Analysis;
use skinrig_analysis::exclusion::Exclusion;
use skinrig_model::{HostTime, PressRole, Verdict};
use skinrig_statistics::distributions::poisson_interval;

use crate::detector::{Detection, Felt};

/// Uncertainty of a measured contact: an onset up to this long before it is none before the contact, µs.
const CONTACT_US: f64 = 1_000.0;
/// Time after a measured release in which the touch may still be felt, µs.
const RELEASE_US: f64 = 40_000.0;

/// A scored press, host µs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScoredPress {
    /// Row in the analysis.
    pub row: usize,
    /// Measured contact.
    pub contact_us: f64,
    /// Measured release.
    pub release_us: f64,
    /// Measured release of the press before it.
    free_from_us: f64,
}

impl ScoredPress {
    /// The scored presses of an analysis that were carried out and follow another press; also those excluded for what the cameras saw:
    /// a press that was carried out and not felt is missed. Those that a selection excludes are left out.
    #[must_use]
    pub fn of(analysis: &Analysis) -> Vec<Self> {
        let us = |t: HostTime| t.0 as f64 * 1e-3;
        let mut timed: Vec<_> = analysis
            .presses
            .iter()
            .enumerate()
            .filter_map(|(row, p)| Some((row, p, p.timing?)))
            .collect();
        timed.sort_by_key(|(_, _, timing)| timing.contact);
        let pairs = timed.windows(2).map(|pair| (pair[0].2, pair[1]));
        pairs
            .filter(|(_, (_, p, _))| p.role == PressRole::Score && is_carried_out(p.verdict))
            .filter(|(_, (_, p, _))| !matches!(p.cause, Some(Exclusion::BySelection(_))))
            .map(|(before, (row, _, timing))| Self {
                row,
                contact_us: us(timing.contact),
                release_us: us(timing.release),
                free_from_us: us(before.release) + RELEASE_US,
            })
            .collect()
    }

    fn contact_from_us(&self) -> f64 {
        self.contact_us - CONTACT_US
    }
}

/// True for a press that the robot made, whether or not the cameras saw it well enough to count.
const fn is_carried_out(verdict: Verdict) -> bool {
    matches!(verdict, Verdict::Valid | Verdict::Excluded)
}

/// The result.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DetectionScore {
    /// (row, onset after the contact, ms) of the presses that were felt.
    pub delays_ms: Vec<(usize, f64)>,
    /// Presses during which no touch began.
    pub missed: usize,
    /// Presses that came while a false alarm lasted: neither felt nor missed.
    pub alarmed: usize,
    /// Onsets between presses, until 1 ms before the contact, and touches that last from one press to the next.
    pub false_alarms: u64,
    /// Time in which an onset is a false alarm, s.
    pub at_risk_s: f64,
    /// End of a touch after the measured release, ms, of presses that were felt.
    pub releases_ms: Vec<f64>,
}

impl DetectionScore {
    /// Scores decisions in order of time.
    #[must_use]
    pub fn new(found: &[Detection], presses: &[ScoredPress]) -> Self {
        let mut score = Self::default();
        for press in presses {
            score.add(found, press);
        }
        score
    }

    fn add(&mut self, found: &[Detection], press: &ScoredPress) {
        let before = |us: f64| found.partition_point(|d| (d.host_us as f64) < us);
        let begin = before(press.contact_from_us());
        let onsets =
            |range: &[Detection]| range.iter().filter(|d| d.felt == Felt::Onset).count() as u64;
        let free = before(press.free_from_us).min(begin);
        self.false_alarms += onsets(&found[free..begin]);
        self.at_risk_s += (press.contact_from_us() - press.free_from_us).max(0.0) * 1e-6;
        if begin > 0 && found[begin - 1].felt == Felt::Onset {
            self.alarmed += 1;
            // A touch since the press before: it lasts over all the time in which none may.
            self.false_alarms += u64::from(begin == free);
            return;
        }
        let during = &found[begin..before(press.release_us).max(begin)];
        match during.iter().find(|d| d.felt == Felt::Onset) {
            Some(onset) => {
                let late_ms = (onset.host_us as f64 - press.contact_us) * 1e-3;
                self.delays_ms.push((press.row, late_ms));
            }
            None => self.missed += 1,
        }
        let middle = before(0.5 * (press.contact_us + press.release_us)).max(begin);
        if let Some(end) = found[middle..].iter().find(|d| d.felt == Felt::Release) {
            self.releases_ms
                .push((end.host_us as f64 - press.release_us) * 1e-3);
        }
    }

    /// False alarms per second with their exact 95 % interval; `None` without time at risk.
    #[must_use]
    pub fn false_alarms_per_s(&self) -> Option<(f64, (f64, f64))> {
        let per_s = |count: f64| count / self.at_risk_s;
        let (low, high) = poisson_interval(self.false_alarms, 0.025);
        (self.at_risk_s > 0.0).then(|| (per_s(self.false_alarms as f64), (per_s(low), per_s(high))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(felt: Felt, host_us: i64) -> Detection {
        Detection {
            felt,
            host_us,
            since_us: host_us,
            llr: 20.0,
            near_mm: [0.0, 0.0],
        }
    }

    #[test]
    fn a_press_that_the_cameras_hardly_saw_counts() {
        let all = [
            Verdict::Valid,
            Verdict::Excluded,
            Verdict::Invalid,
            Verdict::Missed,
        ];
        assert_eq!(all.map(is_carried_out), [true, true, false, false]);
    }

    #[test]
    fn what_trips_before_contact_is_a_false_alarm() {
        let press = |row: usize, contact_s: f64| ScoredPress {
            row,
            contact_us: contact_s * 1e6,
            release_us: (contact_s + 0.4) * 1e6,
            free_from_us: (contact_s - 2.0) * 1e6,
        };
        let presses = [
            press(0, 10.0),
            press(1, 13.0),
            press(2, 16.0),
            press(3, 19.0),
        ];
        let found = [
            found(Felt::Onset, 10_003_500),
            found(Felt::Release, 10_420_000),
            // Withdrawn in time,
            found(Felt::Onset, 12_000_000),
            found(Felt::Withdrawn, 12_010_000),
            found(Felt::Onset, 12_999_500),
            found(Felt::Release, 13_390_000),
            // and not.
            found(Felt::Onset, 15_990_000),
            found(Felt::Release, 16_410_000),
        ];
        let score = DetectionScore::new(&found, &presses);
        assert_eq!(score.delays_ms, [(0, 3.5), (1, -0.5)]);
        assert_eq!((score.false_alarms, score.alarmed, score.missed), (2, 1, 1));
        assert!((score.at_risk_s - 4.0 * 1.999).abs() < 1e-9);
        assert_eq!(score.releases_ms.len(), 2);
        let (rate, (low, high)) = score.false_alarms_per_s().unwrap();
        assert!(low < rate && rate < high && (rate - 2.0 / 7.996).abs() < 1e-9);
    }

    #[test]
    fn a_touch_from_one_press_to_the_next_is_a_false_alarm() {
        let press = ScoredPress {
            row: 0,
            contact_us: 10e6,
            release_us: 10.4e6,
            free_from_us: 8e6,
        };
        let found = [
            found(Felt::Onset, 7_990_000),
            found(Felt::Release, 10_100_000),
        ];
        let score = DetectionScore::new(&found, &[press]);
        assert_eq!((score.false_alarms, score.alarmed, score.missed), (1, 1, 0));
    }
}
