//! The skin world shared by the simulated devices: motion on a grid of 1 ms, the reading position of each device, and the trigger line.
//!
//! The world does not depend on polling: it advances in steps of [`GRID_NS`], and each device reads everything up to the last grid point
//! before the current time.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use skinrig_device::{Clock, RobotSample};
use skinrig_model::{CameraId, HostTime, Point3, RigFault, RigidTransform, Robot, Skin};

use crate::clock::SimClock;
use crate::config::SimConfig;
use crate::faults::{
    self, BOX_NOISE, FaultSizes, FaultTrigger, MarkFault, SPIKE_N, SPIKE_NS, Z_ERROR_MM_S,
};
use crate::line::Line;
use crate::motion::Motion;
use crate::phase_tracker::PhaseTracker;
use crate::scene::{GRID_NS, TipSample};

/// Height above which the tip has left the skin, mm; a hysteresis for a tip measured at rest on the surface.
const LEFT_MM: f64 = 0.05;

/// State of the world.
#[derive(Debug)]
pub struct World {
    /// The robot.
    pub motion: Motion,
    skin_from_robot: RigidTransform<Skin, Robot>,
    faults: Vec<(RigFault, FaultTrigger)>,
    sizes: FaultSizes,
    grid: i64,
    samples: VecDeque<RobotSample>,
    tips: VecDeque<TipSample>,
    /// Grid index of `tips[0]`.
    tips_from: i64,
    /// Next grid index of each camera; `None` while it does not stream.
    requested: [Option<i64>; 2],
    /// The trigger line.
    pub line: Line,
    contacts: u32,
    contact_times: Vec<i64>,
    phases: PhaseTracker,
    touching: bool,
    last_z_mm: f64,
    /// Height of the tip above the reported one because of a fault, mm.
    z_error_mm: f64,
    force_limit_n: f64,
    /// Whether the robot stopped by itself; the next rise releases it.
    tripped: bool,
    /// Whether the force exceeds its limit.
    overloaded: bool,
    /// Whether the current motion leads away from the skin, so that no force stops it.
    rising: bool,
}

impl World {
    fn new(config: &SimConfig) -> Self {
        let start = config.robot_from_skin.apply(config.start);
        let mut world = Self {
            motion: Motion::new(config.motion, config.seed, config.legs_before, start),
            skin_from_robot: config.robot_from_skin.inverse(),
            faults: faults::timed(&config.faults).collect(),
            sizes: config.fault_sizes,
            grid: 0,
            samples: VecDeque::new(),
            tips: VecDeque::new(),
            tips_from: 0,
            requested: [None; 2],
            line: Line::new(config),
            contacts: 0,
            contact_times: Vec::new(),
            phases: PhaseTracker::default(),
            touching: false,
            last_z_mm: config.start.z_mm,
            z_error_mm: 0.0,
            force_limit_n: f64::INFINITY,
            tripped: false,
            overloaded: false,
            rising: false,
        };
        world.observe();
        world
    }

    /// Advances to the last grid point at or before `now`.
    pub fn advance_to(&mut self, now: HostTime) {
        let until = now.0.div_euclid(GRID_NS);
        while self.grid < until {
            self.grid += 1;
            self.apply_faults();
            self.motion.step();
            self.observe();
        }
        self.line.advance(now.0);
    }

