//! State machine of the robot. Runs on the thread that owns the library, with any clock.

mod armed;
mod arming;
mod cycle;

use std::sync::Arc;

use skinrig_device::{Clock, DeviceError, MotionLimits, limits};
use skinrig_model::{DeviceRole, HostDuration, Point3, Robot, Setting};

use armed::{ArmedState, rises};

use crate::brake::{BrakeUnconfirmed, brake};
use crate::config::{OmegaConfig, Timeouts};
use crate::monitor::Trip;
use crate::open::{OpenRobot, SettingError, observed_setting};
use crate::regulation;
use crate::sdk::{CallError, Sdk};
use crate::span::span;
use crate::stream::Stream;
use crate::supervisor::Supervisor;

/// Interval between two reads of the status vector; each may cost a USB transfer.
const STATUS_EVERY: HostDuration = HostDuration::from_millis(10);

/// Interval between two reads of the regulation loop's rate.
const CONTROL_EVERY: HostDuration = HostDuration::from_millis(100);

enum State {
    /// Motors off.
    Parked,
    /// Motors live.
    Armed(Box<ArmedState>),
    /// Braked after a fault, until disarmed.
    Tripped(Trip),
    /// Disconnected, until reopened.
    Lost(Trip),
}

/// One robot.
pub(crate) struct Engine<C: Clock> {
    sdk: Arc<dyn Sdk>,
    config: Arc<OmegaConfig>,
    opened: OpenRobot,
    clock: C,
    stream: Arc<Stream>,
    supervisor: Option<Supervisor>,
    limits: Option<MotionLimits>,
    /// Settings read back when the regulation was last started.
    started: Vec<Setting>,
    state: State,
    parked_busy_readings: u32,
}

impl<C: Clock> Engine<C> {
    /// Takes over an open, braked robot.
    pub(crate) fn new(
        sdk: Arc<dyn Sdk>,
        config: Arc<OmegaConfig>,
        opened: OpenRobot,
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
            parked_busy_readings: 0,
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

    fn trip_error(&self, trip: &Trip) -> DeviceError {
        if trip.is_loss() || matches!(trip, Trip::BrakeFailed(_)) {
            self.lost(trip)
        } else {
            self.wrong_state("armed", format!("braked: {trip}"))
        }
    }

    fn setting_error(&self, error: SettingError) -> DeviceError {
        error
            .into_omega(&self.opened.serial)
            .into_device(&self.opened.serial)
    }

    fn call_error(&self, call: CallError) -> DeviceError {
        self.setting_error(SettingError::Call(call))
    }

    /// Writes the limits and reads them back.
    pub(crate) fn configure(
        &mut self,
        requested: &MotionLimits,
    ) -> Result<Vec<Setting>, DeviceError> {
        self.stream.mark_active();
        if let State::Lost(trip) = &self.state {
            return Err(self.lost(trip));
        }
        let mut settings = limits::settings(requested);
        let written = regulation::apply(&*self.sdk, self.opened.id, &self.config, requested);
        match written {
            Ok(more) => settings.extend(more),
            Err(SettingError::Call(e))
                if regulation::needs_regulation(&e) && !matches!(self.state, State::Armed(_)) =>
            {
                // Written and read back when armed; report the values of the previous arming.
                settings.push(observed_setting(
                    "regulation",
                    "written when armed: this library accepts no settings before",
                ));
                settings.extend(self.started.iter().cloned());
            }
            Err(e) => return Err(self.setting_error(e)),
        }
        settings.extend(self.opened.settings.iter().cloned());
        settings.push(Setting {
            name: "initialised".to_owned(),
            requested: "true".to_owned(),
            read_back: self.sdk.is_initialized(self.opened.id).to_string(),
        });
        self.limits = Some(*requested);
        if let State::Armed(armed) = &mut self.state {
            armed.monitor.set_limits(*requested);
            armed
                .trajectory
                .set_acceleration(requested.max_acceleration_mm_s2);
        }
        Ok(settings)
    }

    fn brake(&mut self) -> Result<(), BrakeUnconfirmed> {
        let (sdk, id, timeouts) = (Arc::clone(&self.sdk), self.opened.id, self.config.timeouts);
        let clock = &mut self.clock;
        brake(&*sdk, id, &timeouts, |pause| {
            let until = clock.now() + span(pause);
            clock.wait_until(until);
        })
        .map(drop)
    }

    /// Starts a motion of the set point to `target`.
    pub(crate) fn go(&mut self, target: Point3<Robot>, speed_mm_s: f64) -> Result<(), DeviceError> {
        self.stream.mark_active();
        let limits = self.limits;
        let (armed, limits) = match (&mut self.state, limits) {
            (State::Armed(armed), Some(limits)) => (armed, limits),
            (State::Tripped(trip) | State::Lost(trip), _) => {
                let trip = trip.clone();
                return Err(self.trip_error(&trip));
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

    /// Stops the set point smoothly.
    pub(crate) fn hold(&mut self) -> Result<(), DeviceError> {
        self.stream.mark_active();
        match &mut self.state {
            State::Armed(armed) => {
                armed.trajectory.hold();
                Ok(())
            }
            State::Parked => Ok(()),
            State::Tripped(trip) | State::Lost(trip) => {
                let trip = trip.clone();
                Err(self.trip_error(&trip))
            }
        }
    }

    /// Switches the motors off, brakes, and clears faults. Stays tripped if the robot does not confirm.
    pub(crate) fn disarm(&mut self) -> Result<(), DeviceError> {
        if let State::Lost(trip) = &self.state {
            let error = self.lost(trip);
            let once = Timeouts {
                brake_attempts: 1,
                ..self.config.timeouts
            };
            // Best effort: the robot may be reachable again, and live.
            let _ = brake(&*self.sdk, self.opened.id, &once, |_| ());
            return Err(error);
        }
        if let State::Armed(armed) = &mut self.state {
            armed.trajectory.halt();
        }
        match self.brake() {
            Ok(()) => {
                self.state = State::Parked;
                self.stream.clear_failure();
                Ok(())
            }
            Err(live) => Err(self.brake_failed(live.to_string())),
        }
    }
}

impl<C: Clock> Drop for Engine<C> {
    /// Brakes the arm and closes the device however the owner ends. Dismisses the supervisor only if the robot confirmed; otherwise the
    /// supervisor takes over.
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
