//! Emulated benches: clocks, trains, edges and exchanges made by numbers, with everything that goes wrong on a line.

use std::sync::Arc;

use skinrig_analysis::timebase::{TimeBase, TimeBaseInput};
use skinrig_model::{
    AlignmentSettings, BoxReport, BoxTime, HostTime, Label, Mark, MarkKind, PressId, PulseTrain,
    TriggerEdge,
};

/// SplitMix64 (public domain, S. Vigna).
pub(crate) struct Random(pub u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform.
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Exponential, of mean 1.
    fn exponential(&mut self) -> f64 {
        -libm::log(self.between(0.0, 1.0).max(1e-9))
    }

    /// Standard normal (Box and Muller 1958).
    fn normal(&mut self) -> f64 {
        let radius = (2.0 * self.exponential()).sqrt();
        radius * libm::cos(std::f64::consts::TAU * self.between(0.0, 1.0))
    }
}

/// A clock over host time, µs: an origin, a rate, and a rate that changes.
#[derive(Debug, Clone)]
pub(crate) struct Clock {
    origin_us: f64,
    drift: f64,
    /// Change of the rate per µs.
    wander: f64,
    /// Swing of the rate, and its angular frequency, per µs.
    swing: (f64, f64),
    /// Phase of a rate that takes random steps, µs, at each [`WALK_STEP_US`]; straight between them.
    walk: Arc<[f64]>,
}

/// Steps of a rate that walks, µs.
const WALK_STEP_US: f64 = 1e6;

impl Clock {
    /// 20 ppm fast, with a rate that swings by `swing` (share, angular frequency per µs).
    pub(crate) fn oscillating(origin_us: f64, swing: (f64, f64)) -> Self {
        Self {
            origin_us,
            drift: 20e-6,
            wander: 0.0,
            swing,
            walk: Arc::new([]),
        }
    }

    /// What it shows at a host time.
    pub(crate) fn at(&self, host_us: f64) -> f64 {
        self.origin_us
            + host_us * (1.0 + self.drift)
            + 0.5 * self.wander * host_us * host_us
            + self.swing.0 / self.swing.1 * libm::sin(self.swing.1 * host_us)
            + self.random_walk_at(host_us)
    }

    /// The same crystal, begun anew.
    pub(crate) fn anew(&self, origin_us: f64) -> Self {
        Self {
            origin_us,
            ..self.clone()
        }
    }

    fn random_walk_at(&self, host_us: f64) -> f64 {
        let at = (host_us / WALK_STEP_US).max(0.0);
        let k = at as usize;
        match (self.walk.get(k), self.walk.get(k + 1)) {
            (Some(a), Some(b)) => a + (at - k as f64) * (b - a),
            _ => self.walk.last().copied().unwrap_or(0.0),
        }
    }

    /// The host time at which it shows this.
    pub(crate) fn host_us(&self, at_us: f64) -> f64 {
        let mut host_us = (at_us - self.origin_us) / (1.0 + self.drift);
        for _ in 0..4 {
            host_us -= (self.at(host_us) - at_us) / (1.0 + self.drift);
        }
        host_us
    }
}

/// How rates change besides evenly, by up to 3 ppm per hour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum RateVariation {
    /// Not.
    Even,
    /// They swing by 1 ppm, in between so many and so many s.
    Swings(f64, f64),
    /// They take random steps: standard deviation after a minute, as a fraction.
    Walks(f64),
}

/// How long each way of an exchange takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Delay {
    /// A serial line: 150 µs and an exponential of 100 µs.
    Serial,
    /// A busy host: 150 µs and 60 µs over a uniform number (Pareto's tail without a variance), 5 ms besides in one of ten.
    Heavy,
    /// Polled each ms: 150 µs and up to 1 ms on the way back, an exponential of 20 µs each way.
    Polled,
    /// As serial, five times as long in the middle third of the session.
    Loaded,
}

