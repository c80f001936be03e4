//! The states of the robot and what may be asked of it in each. Runs on the thread that owns the library, on any clock.

mod armed;
mod arming;
mod cycle;

use std::sync::Arc;

use skinrig_device::{Clock, DeviceError, MotionLimits, limits};
use skinrig_model::{DeviceRole, HostDuration, Point3, Robot, Setting};

use armed::{Armed, rises};

use crate::brake::{MayBeLive, brake};
use crate::config::{OmegaConfig, Patience};
use crate::monitor::Trip;
use crate::open::{NotSet, Opened, seen};
use crate::regulation;
use crate::sdk::{CallError, Sdk};
use crate::span::span;
use crate::stream::Stream;
use crate::supervisor::Supervisor;

/// Time between two looks at the status vector; each may cost an exchange on USB.
const STATUS_EVERY: HostDuration = HostDuration::from_millis(10);

/// Time between two looks at the rate of the regulation loop.
const CONTROL_EVERY: HostDuration = HostDuration::from_millis(100);

enum State {
    /// Motors off.
    Parked,
    /// Motors live.
    Armed(Box<Armed>),
    /// Braked after a fault, until disarmed.
    Tripped(Trip),
    /// Gone, until opened again.
    Lost(Trip),
}

/// One robot.
pub(crate) struct Engine<C: Clock> {
    sdk: Arc<dyn Sdk>,
    config: Arc<OmegaConfig>,
    opened: Opened,
    clock: C,
    stream: Arc<Stream>,
    supervisor: Option<Supervisor>,
    limits: Option<MotionLimits>,
    /// What the regulation read back when it was started last.
    started: Vec<Setting>,
    state: State,
    parked_hiccups: u32,
}

impl<C: Clock> Engine<C> {
    /// Takes an open, braked robot over.
    pub(crate) fn new(
        sdk: Arc<dyn Sdk>,
        config: Arc<OmegaConfig>,
        opened: Opened,
        clock: C,
        stream: Arc<Stream>,
        supervisor: Option<Supervisor>,
    ) -> Self {
        Self {
            sdk,
            config,
            opened,
            clock,
            stream,
            supervisor,
            limits: None,
            started: Vec::new(),
            state: State::Parked,
            parked_hiccups: 0,
        }
    }

    /// Time between two cycles.
    pub(crate) fn period(&self) -> HostDuration {
        let hz = match self.state {
            State::Armed(_) => self.config.motion.cycle_hz,
            _ => self.config.motion.parked_hz,
        };
        HostDuration::from_secs_f64(1.0 / hz)
    }

    fn lost(&self, detail: impl ToString) -> DeviceError {
        DeviceError::Lost {
            role: DeviceRole::Indenter,
            serial: self.opened.serial.clone(),
            detail: detail.to_string(),
        }
    }

    fn wrong_state(&self, expected: &str, found: impl ToString) -> DeviceError {
        limits::wrong_state(&self.opened.serial, expected, &found.to_string())
    }

    fn of_trip(&self, trip: &Trip) -> DeviceError {
        if trip.is_loss() || matches!(trip, Trip::NotBraked(_)) {
            self.lost(trip)
        } else {
            self.wrong_state("armed", format!("braked: {trip}"))
        }
    }

    fn not_set(&self, error: NotSet) -> DeviceError {
        error
            .into_omega(&self.opened.serial)
            .into_device(&self.opened.serial)
    }

    fn of_call(&self, call: CallError) -> DeviceError {
        self.not_set(NotSet::Call(call))
    }

