//! Simulates nights of a bench with typical values of a suite, unchanged or with planted changes.
//! Seeded.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use skinrig_nightly::trend::{History, NightSummary, Point};
use skinrig_nightly::{Verdict, Versions};

/// Distribution of a metric on an unchanged bench.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Kind {
    /// Always this value.
    Always(f64),
    /// Poisson counts with this mean.
    Count(f64),
    /// Normal: mean, spread over the mean, correlation between consecutive nights, share of the
    /// spread due to temperature.
    Normal(f64, f64, f64, f64),
    /// Student's t with three degrees of freedom: mean, scale over the mean, correlation between
    /// consecutive nights.
    Heavy(f64, f64, f64),
    /// Log-normal: median, spread of the logarithm.
    Skewed(f64, f64),
    /// Percent: mean, number of trials.
    Share(f64, u32),
}

use Kind::{Always, Count, Heavy, Normal, Share, Skewed};

/// Metrics measured on each camera.
const CAMERAS: &[(&str, &str, &str, Kind)] = &[
    ("identity", "differences", "", Always(0.0)),
    ("settings", "differences", "", Always(0.0)),
    ("trigger_loopback", "lost_pulses", "", Count(0.005)),
    ("trigger_loopback", "extra_pulses", "", Count(0.005)),
    ("trigger_loopback", "unread_trains", "", Count(0.005)),
    ("trigger_loopback", "jitter", "s", Skewed(4e-6, 0.15)),
    ("clocks", "drift", "ppm", Normal(12.0, 0.08, 0.3, 0.7)),
    ("clocks", "residual", "s", Skewed(6e-6, 0.25)),
    ("idle", "data_rate", "B/s", Normal(2.1e6, 0.04, 0.3, 0.5)),
    ("idle", "lost", "B", Always(0.0)),
    ("idle", "gaps", "", Count(0.01)),
    ("noise_dark", "rate", "ev/s", Normal(6.0e4, 0.05, 0.2, 0.8)),
    ("noise_dark", "hot_pixels", "", Count(6.0)),
    ("noise_dark", "hottest", "ev/s", Heavy(900.0, 0.1, 0.3)),
    ("noise_lit", "rate", "ev/s", Normal(1.1e5, 0.04, 0.2, 0.6)),
    ("noise_lit", "hot_pixels", "", Count(9.0)),
    ("noise_lit", "hottest", "ev/s", Heavy(1200.0, 0.1, 0.3)),
    (
        "test_pattern",
        "received",
        "%",
        Normal(99.9, 3e-4, 0.0, 0.0),
    ),
    ("test_pattern", "lost", "B", Always(0.0)),
    ("test_pattern", "gaps", "", Count(0.01)),
];

/// All other metrics.
const OTHERS: &[(&str, &str, &str, &str, Kind)] = &[
    ("identity", "robot", "differences", "", Always(0.0)),
    ("identity", "trigger box", "differences", "", Always(0.0)),
    (
        "disk",
        "computer",
        "write_rate",
        "B/s",
        Heavy(4.2e8, 0.05, 0.2),
    ),
    (
        "clocks",
        "cameras",
        "offset",
        "s",
        Normal(0.02, 0.6, 0.0, 0.0),
    ),
    ("robot_state", "robot", "faults", "", Always(0.0)),
    ("robot_state", "robot", "creep", "mm", Skewed(0.004, 0.4)),
    (
        "repeatability",
        "robot",
        "spread",
        "mm",
        Skewed(0.011, 0.12),
    ),
    (
        "repeatability",
        "robot",
        "error",
        "mm",
        Heavy(0.05, 0.06, 0.2),
    ),
    (
        "step_response",
        "robot",
        "settling",
        "s",
        Heavy(0.12, 0.05, 0.0),
    ),
    (
        "step_response",
        "robot",
        "overshoot",
        "mm",
        Skewed(0.03, 0.3),
    ),
    (
        "step_response",
        "robot",
        "error",
        "mm",
        Heavy(0.02, 0.15, 0.0),
    ),
    (
        "depth",
        "robot",
        "surface",
        "mm",
        Normal(0.1, 0.2, 0.5, 0.3),
    ),
    ("depth", "robot", "error", "mm", Normal(0.06, 0.1, 0.4, 0.3)),
    (
        "force_ceiling",
        "robot",
        "peak",
        "N",
        Normal(1.05, 0.02, 0.2, 0.0),
    ),
    ("force_ceiling", "robot", "trips", "", Always(0.0)),
    ("golden", "skin", "rmse", "mm", Normal(1.8, 0.05, 0.3, 0.3)),
    ("golden", "skin", "repeat_std", "mm", Skewed(0.6, 0.08)),
    ("golden", "skin", "latency", "s", Heavy(0.009, 0.04, 0.2)),
    (
        "golden",
        "skin",
        "press_events",
        "ev/s",
        Normal(2.4e5, 0.03, 0.3, 0.5),
    ),
    (
        "golden",
        "skin",
        "idle_events",
        "ev/s",
        Normal(2.0e4, 0.05, 0.3, 0.7),
    ),
    ("golden", "skin", "located", "%", Share(97.0, 60)),
    ("golden", "skin", "valid", "%", Share(99.5, 60)),
    ("golden", "skin", "reference_shift", "mm", Skewed(0.25, 0.5)),
    (
        "golden",
        "skin",
        "reference_events",
        "%",
        Heavy(99.0, 0.02, 0.2),
    ),
    ("golden", "skin", "lost", "B", Always(0.0)),
    (
        "watchdog_drill",
        "robot",
        "braked_within",
        "s",
        Normal(0.21, 0.05, 0.0, 0.0),
    ),
    ("watchdog_drill", "robot", "drop", "mm", Skewed(0.4, 0.3)),
    (
        "stop_drill",
        "robot",
        "stopped_within",
        "s",
        Heavy(0.08, 0.06, 0.0),
    ),
    ("stop_drill", "robot", "distance", "mm", Skewed(1.2, 0.1)),
];

