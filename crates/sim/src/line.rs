//! The trigger line of a simulated rig: mark and sync trains on the inputs of both cameras, line faults, and the box's reports on its own
//! clock.

use std::collections::VecDeque;

use skinrig_model::{BoxReport, BoxTime, CameraId, Mark, PulseTrain};

use crate::config::SimConfig;
use crate::drifting::DriftingClock;
use crate::faults::{DELAY_NS, Fault, LineNoise, MarkFault};
use crate::random::{Purpose, Stream};

/// Camera channel to which the trigger box is connected.
pub(crate) const TRIGGER_CHANNEL: u8 = 0;

/// An edge on a camera's trigger input, in world time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LineEdge {
    /// World time, ns.
    pub t_ns: i64,
    /// Whether it is a rising edge.
    pub rising: bool,
}

/// Largest delay of a doubled edge, as from a bouncing contact, ns.
const BOUNCE_NS: f64 = 10_000.0;
/// Delay of a report to the host, ns.
const REPORT_NS: i64 = 300_000;

/// Duration of a train and the pause after it, ns of world time; the box's clock deviates by a few thousandths at most.
const TRAIN_NS: i64 = PulseTrain::DURATION_US as i64 * 1_010;

/// The trigger line.
#[derive(Debug)]
pub struct Line {
    clock: DriftingClock,
    /// Interval of sync trains in world time, ns; 0 for none.
    sync_ns: i64,
    next_sync_ns: i64,
    syncs: u32,
    marks: u32,
    /// World time until which the line is busy, ns.
    busy_until_ns: i64,
    /// World time from which a sync train may start, ns: a whole train after the first edge of the previous one.
    sync_after_ns: i64,
    lost_pulses: Vec<(CameraId, u32, u32)>,
    /// Pending faults of marks.
    mark_faults: VecDeque<MarkFault>,
    /// Indices of the faults already applied to a mark.
    applied: Vec<usize>,
    noise: [LineNoise; 2],
    random: [Stream; 2],
    /// Edges that the cameras have not fetched yet.
    edges: [VecDeque<LineEdge>; 2],
    /// Reports in order, with the world time of their arrival at the host.
    reports: VecDeque<(i64, BoxReport)>,
    input: bool,
}

impl Line {
    /// Line of a rig at world time 0.
    #[must_use]
    pub fn new(config: &SimConfig) -> Self {
        let set = &config.trigger_box;
        let random = |index: u64| Stream::new(config.seed, Purpose::TriggerBox, index);
        let clock = DriftingClock::draw(set.max_origin_s, set.max_drift_ppm, &mut random(1), 0);
        let sync_ns = clock.world_ns(i64::from(set.sync_period_ms) * 1_000_000);
        let lost_pulse = |fault: &Fault| match *fault {
            Fault::PulseLost {
                camera,
                train,
                pulse,
            } => Some((camera, train, pulse)),
            _ => None,
        };
        Self {
            clock,
            sync_ns,
            next_sync_ns: sync_ns / 2,
            syncs: 0,
            marks: 0,
            busy_until_ns: 0,
            sync_after_ns: 0,
            lost_pulses: config.faults.iter().filter_map(lost_pulse).collect(),
            mark_faults: VecDeque::new(),
            applied: Vec::new(),
            noise: [LineNoise::default(); 2],
            random: [random(3), random(4)],
            edges: [VecDeque::new(), VecDeque::new()],
            reports: VecDeque::new(),
            input: set.contact_input,
        }
    }

    /// The box's clock.
    #[must_use]
    pub const fn clock(&self) -> DriftingClock {
        self.clock
    }

    /// Makes the edges of this camera noisy from now on.
    pub(crate) const fn set_noise(&mut self, camera: CameraId, noise: LineNoise) {
        self.noise[camera.index()] = noise;
    }

    /// Cuts the line of this camera.
    pub(crate) const fn cut(&mut self, camera: CameraId) {
        let cut = LineNoise {
            lost_percent: 100,
            doubled_percent: 0,
            spurious_percent: 0,
        };
        self.set_noise(camera, cut);
    }

    /// Applies fault `n` to the next mark.
    pub(crate) fn set_mark_fault(&mut self, n: usize, fault: MarkFault) {
        if !self.applied.contains(&n) {
            self.applied.push(n);
            self.mark_faults.push_back(fault);
        }
    }

    /// Sends the sync trains due by `now_ns`. A train waits while the line is busy.
    pub fn advance(&mut self, now_ns: i64) {
        while self.sync_ns > 0 {
            let start_ns = self.next_sync_ns.max(self.sync_after_ns);
            if start_ns > now_ns {
                return;
            }
            self.next_sync_ns += self.sync_ns;
            let train = PulseTrain::sync(self.syncs);
            let report = BoxReport::Sync {
                count: self.syncs,
                at: self.time(start_ns),
            };
            self.syncs = (self.syncs + 1) & skinrig_model::pulse::MAX_MARKED_PRESS;
            self.report(start_ns, report);
            self.add_train(train, start_ns, None);
            self.busy_until_ns = start_ns + TRAIN_NS;
            self.sync_after_ns = self.busy_until_ns;
        }
    }