    fn apply_faults(&mut self) {
        for n in 0..self.faults.len() {
            let (kind, when) = self.faults[n];
            if !self.has_occurred(when) {
                continue;
            }
            match kind {
                RigFault::RobotSlow => {
                    self.motion.bandwidth = f64::from(self.sizes.slow_percent) / 100.0;
                }
                RigFault::RobotLost => self.motion.power_off(),
                RigFault::RobotStalled => self.motion.stalled = true,
                // The robot reports its tip higher than it is: the tip is lower.
                RigFault::RobotZHigh => self.move_z_error(-1.0),
                RigFault::RobotZLow => self.move_z_error(1.0),
                RigFault::LineCut(camera) => self.line.cut(camera),
                RigFault::LineNoisy(camera) => {
                    self.line.set_noise(camera, self.sizes.line_noise);
                }
                RigFault::BoxNoisy => {
                    for camera in CameraId::ALL {
                        self.line.set_noise(camera, BOX_NOISE);
                    }
                }
                RigFault::TriggerLost => self.line.set_mark_fault(n, MarkFault::Lost),
                RigFault::TriggerDoubled => self.line.set_mark_fault(n, MarkFault::Doubled),
                RigFault::TriggerDelayed => self.line.set_mark_fault(n, MarkFault::Delayed),
                _ => {}
            }
        }
    }

    /// Moves the error of the reported height by one step towards its size.
    fn move_z_error(&mut self, sign: f64) {
        let most_mm = Z_ERROR_MM_S * GRID_NS as f64 * 1e-9;
        let left_mm = sign * f64::from(self.sizes.z_error_um) * 1e-3 - self.z_error_mm;
        self.z_error_mm += left_mm.clamp(-most_mm, most_mm);
    }

    /// True tip position on the skin, whatever the robot reports.
    fn true_tip(&self) -> Point3<Skin> {
        let mut tip = self.skin_from_robot.apply(self.motion.tip());
        tip.z_mm += self.z_error_mm;
        tip
    }

    fn observe(&mut self) {
        let t_ns = self.grid * GRID_NS;
        let position = self.true_tip();
        let rate = (self.last_z_mm - position.z_mm) / (GRID_NS as f64 * 1e-9);
        // Time at which the straight path from the last grid point to this one crossed a height.
        let passed = |z_mm: f64| {
            let ahead = (position.z_mm - z_mm) / (position.z_mm - self.last_z_mm);
            t_ns - (ahead.clamp(0.0, 1.0) * GRID_NS as f64) as i64
        };
        if position.z_mm < 0.0 && !self.touching {
            self.touching = true;
            self.contacts += 1;
            self.contact_times.push(t_ns);
            self.line.input(passed(0.0), true);
        } else if position.z_mm > LEFT_MM && self.touching {
            self.touching = false;
            self.line.input(passed(LEFT_MM), false);
        }
        self.last_z_mm = position.z_mm;
        if self.motion.is_at_rest() {
            self.phases.at_rest(t_ns, self.touching);
        }
        let (force_n, mut felt_n) = self.motion.force_n(-position.z_mm, rate);
        for (kind, when) in &self.faults {
            if *kind == RigFault::RobotForceSpike
                && let Some(from_ns) = self.occurred_at(*when)
                && (from_ns..from_ns + SPIKE_NS).contains(&t_ns)
            {
                felt_n += SPIKE_N;
            }
        }
        self.overloaded = force_n > self.force_limit_n;
        if self.overloaded && !self.rising {
            self.tripped = true;
            self.motion.hold();
        }
        self.samples.push_back(RobotSample {
            t: HostTime(t_ns),
            commanded: self.motion.set_point(),
            measured: self.motion.measure(),
            force_n: felt_n,
        });
        if self.requested.iter().any(Option::is_some) {
            if self.tips.is_empty() {
                self.tips_from = self.grid;
            }
            self.tips.push_back(TipSample { t_ns, position });
        }
    }

    /// Current grid index.
    #[must_use]
    pub const fn grid(&self) -> i64 {
        self.grid
    }

    /// Whether the fault trigger `when` has occurred.
    #[must_use]
    pub(crate) fn has_occurred(&self, when: FaultTrigger) -> bool {
        self.occurred_at(when)
            .is_some_and(|t| t <= self.grid * GRID_NS)
    }

    /// World time of `when`, ns, if it has occurred.
    #[must_use]
    pub(crate) fn occurred_at(&self, when: FaultTrigger) -> Option<i64> {
        match when {
            FaultTrigger::At(t) => Some(t.0),
            FaultTrigger::Contact(n) => self.contact_times.get(n as usize).copied(),
            FaultTrigger::Moment(moment, n) => self.phases.when(moment, n),
        }
    }