/// A planted change of a bench.
#[derive(Debug, Clone)]
pub(crate) struct PlantedChange {
    /// Prefix of the names of the affected series.
    pub series: &'static str,
    /// First affected night.
    pub from: usize,
    /// Factor on their values.
    pub factor: f64,
    /// Growth of the factor with every further night.
    pub growth: f64,
}

/// Draws the nights of a bench in order.
pub(crate) struct Bench {
    random: Xoshiro256PlusPlus,
    metrics: Vec<Metric>,
    temperature: f64,
    /// Planted changes.
    pub planted: Vec<PlantedChange>,
    /// One in `gaps[0]` nights is missing; one in `gaps[1]` is INVALID with wrong values. 0: none.
    pub gaps: [u64; 2],
}

struct Metric {
    name: String,
    unit: &'static str,
    kind: Kind,
    memory: f64,
}

/// A value drawn for a night.
pub(crate) struct DrawnValue<'a> {
    pub name: &'a str,
    pub unit: &'static str,
    pub value: f64,
    pub n: Option<u64>,
    pub verdict: Verdict,
}

impl Bench {
    /// An unchanged bench.
    pub(crate) fn new(seed: u64) -> Self {
        let mut metrics = Vec::new();
        for camera in ["camera1", "camera2"] {
            for (check, metric, unit, kind) in CAMERAS {
                metrics.push((format!("{check}/{camera}/{metric}"), *unit, *kind));
            }
        }
        for (check, subject, metric, unit, kind) in OTHERS {
            metrics.push((format!("{check}/{subject}/{metric}"), *unit, *kind));
        }
        let metric = |(name, unit, kind)| Metric {
            name,
            unit,
            kind,
            memory: 0.0,
        };
        Self {
            random: Xoshiro256PlusPlus::seed_from_u64(seed),
            metrics: metrics.into_iter().map(metric).collect(),
            temperature: 0.0,
            planted: Vec::new(),
            gaps: [25, 50],
        }
    }

    /// Sets the spread of one metric, relative to its mean.
    pub(crate) fn spread(mut self, series: &str, spread: f64) -> Self {
        for metric in self.metrics.iter_mut().filter(|m| m.name == series) {
            if let Normal(mean, _, r, t) = metric.kind {
                metric.kind = Normal(mean, spread, r, t);
            }
        }
        self
    }

