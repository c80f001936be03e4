//! Simulated recordings: event rates of two cameras over a plan of presses, with all kinds of deviations.

use skinrig_analysis::clock::{PressSpan, RatesAlignment, align_by_rates};
use skinrig_analysis::rates::RateHistogram;

const BIN_US: u64 = 10_000;

/// Seeded random numbers (splitmix64).
pub(crate) struct Dice(u64);

impl Dice {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5851_f42d_4c95_7f2d)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// 0 to 1.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Below `n`.
    pub(crate) fn below(&mut self, n: usize) -> usize {
        (self.unit() * n as f64) as usize
    }

    pub(crate) fn chance(&mut self, p: f64) -> bool {
        self.unit() < p
    }

    fn bell(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }

    fn poisson(&mut self, mean: f64) -> u32 {
        if mean > 30.0 {
            return (mean + mean.sqrt() * self.bell()).round().max(0.0) as u32;
        }
        let (limit, mut product, mut n) = (libm::exp(-mean), self.unit(), 0);
        while product > limit {
            product *= self.unit();
            n += 1;
        }
        n
    }
}

/// Something that cameras saw: a press, planned or not, or a noise burst.
#[derive(Clone, Copy)]
struct Burst {
    at_s: f64,
    /// Peak events per bin, per camera.
    strength: [f64; 2],
    is_press: bool,
}

/// Recording of one camera and its clock.
#[derive(Clone, Copy, Debug)]
struct Recording {
    /// On the host clock.
    from_s: f64,
    to_s: f64,
    offset_s: f64,
    ppm: f64,
    hole_s: Option<(f64, f64)>,
    background: f64,
}

impl Recording {
    fn camera_s(&self, host_s: f64) -> f64 {
        self.offset_s + host_s * (1.0 + self.ppm * 1e-6)
    }
}

/// A simulated rig, its plan, and the recordings of the cameras.
pub(crate) struct World {
    pub dice: Dice,
    /// From the schedule: contact, and whether it is a sync press.
    pub plan: Vec<(f64, bool)>,
    bursts: Vec<Burst>,
    cameras: [Recording; 2],
    period_s: f64,
}

/// Time from the last sync press to the first of the path.
const PAUSE_S: f64 = 3.0;
const SPAN_S: f64 = 0.55;

impl World {
    /// An ordinary recording of `presses` presses after three sync presses, planned as executed.
    pub(crate) fn new(seed: u64, presses: usize) -> Self {
        let mut dice = Dice::new(seed);
        let period_s = [3.0 + 1.0 / 289.0, 3.0 + 1.0 / 289.0, 1.5, 2.2][dice.below(4)];
        let mut plan: Vec<(f64, bool)> = (0..3).map(|i| (f64::from(i), true)).collect();
        plan.extend((0..presses).map(|i| (2.0 + PAUSE_S + i as f64 * period_s, false)));
        let last_s = plan.last().map_or(0.0, |p| p.0);
        let height = dice.between(8.0, 40.0);
        let sync = [dice.between(0.6, 1.4), dice.between(0.6, 1.4)];
        let bursts = plan
            .iter()
            .map(|&(at_s, is_sync)| {
                let spread: [f64; 2] = std::array::from_fn(|_| libm::exp(0.4 * dice.bell()));
                Burst {
                    at_s: at_s + 0.004 * dice.bell(),
                    strength: if is_sync { sync } else { spread }.map(|s| height * s),
                    is_press: true,
                }
            })
            .collect();
        let (before_s, after_s) = (dice.between(4.0, 20.0), dice.between(3.0, 15.0));
        let cameras = std::array::from_fn(|_| Recording {
            from_s: -before_s + dice.between(-0.9, 0.9),
            to_s: last_s + after_s + dice.between(-0.9, 0.9),
            offset_s: dice.between(20.0, 60.0),
            ppm: dice.between(-60.0, 60.0),
            hole_s: None,
            background: dice.between(0.3, 3.0),
        });
        Self {
            dice,
            plan,
            bursts,
            cameras,
            period_s,
        }
    }