    /// End of the current train, if the line is busy at world time `now_ns`.
    #[must_use]
    pub(crate) fn busy_until(&self, now_ns: i64) -> Option<i64> {
        (now_ns < self.busy_until_ns).then_some(self.busy_until_ns)
    }

    /// Sends the train of a mark whose first edge rises at `rise_ns`; the line is then busy until `until_ns`.
    pub fn send(&mut self, mark: Mark, train: PulseTrain, rise_ns: i64, until_ns: i64) {
        let at = self.time(rise_ns);
        self.report(rise_ns, BoxReport::Mark { mark, at });
        let fault = self.mark_faults.pop_front();
        let late_ns = match fault {
            None | Some(MarkFault::Lost) => 0,
            Some(MarkFault::Doubled) => TRAIN_NS,
            Some(MarkFault::Delayed) => DELAY_NS,
        };
        let (first, second) = match fault {
            None => (Some(rise_ns), None),
            Some(MarkFault::Lost) => (None, None),
            Some(MarkFault::Doubled) => (Some(rise_ns), Some(rise_ns + late_ns)),
            Some(MarkFault::Delayed) => (Some(rise_ns + late_ns), None),
        };
        for at_ns in [first, second].into_iter().flatten() {
            self.add_train(train, at_ns, Some(self.marks));
        }
        self.marks += 1;
        // No other train overlaps this one.
        self.busy_until_ns = until_ns + late_ns;
        // For the host the line is free one latency earlier than in reality.
        self.sync_after_ns = rise_ns + late_ns + TRAIN_NS;
    }

    /// The contact input changed at `t_ns`.
    pub fn input(&mut self, t_ns: i64, rising: bool) {
        if self.input {
            let at = self.time(t_ns);
            self.report(t_ns, BoxReport::Input { rising, at });
        }
    }

    /// The next report that arrived at the host by `now_ns`, with its arrival time.
    pub fn take_report(&mut self, now_ns: i64) -> Option<(i64, BoxReport)> {
        self.reports.pop_front_if(|(t_ns, _)| *t_ns <= now_ns)
    }

    /// Takes the edges of camera `index` in time order.
    pub fn take_edges(&mut self, index: usize) -> impl Iterator<Item = LineEdge> {
        self.edges[index].drain(..)
    }

    fn time(&self, t_ns: i64) -> BoxTime {
        BoxTime {
            us: self.clock.own_us(t_ns),
        }
    }

    fn report(&mut self, t_ns: i64, report: BoxReport) {
        let reaches = t_ns + REPORT_NS;
        let at = self.reports.partition_point(|(t, _)| *t <= reaches);
        self.reports.insert(at, (reaches, report));
    }

    /// Puts a train on both inputs; `mark` is its index among the marks.
    fn add_train(&mut self, train: PulseTrain, rise_ns: i64, mark: Option<u32>) {
        for camera in CameraId::ALL {
            let i = camera.index();
            let (noise, random) = (self.noise[i], &mut self.random[i]);
            let mut strikes =
                |percent: u8| percent > 0 && random.unit() * 100.0 < f64::from(percent);
            let mut arriving = Vec::new();
            let mut extra = Vec::new();
            for (k, (offset_us, rising)) in (0u32..).zip(train.edges()) {
                let pulse = k / 2;
                let t_ns = rise_ns + self.clock.world_ns(offset_us as i64 * 1_000);
                let edge = LineEdge { t_ns, rising };
                let is_lost = strikes(noise.lost_percent)
                    || mark.is_some_and(|n| self.lost_pulses.contains(&(camera, n, pulse)));
                if !is_lost {
                    arriving.push(edge);
                }
                if strikes(noise.doubled_percent) {
                    extra.push((edge, true));
                }
                if strikes(noise.spurious_percent) {
                    extra.push((edge, false));
                }
            }
            for (edge, doubled) in extra {
                let span_ns = PulseTrain::DURATION_US as f64 * 1_000.0;
                arriving.push(if doubled {
                    let t_ns = edge.t_ns + 1 + (random.unit() * BOUNCE_NS) as i64;
                    LineEdge { t_ns, ..edge }
                } else {
                    LineEdge {
                        t_ns: rise_ns + (random.unit() * span_ns) as i64,
                        rising: random.unit() < 0.5,
                    }
                });
            }
            arriving.sort_by_key(|edge| edge.t_ns);
            self.edges[i].extend(arriving);
        }
    }
}
