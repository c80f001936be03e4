//! Compares the robot's path with its commands, in one pass over the pose stream and bounded memory.

use skinrig_model::{PoseSample, PressId, PressTiming};

use crate::result::{Motion, MotionBin, PressMotion, TipSample};

/// Maximum number of bins; beyond it pairs are merged.
const MAX_BINS: usize = 2048;
/// Initial width of a bin, ns.
const FIRST_BIN_NS: i64 = 50_000_000;
/// Maximum number of samples kept per press.
const MAX_SAMPLES: usize = 400;

/// Sum of squared distances in one bin.
#[derive(Debug, Clone, Copy, Default)]
struct Bin {
    squares: f64,
    largest: f64,
    n: u64,
}

impl Bin {
    fn add(self, other: Self) -> Self {
        Self {
            squares: self.squares + other.squares,
            largest: self.largest.max(other.largest),
            n: self.n + other.n,
        }
    }

    fn rms(self) -> f64 {
        (self.squares / self.n as f64).sqrt()
    }
}

/// Processes pose samples in time order.
#[derive(Debug, Clone)]
pub struct MotionCourse {
    presses: Vec<(PressTiming, PressMotion)>,
    first_ns: Option<i64>,
    bin_ns: i64,
    bins: Vec<Bin>,
    broken: u64,
}

impl MotionCourse {
    /// Keeps the path during these presses.
    #[must_use]
    pub fn new(presses: impl IntoIterator<Item = (PressId, PressTiming)>) -> Self {
        let empty = |press| PressMotion {
            press,
            kept_each: 1,
            samples: Vec::new(),
        };
        let presses = presses.into_iter();
        Self {
            presses: presses.map(|(p, timing)| (timing, empty(p))).collect(),
            first_ns: None,
            bin_ns: FIRST_BIN_NS,
            bins: Vec::new(),
            broken: 0,
        }
    }

    /// Processes the next samples.
    pub fn push(&mut self, samples: &[PoseSample]) {
        for sample in samples {
            self.take(sample);
        }
    }

    fn take(&mut self, sample: &PoseSample) {
        let commanded_mm = sample.commanded.to_array();
        let measured_mm = sample.measured.to_array();
        let square: f64 = commanded_mm
            .iter()
            .zip(&measured_mm)
            .map(|(c, m)| (c - m) * (c - m))
            .sum();
        if !square.is_finite() {
            self.broken += 1;
            return;
        }
        let first_ns = *self.first_ns.get_or_insert(sample.t.0);
        let since_ns = sample.t.0.saturating_sub(first_ns).max(0);
        while since_ns / self.bin_ns >= MAX_BINS as i64 {
            self.bin_ns *= 2;
            let pairs = self.bins.chunks(2);
            self.bins = pairs
                .map(|pair| pair.iter().fold(Bin::default(), |sum, b| sum.add(*b)))
                .collect();
        }
        let at = (since_ns / self.bin_ns) as usize;
        if self.bins.len() <= at {
            self.bins.resize(at + 1, Bin::default());
        }
        self.bins[at] = self.bins[at].add(Bin {
            squares: square,
            largest: square.sqrt(),
            n: 1,
        });
        for (timing, path) in &mut self.presses {
            if (timing.approach..=timing.clear).contains(&sample.t) {
                path.samples.push(TipSample {
                    since_contact_s: (sample.t - timing.contact).as_secs_f64(),
                    commanded_mm,
                    measured_mm,
                });
            }
        }
    }

    /// The result; `None` without any finite sample.
    #[must_use]
    pub fn finish(self) -> Option<Motion> {
        let first_ns = self.first_ns?;
        let all = self.bins.iter().fold(Bin::default(), |sum, b| sum.add(*b));
        let start = |k: usize| (first_ns + self.bin_ns * k as i64) as f64 * 1e-9;
        let bins = self.bins.iter().enumerate().filter(|(_, b)| b.n > 0);
        let course = bins.map(|(k, b)| MotionBin {
            start_s: start(k),
            rms_mm: b.rms(),
            max_mm: b.largest,
        });
        let course = course.collect();
        let presses = self.presses.into_iter().map(|(_, path)| thinned(path));
        Some(Motion {
            samples: all.n,
            broken: self.broken,
            rms_mm: all.rms(),
            max_mm: all.largest,
            bin_s: self.bin_ns as f64 * 1e-9,
            course,
            presses: presses.filter(|p| !p.samples.is_empty()).collect(),
        })
    }
}

fn thinned(path: PressMotion) -> PressMotion {
    let each = path.samples.len().div_ceil(MAX_SAMPLES).max(1);
    PressMotion {
        kept_each: each as u32,
        samples: path.samples.into_iter().step_by(each).collect(),
        ..path
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skinrig_model::{HostTime, Point3};

    fn sample(ms: i64, off_mm: f64) -> PoseSample {
        PoseSample {
            t: HostTime(ms * 1_000_000),
            commanded: Point3::new(1.0, 2.0, 3.0),
            measured: Point3::new(1.0, 2.0 + 0.6 * off_mm, 3.0 - 0.8 * off_mm),
            force_n: f64::NAN,
        }
    }

    #[test]
    fn a_long_course_keeps_its_squares_and_its_largest_distance() {
        let mut course = MotionCourse::new([]);
        // Half an hour at 100 Hz: bins of 50 ms would be 36,000.
        for k in 0..180_000 {
            course.push(&[sample(1000 + 10 * k, if k == 90_000 { 5.0 } else { 0.1 })]);
        }
        let mut broken = sample(0, 0.0);
        broken.measured = Point3::new(f64::NAN, 0.0, 0.0);
        course.push(&[broken]);
        let motion = course.finish().unwrap();
        assert_eq!((motion.samples, motion.broken), (180_000, 1));
        let expected = ((179_999.0 * 0.01 + 25.0) / 180_000.0f64).sqrt();
        assert!((motion.rms_mm - expected).abs() < 1e-9, "{}", motion.rms_mm);
        assert!((motion.max_mm - 5.0).abs() < 1e-9);
        assert!((MAX_BINS / 2..=MAX_BINS).contains(&motion.course.len()));
        let high: Vec<_> = motion.course.iter().filter(|b| b.max_mm > 1.0).collect();
        assert_eq!(high.len(), 1);
        assert!((high[0].start_s..high[0].start_s + motion.bin_s).contains(&901.0));
        assert!((motion.course[0].start_s - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_press_keeps_its_own_samples_and_not_too_many() {
        let at = |ms: i64| HostTime(ms * 1_000_000);
        let timing = PressTiming {
            approach: at(2000),
            contact: at(2100),
            at_depth: at(2200),
            retract: at(2300),
            release: at(2400),
            clear: at(2999),
        };
        let mut course = MotionCourse::new([(PressId::from_index(7), timing)]);
        let samples: Vec<_> = (0..5000).map(|ms| sample(ms, 0.1)).collect();
        for block in samples.chunks(333) {
            course.push(block);
        }
        let motion = course.finish().unwrap();
        let [path] = &motion.presses[..] else {
            panic!("{} presses", motion.presses.len());
        };
        assert_eq!(
            (path.press, path.kept_each, path.samples.len()),
            (PressId::from_index(7), 3, 334)
        );
        assert!((path.samples[0].since_contact_s + 0.1).abs() < 1e-12);
        assert_eq!(MotionCourse::new([]).finish(), None);
    }
}