    /// Writes the limits and reads them back.
    pub(crate) fn configure(&mut self, wanted: &MotionLimits) -> Result<Vec<Setting>, DeviceError> {
        self.stream.watch();
        if let State::Lost(trip) = &self.state {
            return Err(self.lost(trip));
        }
        let mut settings = limits::settings(wanted);
        let written = regulation::apply(&*self.sdk, self.opened.id, &self.config, wanted);
        match written {
            Ok(more) => settings.extend(more),
            Err(NotSet::Call(e))
                if regulation::needs_regulation(&e) && !matches!(self.state, State::Armed(_)) =>
            {
                // Written and read back when armed; what the arming before this one read is told here.
                settings.push(seen(
                    "regulation",
                    "set when armed: this library takes no settings before",
                ));
                settings.extend(self.started.iter().cloned());
            }
            Err(e) => return Err(self.not_set(e)),
        }
        settings.extend(self.opened.settings.iter().cloned());
        settings.push(Setting {
            name: "initialised".to_owned(),
            requested: "true".to_owned(),
            read_back: self.sdk.is_initialized(self.opened.id).to_string(),
        });
        self.limits = Some(*wanted);
        if let State::Armed(armed) = &mut self.state {
            armed.monitor.set_limits(*wanted);
            armed
                .trajectory
                .set_acceleration(wanted.max_acceleration_mm_s2);
        }
        Ok(settings)
    }

    fn brake(&mut self) -> Result<(), MayBeLive> {
        let (sdk, id, patience) = (Arc::clone(&self.sdk), self.opened.id, self.config.patience);
        let clock = &mut self.clock;
        brake(&*sdk, id, &patience, |pause| {
            let until = clock.now() + span(pause);
            clock.wait_until(until);
        })
        .map(drop)
    }

    /// Sends the set point to `target`.
    pub(crate) fn go(&mut self, target: Point3<Robot>, speed_mm_s: f64) -> Result<(), DeviceError> {
        self.stream.watch();
        let limits = self.limits;
        let (armed, limits) = match (&mut self.state, limits) {
            (State::Armed(armed), Some(limits)) => (armed, limits),
            (State::Tripped(trip) | State::Lost(trip), _) => {
                let trip = trip.clone();
                return Err(self.of_trip(&trip));
            }
            _ => return Err(self.wrong_state("armed", "disarmed")),
        };
        limits::check_command(&self.opened.serial, &limits, target, speed_mm_s)?;
        let rises = rises(armed.trajectory.set_point(), target);
        if !rises && (armed.must_rise || armed.overloaded) {
            return Err(limits::refused(
                &self.opened.serial,
                format!(
                    "a target above the set point, and no further aside than above, after more than {} N",
                    limits.max_force_n
                ),
                format!("{target:?}"),
            ));
        }
        armed.rising = rises;
        armed.must_rise &= !rises;
        armed.trajectory.go(target, speed_mm_s);
        Ok(())
    }

    /// Brings the set point to rest.
    pub(crate) fn hold(&mut self) -> Result<(), DeviceError> {
        self.stream.watch();
        match &mut self.state {
            State::Armed(armed) => {
                armed.trajectory.hold();
                Ok(())
            }
            State::Parked => Ok(()),
            State::Tripped(trip) | State::Lost(trip) => {
                let trip = trip.clone();
                Err(self.of_trip(&trip))
            }
        }
    }

    /// Motors off, brake on, faults forgotten. When the robot does not confirm, it stays tripped.
    pub(crate) fn disarm(&mut self) -> Result<(), DeviceError> {
        if let State::Lost(trip) = &self.state {
            let error = self.lost(trip);
            let once = Patience {
                brake_attempts: 1,
                ..self.config.patience
            };
            // Best effort: it may be there again, and live.
            let _ = brake(&*self.sdk, self.opened.id, &once, |_| ());
            return Err(error);
        }
        if let State::Armed(armed) = &mut self.state {
            armed.trajectory.halt();
        }
        match self.brake() {
            Ok(()) => {
                self.state = State::Parked;
                self.stream.heal();
                Ok(())
            }
            Err(live) => Err(self.not_braked(live.to_string())),
        }
    }
}

impl<C: Clock> Drop for Engine<C> {
    /// However the owner ends, the arm is braked and the device closed. The supervisor is dismissed only when the
    /// robot confirmed that; else it takes over.
    fn drop(&mut self) {
        let braked = match self.state {
            State::Lost(_) => false,
            _ => self.brake().is_ok(),
        };
        let closed = self.sdk.close(self.opened.id).is_ok();
        if let Some(supervisor) = self.supervisor.take().filter(|_| braked && closed) {
            supervisor.dismiss();
        }
    }
}