    /// Number of contacts so far.
    #[must_use]
    pub const fn contacts(&self) -> u32 {
        self.contacts
    }

    /// Sets the force at which the robot stops by itself, N.
    pub(crate) const fn set_force_limit(&mut self, limit_n: f64) {
        self.force_limit_n = limit_n;
    }

    /// True if only a rise is allowed: the robot stopped because of its force limit, and has not been commanded to
    /// rise since, or it still presses too hard.
    #[must_use]
    pub const fn must_rise(&self) -> bool {
        self.tripped || self.overloaded
    }

    /// Switches the motors on.
    pub fn power_on(&mut self) {
        self.motion.power_on();
        self.phases.armed(self.grid * GRID_NS);
    }

    /// Sends the robot to `target`.
    pub fn move_to(&mut self, target: Point3<Robot>, speed_mm_s: f64, rises: bool) {
        self.rising = rises;
        self.tripped &= !rises;
        let from = self.skin_from_robot.apply(self.motion.set_point());
        let to = self.skin_from_robot.apply(target);
        self.phases.sent(self.grid * GRID_NS, from, to);
        self.motion.move_to(target, speed_mm_s);
    }

    /// Stops the robot in place.
    pub fn hold(&mut self) {
        self.rising = false;
        self.motion.hold();
    }

    /// Takes all samples not yet taken.
    pub(crate) fn take_samples(&mut self, out: &mut Vec<RobotSample>) {
        out.extend(self.samples.drain(..));
    }

    /// Starts keeping tips for camera `index`, from the current grid point, which it returns.
    pub fn watch(&mut self, index: usize) -> i64 {
        self.requested[index] = Some(self.grid);
        let present = TipSample {
            t_ns: self.grid * GRID_NS,
            position: self.true_tip(),
        };
        if self.tips.is_empty() {
            self.tips_from = self.grid;
            self.tips.push_back(present);
        }
        self.line.take_edges(index).for_each(drop);
        self.grid
    }

    /// Stops keeping tips for camera `index`.
    pub(crate) fn unwatch(&mut self, index: usize) {
        self.requested[index] = None;
        self.forget();
    }

    /// The tips from grid index `from` to the present, both included; marks them as read by camera
    /// `index`, whose next call begins with the last of them.
    pub(crate) fn tips_since(&mut self, index: usize, from: i64, out: &mut Vec<TipSample>) {
        out.clear();
        let skip = usize::try_from(from - self.tips_from).unwrap_or(0);
        out.extend(self.tips.iter().skip(skip));
        self.requested[index] = Some(self.grid);
        self.forget();
    }

    fn forget(&mut self) {
        let needed = self.requested.iter().flatten().min().copied();
        match needed {
            None => self.tips.clear(),
            Some(first) => {
                while self.tips_from < first && self.tips.pop_front().is_some() {
                    self.tips_from += 1;
                }
            }
        }
    }
}

/// A handle on the world and its clock.
#[derive(Debug, Clone)]
pub struct Shared {
    /// The rig's clock.
    pub clock: SimClock,
    world: Arc<Mutex<World>>,
}

impl Shared {
    /// A new world at time 0.
    #[must_use]
    pub fn new(config: &SimConfig) -> Self {
        Self {
            clock: SimClock::new(),
            world: Arc::new(Mutex::new(World::new(config))),
        }
    }

    /// The current time.
    #[must_use]
    pub fn now(&self) -> HostTime {
        self.clock.now()
    }

    /// The world, advanced to the current time.
    pub fn world(&self) -> MutexGuard<'_, World> {
        // After a panic elsewhere, the world is still good enough to disarm.
        let mut world = self.world.lock().unwrap_or_else(PoisonError::into_inner);
        world.advance_to(self.clock.now());
        world
    }
}