impl Delay {
    /// Both ways of the exchange at this part of the session, µs.
    fn draw(self, r: &mut Random, part: f64) -> [f64; 2] {
        [false, true].map(|back| {
            let mean = match self {
                Self::Loaded if (1.0 / 3.0..2.0 / 3.0).contains(&part) => 500.0,
                _ => 100.0,
            };
            150.0
                + match self {
                    Self::Serial | Self::Loaded => mean * r.exponential(),
                    Self::Heavy => {
                        let long = if r.between(0.0, 1.0) < 0.1 {
                            5000.0
                        } else {
                            0.0
                        };
                        60.0 * (1.0 / r.between(0.0, 1.0).max(1e-4) - 1.0) + long
                    }
                    Self::Polled if back => r.between(0.0, 1000.0) + 20.0 * r.exponential(),
                    Self::Polled => 20.0 * r.exponential(),
                }
        })
    }
}

/// What goes wrong, and how far clocks are apart.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Conditions {
    pub span_s: f64,
    pub most_drift: f64,
    pub wander: RateVariation,
    /// Edges come late by up to this, evenly; or by this on average, when `decays`.
    pub jitter_us: f64,
    pub decays: bool,
    /// Shares of edges.
    pub lost: f64,
    pub doubled: f64,
    pub spurious: f64,
    /// Share of trains of which a camera sees nothing.
    pub lost_trains: f64,
    /// Sync trains come each so many seconds, presses each second sync train.
    pub sync_s: u32,
    /// Exchanges come each so many seconds.
    pub exchange_s: f64,
    pub delay: Delay,
}

pub(crate) const CLEAN: Conditions = Conditions {
    span_s: 40.0,
    most_drift: 500e-6,
    wander: RateVariation::Even,
    jitter_us: 2.5,
    decays: false,
    lost: 0.0,
    doubled: 0.0,
    spurious: 0.0,
    lost_trains: 0.0,
    sync_s: 1,
    exchange_s: 0.1,
    delay: Delay::Serial,
};

pub(crate) const NOISY: Conditions = Conditions {
    lost: 0.2,
    doubled: 0.02,
    spurious: 0.05,
    ..CLEAN
};

/// What a bench records, and its clocks.
pub(crate) struct Bench {
    pub boxed: Clock,
    pub cameras: [Clock; 2],
    pub reports: Vec<BoxReport>,
    pub edges: [Vec<TriggerEdge>; 2],
    /// When the cameras were recording; empty: all along.
    pub recorded: [Vec<(u64, u64)>; 2],
    /// Host times of the presses' contacts, µs.
    pub presses: Vec<f64>,
    /// Host times of the first and the last train that each camera saw, µs.
    pub seen_us: [(f64, f64); 2],
}

/// A press each 2 s with a mark at contact, at depth and release, a sync train each second, an exchange each 0.1 s.
pub(crate) fn bench(seed: u64, c: &Conditions) -> Bench {
    let mut r = Random(seed);
    let mut clock = |origin_us: f64| Clock {
        origin_us: r.between(0.0, origin_us),
        drift: r.between(-c.most_drift, c.most_drift),
        // Up to 3 ppm per hour.
        wander: r.between(-3e-6, 3e-6) / 3.6e9,
        swing: match c.wander {
            RateVariation::Swings(low, high) => {
                let period_us = 1e6 * r.between(low, high);
                (1e-6, std::f64::consts::TAU / period_us)
            }
            _ => (0.0, 1.0),
        },
        walk: random_walk(&mut r, c),
    };
    let boxed = clock(1e9);
    let cameras = [clock(1e12), clock(1e12)];
    run(r, boxed, cameras, c)
}

fn random_walk(r: &mut Random, c: &Conditions) -> Arc<[f64]> {
    let RateVariation::Walks(in_a_minute) = c.wander else {
        return Arc::default();
    };
    let sigma = in_a_minute * (WALK_STEP_US / 60e6).sqrt();
    let (mut rate, mut phase) = (0.0, 0.0);
    let steps = 0..(c.span_s * 1e6 / WALK_STEP_US) as usize + 60;
    let each = steps.map(|_| {
        let now = phase;
        phase += rate * WALK_STEP_US;
        rate += sigma * r.normal();
        now
    });
    each.collect()
}

