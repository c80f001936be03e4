//! Powering the motors up: what must hold before, and what is waited for.

use std::sync::Arc;

use skinrig_device::{Clock, DeviceError, MotionLimits};
use skinrig_drd_abi::{ForceOffCause, StatusField};

use super::armed::{Armed, Tare};
use super::{CONTROL_EVERY, Engine, STATUS_EVERY, State, span};
use crate::config::Envelope;
use crate::correction::Correction;
use crate::monitor::{Freshness, Monitor, Trip};
use crate::regulation;
use crate::supervisor::Supervisor;
use crate::trajectory::{Trajectory, norm};
use crate::weighing::Weighing;

/// Standard gravity, m/s².
const GRAVITY_M_S2: f64 = 9.806_65;

/// The share of the motors' torque that carries the arm at rest: gravity compensation, which the library leaves out of the force that it
/// reports (public text derived from the vendor's), and what is reported beside it.
fn carries(envelope: &Envelope, mass_kg: Option<f64>, reported_n: f64) -> String {
    let Some(mass_kg) = mass_kg else {
        return format!(
            "at rest the motors push with {reported_n:.2} N besides gravity compensation, whose mass this library does not tell"
        );
    };
    let compensation_n = mass_kg * GRAVITY_M_S2;
    let share = (compensation_n + reported_n) / envelope.n_per_ratio;
    format!(
        "gravity compensation carries {compensation_n:.2} N (effector mass {mass_kg} kg), the motors push with {reported_n:.2} N \
         more at rest: gravity_ratio {share:.3} at {} N per ratio; the rig file says {}",
        envelope.n_per_ratio, envelope.gravity_ratio
    )
}

/// Which cap the arm was held with, and what to do when that is too little to carry it.
fn cap(envelope: &Envelope, limits: &MotionLimits) -> String {
    format!(
        "Its motors may use {:.3} of their torque: if the arm sinks with that, raise `limits.max_force` ({} N) or settle \
         `robot.motor_force.gravity_ratio` ({}), docs/how-to/bench.md",
        envelope.ratio_of(limits.max_force_n),
        limits.max_force_n,
        envelope.gravity_ratio
    )
}

impl<C: Clock> Engine<C> {
    /// Powers the motors, waits until the regulation runs at full rate, and takes the force at rest as zero.
    pub(crate) fn arm(&mut self) -> Result<(), DeviceError> {
        match &self.state {
            State::Armed(_) => return Ok(()),
            State::Tripped(trip) => {
                return Err(self.wrong_state("disarmed after a fault", format!("braked: {trip}")));
            }
            State::Lost(trip) => return Err(self.lost(trip)),
            State::Parked => {}
        }
        let Some(limits) = self.limits else {
            return Err(self.wrong_state("configured", "without limits"));
        };
        if let Some(Err(why)) = self.supervisor.as_mut().map(Supervisor::check) {
            return Err(self.wrong_state("guarded by its supervisor process", why));
        }
        self.check_ready()?;
        if let Err(e) = self.power_up(&limits) {
            return Err(self.brake_after(e));
        }
        let deadline =
            self.clock.now() + span(self.config.trips.tare) + span(self.config.patience.regulation);
        loop {
            let next = self.clock.now() + self.period();
            self.clock.wait_until(next);
            self.tick();
            match &self.state {
                State::Armed(armed) if let Tare::Known(carried) = armed.tare => {
                    let mass = self.opened.effector_mass_kg;
                    self.stream
                        .note(carries(&self.config.envelope, mass, norm(carried)));
                    return Ok(());
                }
                State::Armed(_) if self.clock.now() < deadline => {}
                State::Armed(_) => {
                    let found = format!(
                        "moving or without new readings; see that the arm hangs free. {}",
                        cap(&self.config.envelope, &limits)
                    );
                    let e = self.wrong_state("still, to take the force at rest as zero", found);
                    return Err(self.brake_after(e));
                }
                _ => {
                    // The failure is told here, and not again by the next poll.
                    let failure = match &self.state {
                        // Held by too little torque it falls.
                        State::Tripped(
                            trip @ (Trip::Deviation { .. }
                            | Trip::Jump { .. }
                            | Trip::OutsideBox { .. }),
                        ) => {
                            let found =
                                format!("braked: {trip}. {}", cap(&self.config.envelope, &limits));
                            Some(self.wrong_state("armed", found))
                        }
                        _ => self.stream.failure(),
                    };
                    if matches!(&self.state, State::Tripped(trip) if !matches!(trip, Trip::NotBraked(_)))
                    {
                        self.state = State::Parked;
                        self.stream.heal();
                    }
                    return Err(
                        failure.unwrap_or_else(|| self.wrong_state("armed", "braked again"))
                    );
                }
            }
        }
    }