    fn path(&self) -> usize {
        self.plan.iter().filter(|p| !p.1).count()
    }

    /// Limits the plan to `presses` presses of the path, from press `first` on.
    pub(crate) fn plan_only(&mut self, first: usize, presses: usize) {
        let mut i = 0;
        self.plan.retain(|p| {
            let keep = p.1 || (first..first + presses).contains(&i);
            i += usize::from(!p.1);
            keep
        });
    }

    /// The plan has more presses than were executed.
    pub(crate) fn plan_more(&mut self, presses: usize) {
        let last_s = self.plan.last().map_or(0.0, |p| p.0);
        let period_s = self.period_s;
        self.plan
            .extend((1..=presses).map(|i| (last_s + i as f64 * period_s, false)));
    }

    /// Adds an unplanned repetition of the path after a pause.
    pub(crate) fn repeat(&mut self, pause_s: f64) {
        let path: Vec<Burst> = self.bursts[3..3 + self.path()].to_vec();
        let last_s = self.bursts.iter().map(|b| b.at_s).fold(0.0, f64::max);
        let by_s = last_s + pause_s + self.period_s - path[0].at_s;
        for camera in &mut self.cameras {
            camera.to_s += by_s - (last_s - path[path.len() - 1].at_s);
        }
        self.bursts.extend(path.into_iter().map(|b| Burst {
            at_s: b.at_s + by_s,
            ..b
        }));
    }

    pub(crate) fn without_sync(&mut self) {
        self.plan.retain(|p| !p.1);
        self.bursts.drain(..3);
    }

    /// The sync presses were executed, but no camera saw them.
    pub(crate) fn blind_sync(&mut self) {
        self.bursts[..3]
            .iter_mut()
            .for_each(|b| b.strength = [0.0; 2]);
    }

    /// The plan has another interval between the sync presses than was executed.
    pub(crate) fn sync_interval(&mut self, planned_s: f64, made_s: f64) {
        for i in 0..3 {
            let before = (2 - i) as f64;
            self.plan[i].0 = 2.0 - before * planned_s;
            self.bursts[i].at_s = 2.0 - before * made_s;
        }
    }

    /// Adds a sync press before the others.
    pub(crate) fn fourth_sync(&mut self) {
        let first = self.bursts[0];
        self.bursts.push(Burst {
            at_s: first.at_s - 1.0,
            ..first
        });
    }

    pub(crate) fn start_late(&mut self, camera: usize, presses: f64) {
        self.cameras[camera].from_s = 2.0 + PAUSE_S + (presses - 0.5) * self.period_s;
    }

    pub(crate) fn stop_early(&mut self, camera: usize, presses: f64) {
        self.cameras[camera].to_s = 2.0 + PAUSE_S + (presses - 0.5) * self.period_s;
    }

    pub(crate) fn add_gap(&mut self, camera: usize, length_s: f64) {
        let r = self.cameras[camera];
        let from_s = self.dice.between(r.from_s.max(0.0), r.to_s - length_s);
        self.cameras[camera].hole_s = Some((from_s, from_s + length_s));
    }

    pub(crate) fn drift(&mut self, ppm: [f64; 2]) {
        for (camera, ppm) in self.cameras.iter_mut().zip(ppm) {
            camera.ppm = ppm;
        }
    }

    /// A share of the path's presses was not executed, or was seen by no camera or only one.
    pub(crate) fn miss(&mut self, share: f64) {
        for i in 3..self.bursts.len() {
            if self.dice.chance(share) {
                match self.dice.below(4) {
                    0 => self.bursts[i].strength[0] = 0.0,
                    1 => self.bursts[i].strength[1] = 0.0,
                    _ => self.bursts[i].strength = [0.0; 2],
                }
            }
        }
    }

