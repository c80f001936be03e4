//! Detects a touch in the pose stream: averages the force in free air, then waits until it rises.

use skinrig_model::{HostTime, PoseSample};
use skinrig_protocol::TouchSearch;

/// Tracks the force through the pose stream, from the tare to the touch.
///
/// Decisions depend only on command times and samples, so that a replay reproduces them.
#[derive(Debug, Clone)]
pub(crate) struct TouchDetector {
    search: TouchSearch,
    tare_from: HostTime,
    sum_n: f64,
    samples: u32,
    tare_n: Option<f64>,
    blind: bool,
    search_from: Option<HostTime>,
    run: u32,
    first: Option<PoseSample>,
    touched: Option<PoseSample>,
}

impl TouchDetector {
    /// Averages the samples after `tare_from` over the search's tare time.
    pub(crate) const fn new(search: TouchSearch, tare_from: HostTime) -> Self {
        Self {
            search,
            tare_from,
            sum_n: 0.0,
            samples: 0,
            tare_n: None,
            blind: false,
            search_from: None,
            run: 0,
            first: None,
            touched: None,
        }
    }

    /// Sets the time of the command for slow motion: only later forces indicate a touch, since fast motion itself needs
    /// force.
    pub(crate) const fn search_from(&mut self, t: HostTime) {
        self.search_from = Some(t);
    }

    /// Processes the next sample.
    pub(crate) fn feed(&mut self, s: &PoseSample) {
        if s.t <= self.tare_from {
            return;
        }
        if !s.force_n.is_finite() {
            self.blind = true;
            return;
        }
        let Some(tare_n) = self.tare_n else {
            self.sum_n += s.force_n;
            self.samples += 1;
            if s.t >= self.tare_from + self.search.tare {
                self.tare_n = Some(self.sum_n / f64::from(self.samples));
            }
            return;
        };
        if self.touched.is_some() || self.search_from.is_none_or(|t| s.t <= t) {
            return;
        }
        if (s.force_n - tare_n).abs() <= self.search.threshold_n {
            self.run = 0;
            self.first = None;
            return;
        }
        self.run += 1;
        let first = *self.first.get_or_insert(*s);
        if self.run >= self.search.samples {
            self.touched = Some(first);
        }
    }

    /// Force in free air, N, once known.
    pub(crate) const fn tare_n(&self) -> Option<f64> {
        self.tare_n
    }

    /// True if a sample had no force.
    pub(crate) const fn is_blind(&self) -> bool {
        self.blind
    }

    /// The first sample of the touch.
    pub(crate) const fn touched(&self) -> Option<PoseSample> {
        self.touched
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skinrig_model::{HostDuration, Point3};

    const SEARCH: TouchSearch = TouchSearch {
        threshold_n: 0.2,
        samples: 3,
        speed_mm_s: 2.0,
        band_mm: 1.0,
        tare: HostDuration::from_millis(4),
    };

    /// Feeds forces, one per millisecond from 1 ms on, with heights falling by 0.1 mm each; returns the height of the touch.
    fn touched(search_from_ms: i64, forces: &[f64]) -> Option<f64> {
        let mut detector = TouchDetector::new(SEARCH, HostTime(0));
        detector.search_from(HostTime(search_from_ms * 1_000_000));
        for (i, force_n) in forces.iter().enumerate() {
            let at = Point3::new(0.0, 0.0, 1.0 - 0.1 * i as f64);
            detector.feed(&PoseSample {
                t: HostTime((i as i64 + 1) * 1_000_000),
                commanded: at,
                measured: at,
                force_n: *force_n,
            });
        }
        detector
            .touched()
            .map(|s| (s.measured.z_mm * 10.0).round() / 10.0)
    }

    #[test]
    fn a_touch_is_a_run_of_samples_above_the_tare() {
        let t = 1.5; // force of holding
        let tare = [1.4, 1.6, 1.5, 1.5];
        let with = |rest: &[f64]| [&tare[..], rest].concat();
        assert_eq!(touched(4, &with(&[t, 1.69, t, 1.6])), None);
        assert_eq!(touched(4, &with(&[t, 1.8, 1.8, 1.8])), Some(0.5));
        // A gap restarts the count; a force in the other direction counts too.
        assert_eq!(touched(4, &with(&[1.8, 1.8, t, 1.8, 1.8])), None);
        assert_eq!(touched(4, &with(&[t, 1.2, 1.2, 1.2])), Some(0.5));
        // The force of fast motion is no touch.
        assert_eq!(touched(7, &with(&[2.5, 2.5, 2.5, t, t])), None);
        assert_eq!(
            touched(7, &with(&[2.5, 2.5, 2.5, 1.8, 1.8, 1.8])),
            Some(0.3)
        );
    }

    #[test]
    fn a_missing_force_is_reported() {
        let mut detector = TouchDetector::new(SEARCH, HostTime(0));
        let at = Point3::new(0.0, 0.0, 0.0);
        detector.feed(&PoseSample {
            t: HostTime(1),
            commanded: at,
            measured: at,
            force_n: f64::NAN,
        });
        assert!(detector.is_blind());
    }
}