    fn check_ready(&self) -> Result<(), DeviceError> {
        let id = self.opened.id;
        let status = self.sdk.status(id).map_err(|e| self.of_call(e))?;
        if status.get(StatusField::Power) == Some(0) {
            return Err(self.wrong_state("powered", "without power; switch the robot on"));
        }
        if status.is(StatusField::Error) {
            let found = "reporting a fault of its controller; power-cycle it";
            return Err(self.wrong_state("without a fault", found));
        }
        if !self.sdk.is_initialized(id) {
            let found = "not calibrated since power-up (its LED blinks)";
            return Err(self.wrong_state("initialised", found));
        }
        Ok(())
    }

    fn power_up(&mut self, limits: &MotionLimits) -> Result<(), DeviceError> {
        let (sdk, id) = (Arc::clone(&self.sdk), self.opened.id);
        let here = sdk.position(id).map_err(|e| self.of_call(e))?;
        if !here.position_m.iter().all(|c| c.is_finite()) {
            return Err(self.wrong_state("at a known position", "without one (not a number)"));
        }
        let started = regulation::start(&*sdk, id, &self.config, limits);
        self.started = started.map_err(|e| self.not_set(e))?;
        let (khz, old_cause) = self.await_regulation()?;
        // A braked arm sinks: the set point begins where the regulation holds it now.
        let now = self.clock.now();
        let here = sdk.regulated_position(id).map_err(|e| self.of_call(e))?;
        let tip = self.config.mount.axes.point_from_metres(here.position_m);
        if !tip.is_finite() {
            return Err(self.wrong_state("at a known position", "without one (not a number)"));
        }
        let mut freshness = Freshness::new(self.config.trips.min_control_khz);
        freshness.set_rate(khz);
        let mut trajectory = Trajectory::at_rest(self.config.motion, tip);
        trajectory.set_acceleration(limits.max_acceleration_mm_s2);
        self.state = State::Armed(Box::new(Armed {
            trajectory,
            monitor: Monitor::new(self.config.trips, *limits, now, tip.to_array()),
            correction: Correction::none(self.config.motion, tip.to_array()),
            freshness,
            tare: Tare::Taking(Weighing::begin(now)),
            last: now,
            heard: now,
            watched: now,
            old_cause,
            tip,
            status_due: now,
            control_due: now + CONTROL_EVERY,
            hiccups: 0,
            rising: false,
            must_rise: false,
            overloaded: false,
        }));
        Ok(())
    }

    /// Waits until the regulation runs, the motors are live and the loop is fast enough; gives its rate, kHz, and why
    /// the device says that the motors went off the last time.
    fn await_regulation(&mut self) -> Result<(f64, Option<ForceOffCause>), DeviceError> {
        let (sdk, id) = (Arc::clone(&self.sdk), self.opened.id);
        let least = self.config.trips.min_control_khz;
        let deadline = self.clock.now() + span(self.config.patience.regulation);
        // The rate is a mean since the call before: this one begins the interval.
        let _ = sdk.control_khz(id);
        loop {
            let next = self.clock.now() + STATUS_EVERY;
            self.clock.wait_until(next);
            let running = sdk.is_running(id);
            let status = sdk.status(id).map_err(|e| self.of_call(e))?;
            let live = status.is(StatusField::Force);
            let khz = sdk.control_khz(id).unwrap_or(0.0);
            if running && live && khz >= least {
                return Ok((khz, status.force_off_cause()));
            }
            if self.clock.now() >= deadline {
                let found = if !running {
                    "not running".to_owned()
                } else if live {
                    format!("at {khz:.3} kHz")
                } else {
                    let cause = status.force_off_cause().unwrap_or(ForceOffCause::None);
                    let words = crate::open::cause_words(cause);
                    format!(
                        "without motor power ({words}); press the force button on the base to allow it"
                    )
                };
                let expected = format!("regulated at {least} kHz or more with live motors");
                return Err(self.wrong_state(&expected, found));
            }
        }
    }

    /// Brakes after `error`; tells both if that fails too.
    pub(super) fn brake_after(&mut self, error: DeviceError) -> DeviceError {
        match self.brake() {
            Ok(()) => {
                self.state = State::Parked;
                error
            }
            Err(live) => self.not_braked(format!("{error}; {live}")),
        }
    }

    /// The brake failed: nothing is commanded any more, every poll says so, and disarming tries again.
    pub(super) fn not_braked(&mut self, why: String) -> DeviceError {
        let error = self.lost(&why);
        self.state = State::Tripped(Trip::NotBraked(why));
        self.stream.heal();
        self.stream.fail(error.clone());
        error
    }
}