/// What a bench with these clocks records.
pub(crate) fn run(mut r: Random, boxed: Clock, cameras: [Clock; 2], c: &Conditions) -> Bench {
    let mut trains = Vec::new();
    let mut presses = Vec::new();
    let mut free_us = 0.0;
    let mut send = |at_us: f64, label: Label, trains: &mut Vec<(f64, Label)>| {
        let at_us = f64::max(at_us, free_us);
        free_us = at_us + 14_000.0;
        trains.push((at_us, label));
    };
    let syncs = (c.span_s / f64::from(c.sync_s)) as u32;
    for sync in 0..syncs {
        let begin = f64::from(sync * c.sync_s) * 1e6 + 20_000.0;
        send(begin, Label::Sync(sync), &mut trains);
        if sync.is_multiple_of(2) {
            let contact = begin + r.between(50_000.0, 300_000.0);
            presses.push(contact);
            for (after, kind) in [
                (0.0, MarkKind::Contact),
                (150_000.0, MarkKind::AtDepth),
                (500_000.0, MarkKind::Release),
            ] {
                let mark = Mark {
                    kind,
                    press: PressId::from_index(sync / 2),
                };
                send(contact + after, Label::Mark(mark), &mut trains);
            }
        }
    }
    let mut reports = Vec::new();
    for k in 0..(c.span_s / c.exchange_s).round() as u32 {
        let sent = f64::from(k) * c.exchange_s * 1e6;
        let [there, back] = c.delay.draw(&mut r, sent * 1e-6 / c.span_s);
        let read = sent + there;
        let received = read + back;
        let at = BoxTime {
            us: boxed.at(read) as u64,
        };
        reports.push(BoxReport::Exchange {
            sent: HostTime((sent * 1e3) as i64),
            received: HostTime((received * 1e3) as i64),
            at,
        });
    }
    let mut edges = [Vec::new(), Vec::new()];
    let mut seen_us = [(f64::INFINITY, f64::NEG_INFINITY); 2];
    for (at_us, label) in &trains {
        let start = boxed.at(*at_us);
        let at = BoxTime { us: start as u64 };
        reports.push(match *label {
            Label::Mark(mark) => BoxReport::Mark { mark, at },
            Label::Sync(count) => BoxReport::Sync { count, at },
        });
        for (k, (camera, edges)) in cameras.iter().zip(&mut edges).enumerate() {
            if c.lost_trains > 0.0 && r.between(0.0, 1.0) < c.lost_trains {
                continue;
            }
            seen_us[k] = (seen_us[k].0.min(*at_us), seen_us[k].1.max(*at_us));
            let mut put = |host_us: f64, rising: bool| {
                edges.push(TriggerEdge {
                    t_us: camera.at(host_us) as u64,
                    channel: 0,
                    rising,
                });
            };
            for (offset, rising) in PulseTrain::of(*label).unwrap().edges() {
                // The box counts the offset on its own clock.
                let host_us = at_us + offset as f64 / (1.0 + boxed.drift);
                let late = if c.decays {
                    -c.jitter_us * libm::log(r.between(1e-9, 1.0))
                } else {
                    r.between(0.0, c.jitter_us)
                };
                if r.between(0.0, 1.0) >= c.lost {
                    put(host_us + late, rising);
                }
                if r.between(0.0, 1.0) < c.doubled {
                    put(host_us + late + r.between(1.0, 10.0), rising);
                }
                if r.between(0.0, 1.0) < c.spurious {
                    let up = r.between(0.0, 1.0) < 0.5;
                    put(at_us + r.between(0.0, PulseTrain::DURATION_US as f64), up);
                }
            }
        }
    }
    edges.iter_mut().for_each(|e| e.sort_by_key(|e| e.t_us));
    Bench {
        boxed,
        cameras,
        reports,
        edges,
        recorded: [Vec::new(), Vec::new()],
        presses,
        seen_us,
    }
}

impl Bench {
    pub(crate) fn align(&self, limits: &AlignmentSettings) -> TimeBase {
        let ties = TimeBaseInput {
            reports: &self.reports,
            edges: [&self.edges[0], &self.edges[1]],
            channel: 0,
            recorded: [&self.recorded[0], &self.recorded[1]],
            legs: &[],
            used_at_us: &self.presses,
        };
        TimeBase::new(&ties, limits).unwrap()
    }
}
