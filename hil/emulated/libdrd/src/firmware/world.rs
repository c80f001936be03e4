//! The complete arm: body, controller and regulation loop, advanced in real time in fixed steps.

use skinrig_drd_abi::WATCHDOG_UNIT_US;

use super::body::Body;
use super::faults::Faults;
use super::initialise::Initialisation;
use super::regulation::{Regulation, gravity_compensation};
use super::settings::Settings;
use super::vector::{Vector, ZERO, add, norm, sub};
use crate::config::{ArmConfig, Fault};
use crate::page::{ArmState, Mode};

/// Simulation step, µs.
pub const STEP_US: u32 = 250;

/// Why the power went off, as in the status vector.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    None = 0,
    Button = 1,
    Velocity = 2,
    Watchdog = 3,
    Software = 4,
    Usb = 5,
}

/// The process that has the arm open.
#[derive(Debug, Clone, Copy)]
pub struct Holder {
    /// Number of its connection.
    pub connection: u64,
    /// Its process.
    pub pid: u32,
    /// Whether it is stopped by a signal, so that its regulation loop does not run.
    pub stopped: bool,
}

/// Buffer of the regulation loop.
#[derive(Debug, Clone, Copy)]
struct LoopBuffer {
    position: Vector,
    velocity: Vector,
}

/// State of one arm.
#[derive(Debug)]
pub struct World {
    pub config: ArmConfig,
    pub body: Body,
    pub settings: Settings,
    pub faults: Faults,
    pub holder: Option<Holder>,
    pub regulation: Option<Regulation>,
    pub initialisation: Option<Initialisation>,
    pub initialised: bool,
    pub mode: Mode,
    pub cause: Cause,
    /// Whether the force button on the base is active.
    pub button_off: bool,
    /// Last commanded motor force, N.
    pub commanded: Vector,
    /// Time of the last command, ns.
    pub last_command_ns: u64,
    t_ns: u64,
    tick: u64,
    since_tick_us: f64,
    buffer: LoopBuffer,
    watchdog_trips: u64,
    velocity_trips: u64,
}

impl World {
    /// An arm that was just switched on.
    pub fn new(config: ArmConfig, t_ns: u64) -> Self {
        let body = Body::new(&config);
        Self {
            settings: Settings::new(&config),
            faults: Faults::default(),
            holder: None,
            regulation: None,
            initialisation: None,
            initialised: config.initialised,
            mode: if config.initialised {
                Mode::Brake
            } else {
                Mode::Reset
            },
            cause: Cause::None,
            button_off: false,
            commanded: ZERO,
            last_command_ns: t_ns,
            t_ns,
            tick: 0,
            since_tick_us: 0.0,
            buffer: LoopBuffer {
                position: body.position,
                velocity: ZERO,
            },
            watchdog_trips: 0,
            velocity_trips: 0,
            body,
            config,
        }
    }

    /// Current simulation time, ns.
    pub fn t_ns(&self) -> u64 {
        self.t_ns
    }

    /// Advances the arm to the current time.
    pub fn advance_to(&mut self, now_ns: u64) {
        while self.t_ns + u64::from(STEP_US) * 1000 <= now_ns {
            self.t_ns += u64::from(STEP_US) * 1000;
            self.step(f64::from(STEP_US) * 1e-6);
        }
    }

    fn step(&mut self, dt: f64) {
        self.apply_due_faults();
        self.body.stalled = self.faults.any(|f| matches!(f, Fault::Stalled));
        let rub = self.faults.find(|f| match *f {
            Fault::Friction(n_s_m) => Some(n_s_m),
            _ => None,
        });
        self.body.extra_friction_n_s_m = rub.unwrap_or(0.0);
        self.initialise(dt);
        self.run_loop();
        let live = self.mode == Mode::Force;
        let braking = matches!(self.mode, Mode::Brake | Mode::Reset);
        let motor = if live { self.commanded } else { ZERO };
        self.body.step(&self.config, motor, braking, dt);
        if live {
            self.guard();
        }
    }

    /// Whether the loop's thread runs: started, its process alive and not stopped, and not suspended by a fault.
    fn loop_runs(&self) -> bool {
        self.regulation.is_some()
            && self.holder.is_some_and(|h| !h.stopped)
            && !self.faults.any(|f| matches!(f, Fault::RegulationHangs))
    }

    fn run_loop(&mut self) {
        let khz = self.faults.find(|f| match f {
            Fault::LoopRate(khz) => Some(*khz),
            _ => None,
        });
        let period_us = 1000.0 / khz.unwrap_or(self.config.loop_khz);
        self.since_tick_us += f64::from(STEP_US);
        if !self.loop_runs() || self.since_tick_us + 1e-6 < period_us {
            return;
        }
        let dt = self.since_tick_us * 1e-6;
        self.since_tick_us = 0.0;
        self.tick += 1;
        let (position, velocity) = (self.body.position, self.body.velocity);
        self.buffer = LoopBuffer { position, velocity };
        if let Some(regulation) = &mut self.regulation {
            self.commanded =
                regulation.iterate(&self.config, &self.settings, position, velocity, dt);
            self.last_command_ns = self.t_ns;
        }
    }