    /// A share of the presses was executed twice, the second time 0.8 to 1 s later.
    pub(crate) fn double(&mut self, share: f64) {
        for i in 3..self.bursts.len() {
            if self.dice.chance(share) {
                let after_s = self.dice.between(0.8, 1.0);
                let burst = self.bursts[i];
                self.bursts.push(Burst {
                    at_s: burst.at_s + after_s,
                    ..burst
                });
            }
        }
    }

    /// Noise bursts at random times, in one camera or both.
    pub(crate) fn noise(&mut self, count: usize) {
        let to_s = self.cameras[0].to_s;
        for _ in 0..count {
            let height = self.dice.between(5.0, 40.0);
            let strength = [[height, 0.0], [0.0, height], [height; 2]][self.dice.below(3)];
            self.bursts.push(Burst {
                at_s: self.dice.between(-5.0, to_s),
                strength,
                is_press: self.dice.chance(0.5),
            });
        }
    }

    /// Replaces the plan by that of another recording.
    pub(crate) fn foreign_plan(&mut self) {
        let stretch = self.dice.between(1.1, 1.9);
        self.plan.iter_mut().for_each(|p| p.0 *= stretch);
    }

    pub(crate) fn presses(&self) -> Vec<PressSpan> {
        self.plan
            .iter()
            .map(|&(s, sync)| PressSpan {
                contact_us: s * 1e6,
                release_us: (s + SPAN_S) * 1e6,
                sync,
            })
            .collect()
    }

    /// Recording of camera `k`.
    pub(crate) fn rates(&mut self, k: usize) -> RateHistogram {
        let r = self.cameras[k];
        let bin_s = BIN_US as f64 * 1e-6;
        let (from, to) = (r.camera_s(r.from_s) / bin_s, r.camera_s(r.to_s) / bin_s);
        let (from, to) = (from as usize, to as usize);
        let mut means = vec![r.background; to - from];
        let mut add = |at_s: f64, events: f64| {
            let bin = (r.camera_s(at_s) / bin_s) as usize;
            if let Some(mean) = bin.checked_sub(from).and_then(|i| means.get_mut(i)) {
                *mean += events;
            }
        };
        for burst in &self.bursts {
            let height = burst.strength[k];
            if burst.is_press {
                for i in 0..140 {
                    let after_s = f64::from(i) * bin_s;
                    let level = match i {
                        0..16 => 1.0,
                        34..55 => 0.7,
                        _ => 0.25 * libm::exp(-after_s / 0.4),
                    };
                    add(burst.at_s + after_s, height * level);
                }
            } else {
                (0..25).for_each(|i| add(burst.at_s + f64::from(i) * bin_s, height));
            }
        }
        if let Some((a, b)) = r.hole_s {
            let bin = |s: f64| ((r.camera_s(s) / bin_s) as usize).saturating_sub(from);
            let (a, b) = (bin(a).min(means.len()), bin(b).min(means.len()));
            means[a..b].fill(0.0);
        }
        let mut rates = RateHistogram::new(BIN_US);
        for (i, mean) in means.into_iter().enumerate() {
            let n = self.dice.poisson(mean);
            (0..n).for_each(|_| rates.add((from + i) as u64 * BIN_US));
        }
        rates
    }

    pub(crate) fn align(&mut self) -> RatesAlignment {
        let rates = [self.rates(0), self.rates(1)];
        align_by_rates([Some(&rates[0]), Some(&rates[1])], &self.presses())
    }

    /// Largest error of the clocks found, in the middle of each camera's recording of the plan, s; `None` without a clock.
    pub(crate) fn error_s(&self, found: &RatesAlignment) -> Option<f64> {
        let mut worst = 0.0f64;
        for (r, fit) in self.cameras.iter().zip(&found.cameras) {
            let fit = fit.as_ref()?.as_ref().ok()?.fit;
            let (first_s, last_s) = (self.plan[0].0, self.plan.last()?.0);
            let host_s = 0.5 * (r.from_s.max(first_s) + r.to_s.min(last_s));
            let error_s = fit.camera_us(host_s * 1e6) * 1e-6 - r.camera_s(host_s);
            worst = worst.max(error_s.abs());
        }
        Some(worst)
    }
}