    /// Draws the values of night number `at`; `None`: the night is missing.
    pub(crate) fn night(&mut self, at: usize) -> Option<Vec<DrawnValue<'_>>> {
        let Self {
            random,
            metrics,
            temperature,
            planted,
            gaps,
        } = self;
        *temperature = 0.6 * *temperature + 0.8 * normal(random);
        let mut one_in = |n: u64| n > 0 && random.next_u64() % n == 0;
        let (missing, invalid) = (one_in(gaps[0]), one_in(gaps[1]));
        let drawn = metrics.iter_mut().map(|metric| {
            let mut value = metric.draw(random, *temperature);
            let hits = |p: &&PlantedChange| metric.name.starts_with(p.series) && at >= p.from;
            for p in planted.iter().filter(hits) {
                value *= p.factor + p.growth * (at - p.from) as f64;
            }
            // The lamps were off: the values are meaningless.
            let is_wrong = invalid && metric.name.starts_with("golden");
            DrawnValue {
                name: &metric.name,
                unit: metric.unit,
                value: if is_wrong { value * 0.2 } else { value },
                n: match metric.kind {
                    Share(_, of) => Some(of.into()),
                    _ => None,
                },
                verdict: if is_wrong {
                    Verdict::Invalid
                } else {
                    Verdict::Pass
                },
            }
        });
        let drawn: Vec<_> = drawn.collect();
        (!missing).then_some(drawn)
    }

    /// History of `nights` nights.
    pub(crate) fn history(mut self, nights: usize) -> History {
        let mut history = History::default();
        for at in 0..nights {
            let night = history.nights.len();
            let Some(drawn) = self.night(at) else {
                continue;
            };
            for d in drawn {
                let point = Point {
                    night,
                    value: Some(d.value),
                    interval: None,
                    n: d.n,
                    limit: None,
                    verdict: d.verdict,
                    part: d.verdict,
                    attempts: 1,
                };
                history.add(d.name, d.unit, point);
            }
            history.nights.push(head(at));
        }
        history
    }
}

/// Metadata of night number `at`; its ID contains the number.
pub(crate) fn head(at: usize) -> NightSummary {
    NightSummary {
        id: format!("night-{at:04}"),
        started: date(at),
        suite: "nightly".to_owned(),
        suite_sha256: "5".repeat(64),
        rig: "simulated".to_owned(),
        rig_kind: "emulated".to_owned(),
        rig_sha256: "6".repeat(64),
        versions: Versions {
            software: "0.1.0 (aaaaaaa)".to_owned(),
            analysis: 1,
            firmware: vec![("camera1".to_owned(), "3.9".to_owned())],
            skin: Some("golden".to_owned()),
        },
        verdict: Verdict::Pass,
        folder: format!("night-{at:04}"),
        golden: None,
    }
}

/// 02:00 UTC, `at` days after 2025-01-01.
pub(crate) fn date(at: usize) -> String {
    const DAYS: [usize; 12] = [31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    let (year, mut day) = (2025 + at / 365, at % 365);
    let mut month = 0;
    while day >= DAYS[month] {
        day -= DAYS[month];
        month += 1;
    }
    format!("{year}-{:02}-{:02}T02:00:00Z", month + 1, day + 1)
}

impl Metric {
    fn draw(&mut self, random: &mut Xoshiro256PlusPlus, temperature: f64) -> f64 {
        match self.kind {
            Always(value) => value,
            Count(mean) => f64::from(poisson(random, mean)),
            Normal(mean, spread, r, warm) => {
                let own = self.remember(r, normal(random));
                let z = warm * temperature + (1.0 - warm * warm).sqrt() * own;
                mean * (1.0 + spread * z)
            }
            Heavy(mean, scale, r) => {
                let z = normal(random);
                let chi: f64 = (0..3).map(|_| normal(random).powi(2)).sum();
                mean * (1.0 + scale * self.remember(r, z / (chi / 3.0).sqrt()))
            }
            Skewed(median, spread) => median * libm::exp(spread * normal(random)),
            Share(percent, of) => {
                let hits = (0..of)
                    .filter(|_| 100.0 * uniform(random) < percent)
                    .count();
                100.0 * hits as f64 / f64::from(of)
            }
        }
    }

    /// Next value of a first-order autoregressive series whose variance is that of the steps.
    fn remember(&mut self, r: f64, step: f64) -> f64 {
        self.memory = r * self.memory + (1.0 - r * r).sqrt() * step;
        self.memory
    }
}

fn uniform(random: &mut Xoshiro256PlusPlus) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

fn normal(random: &mut Xoshiro256PlusPlus) -> f64 {
    let radius = (-2.0 * libm::log(1.0 - uniform(random))).sqrt();
    radius * libm::cos(std::f64::consts::TAU * uniform(random))
}

/// Draws by Knuth's product of uniform variables, which is fast enough for small means.
fn poisson(random: &mut Xoshiro256PlusPlus, mean: f64) -> u32 {
    let (mut product, least, mut count) = (uniform(random), libm::exp(-mean), 0);
    while product > least {
        product *= uniform(random);
        count += 1;
    }
    count
}