    /// The controller's own protections while the motors are live.
    fn guard(&mut self) {
        if self
            .body
            .velocity
            .iter()
            .any(|v| v.abs() > self.config.velocity_trip_m_s)
        {
            self.velocity_trips += 1;
            self.power_off(Cause::Velocity);
        }
        let limit_ns = u64::from(self.settings.watchdog) * u64::from(WATCHDOG_UNIT_US) * 1000;
        if limit_ns > 0 && self.t_ns - self.last_command_ns > limit_ns {
            self.watchdog_trips += 1;
            self.power_off(Cause::Watchdog);
        }
    }

    /// Switches the motors off and the brake on. A running regulation continues without power.
    pub fn power_off(&mut self, cause: Cause) {
        self.commanded = ZERO;
        self.cause = cause;
        self.mode = if self.initialised {
            Mode::Brake
        } else {
            Mode::Reset
        };
    }

    /// Switches the motors on, unless the button on the base prevents it.
    pub fn power_on(&mut self) -> bool {
        if !self.button_off {
            self.mode = Mode::Force;
            self.cause = Cause::None;
            self.last_command_ns = self.t_ns;
        }
        !self.button_off
    }

    /// Starts the regulation loop at the current position.
    pub(crate) fn start_regulation(&mut self) {
        self.regulation = Some(Regulation::new(self.body.position));
        self.commanded = gravity_compensation(&self.settings);
        self.power_on();
    }

    /// Applies the faults that are due.
    pub(crate) fn apply_due_faults(&mut self) {
        let touching = norm(self.body.contact_force) > 0.0;
        for event in self.faults.due(self.t_ns, self.body.position[2], touching) {
            self.apply_event(event);
        }
    }

    fn apply_event(&mut self, event: Fault) {
        match event {
            Fault::RegulationDies => {
                self.regulation = None;
                self.initialisation = None;
                self.power_off(Cause::Software);
            }
            Fault::Button => {
                self.button_off = !self.button_off;
                if self.button_off {
                    self.power_off(Cause::Button);
                }
            }
            Fault::VelocityTrip => {
                self.velocity_trips += 1;
                self.power_off(Cause::Velocity);
            }
            Fault::WatchdogTrip => {
                self.watchdog_trips += 1;
                self.power_off(Cause::Watchdog);
            }
            Fault::Lost => {
                self.release_holder();
                self.power_off(Cause::Usb);
            }
            Fault::PowerLost => {
                self.release_holder();
                self.initialised = false;
                self.settings = Settings::new(&self.config);
                self.power_off(Cause::None);
            }
            _ => {}
        }
    }

    /// Handles a disconnected library or a dead program: the regulation ends, and the motors keep the last commanded force.
    pub(crate) fn release_holder(&mut self) {
        self.holder = None;
        self.regulation = None;
        self.initialisation = None;
    }

    /// Whether a motion is in progress, as reported by the library.
    pub fn moving(&self) -> bool {
        let regulation = self.regulation.as_ref();
        regulation.is_some_and(Regulation::moving)
            || (regulation.is_some() && self.faults.any(|f| matches!(f, Fault::MovingForever)))
    }

    /// The public state of the arm.
    pub fn state(&mut self) -> ArmState {
        let motor_force_n = if self.mode == Mode::Force {
            self.commanded
        } else {
            ZERO
        };
        let regulating = self.regulation.is_some();
        let (position, velocity) = if regulating {
            (self.buffer.position, self.buffer.velocity)
        } else {
            // Without the loop, readings come from the device.
            (self.body.position, self.body.velocity)
        };
        let force = if self.mode == Mode::Force {
            sub(motor_force_n, gravity_compensation(&self.settings))
        } else {
            ZERO
        };
        let resolution = self.config.resolution_m;
        let quantised = position.map(|x| (x / resolution).round() * resolution);
        let reported = self
            .faults
            .report(self.t_ns, self.tick, quantised, velocity, force);
        ArmState {
            t_ns: self.t_ns,
            tick: reported.tick,
            position_m: self.body.position,
            velocity_m_s: self.body.velocity,
            motor_force_n,
            contact_force_n: self.body.contact_force,
            reference_m: self
                .regulation
                .as_ref()
                .map_or(self.body.position, |r| r.reference),
            reported_position_m: reported.position,
            reported_velocity_m_s: reported.velocity,
            reported_force_n: reported.force,
            mode: self.mode,
            force_off_cause: self.cause as i32,
            watchdog_trips: self.watchdog_trips,
            velocity_trips: self.velocity_trips,
            initialised: self.initialised,
            initialising: self.initialisation.is_some(),
            regulating,
            moving: self.moving(),
            connected: !self.faults.any(|f| matches!(f, Fault::Lost)),
            saturated: self.regulation.as_ref().is_some_and(|r| r.saturated),
            held: self.holder.is_some(),
        }
    }

    /// Whether a target lies in the reachable sphere.
    pub fn reachable(&self, target: Vector) -> bool {
        norm(sub(target, self.config.reach_centre_m)) <= self.config.reach_radius_m
    }

    /// The point near the surface of the reachable sphere in that direction from its centre.
    pub fn inside(&self, direction: Vector) -> Vector {
        let reach = 0.95 * self.config.reach_radius_m;
        add(self.config.reach_centre_m, direction.map(|x| x * reach))
    }
}
