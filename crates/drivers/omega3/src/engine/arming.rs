//! Arming: preconditions, powering up, and the tare.

use std::sync::Arc;

use skinrig_device::{Clock, DeviceError, MotionLimits};
use skinrig_drd_abi::{ForceOffCause, StatusField};

use super::armed::{ArmedState, TareState};
use super::{CONTROL_EVERY, Engine, STATUS_EVERY, State, span};
use crate::config::Envelope;
use crate::correction::Correction;
use crate::monitor::{Freshness, Monitor, Trip};
use crate::regulation;
use crate::supervisor::Supervisor;
use crate::tare::TareAverage;
use crate::trajectory::{Trajectory, norm};

/// Standard gravity, m/s².
const GRAVITY_M_S2: f64 = 9.806_65;

/// Describes the share of motor torque that carries the arm at rest: gravity compensation, which the library excludes from its force
/// (according to public sources), plus the reported force.
fn describe_gravity_load(envelope: &Envelope, mass_kg: Option<f64>, reported_n: f64) -> String {
    let Some(mass_kg) = mass_kg else {
        return format!(
            "at rest the motors push with {reported_n:.2} N in addition to gravity compensation, whose mass this library does not report"
        );
    };
    let compensation_n = mass_kg * GRAVITY_M_S2;
    let share = (compensation_n + reported_n) / envelope.n_per_ratio;
    format!(
        "gravity compensation carries {compensation_n:.2} N (effector mass {mass_kg} kg), and the motors push with another \
        {reported_n:.2} N at rest: gravity_ratio {share:.3} at {} N per ratio; the rig file has {}",
        envelope.n_per_ratio, envelope.gravity_ratio
    )
}

/// Describes the force cap in use, and the next step if it is too small to carry the arm.
fn describe_force_cap(envelope: &Envelope, limits: &MotionLimits) -> String {
    format!(
        "The motors may use {:.3} of their torque: if the arm sinks, raise `limits.max_force` ({} N) or measure \
        `robot.motor_force.gravity_ratio` ({}), docs/how-to/bench.md",
        envelope.ratio_of(limits.max_force_n),
        limits.max_force_n,
        envelope.gravity_ratio
    )
}

impl<C: Clock> Engine<C> {
    /// Powers the motors, waits until the regulation runs at full rate, and measures the tare.
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
            return Err(self.brake_after_error(e));
        }
        let deadline =
            self.clock.now() + span(self.config.trips.tare) + span(self.config.timeouts.regulation);
        loop {
            let next = self.clock.now() + self.period();
            self.clock.wait_until(next);
            self.tick();
            match &self.state {
                State::Armed(armed) if let TareState::Known(carried) = armed.tare => {
                    let mass = self.opened.effector_mass_kg;
                    self.stream.note(describe_gravity_load(
                        &self.config.envelope,
                        mass,
                        norm(carried),
                    ));
                    return Ok(());
                }
                State::Armed(_) if self.clock.now() < deadline => {}
                State::Armed(_) => {
                    let found = format!(
                        "moving or without new readings; make sure that the arm hangs free. {}",
                        describe_force_cap(&self.config.envelope, &limits)
                    );
                    let e = self.wrong_state("at rest, to measure the tare", found);
                    return Err(self.brake_after_error(e));
                }
                _ => {
                    // Report the failure here, and not again at the next poll.
                    let failure = match &self.state {
                        // With too little torque the arm falls.
                        State::Tripped(
                            trip @ (Trip::Deviation { .. }
                            | Trip::Jump { .. }
                            | Trip::OutsideBox { .. }),
                        ) => {
                            let found = format!(
                                "braked: {trip}. {}",
                                describe_force_cap(&self.config.envelope, &limits)
                            );
                            Some(self.wrong_state("armed", found))
                        }
                        _ => self.stream.failure(),
                    };
                    if matches!(&self.state, State::Tripped(trip) if !matches!(trip, Trip::BrakeFailed(_)))
                    {
                        self.state = State::Parked;
                        self.stream.clear_failure();
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
        let status = self.sdk.status(id).map_err(|e| self.call_error(e))?;
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
        let position = sdk.position(id).map_err(|e| self.call_error(e))?;
        if !position.position_m.iter().all(|c| c.is_finite()) {
            return Err(self.wrong_state("at a known position", "without one (not a number)"));
        }
        let started = regulation::start(&*sdk, id, &self.config, limits);
        self.started = started.map_err(|e| self.setting_error(e))?;
        let (khz, old_cause) = self.await_regulation()?;
        // A braked arm sinks: start from the position that the regulation holds now.
        let now = self.clock.now();
        let position = sdk.regulated_position(id).map_err(|e| self.call_error(e))?;
        let tip = self
            .config
            .mount
            .axes
            .point_from_metres(position.position_m);
        if !tip.is_finite() {
            return Err(self.wrong_state("at a known position", "without one (not a number)"));
        }
        let mut freshness = Freshness::new(self.config.trips.min_control_khz);
        freshness.set_rate(khz);
        let mut trajectory = Trajectory::at_rest(self.config.motion, tip);
        trajectory.set_acceleration(limits.max_acceleration_mm_s2);
        self.state = State::Armed(Box::new(ArmedState {
            trajectory,
            monitor: Monitor::new(self.config.trips, *limits, now, tip.to_array()),
            correction: Correction::none(self.config.motion, tip.to_array()),
            freshness,
            tare: TareState::Averaging(TareAverage::begin(now)),
            last: now,
            last_reading: now,
            last_activity: now,
            old_cause,
            tip,
            status_due: now,
            control_due: now + CONTROL_EVERY,
            busy_readings: 0,
            rising: false,
            must_rise: false,
            overloaded: false,
        }));
        Ok(())
    }

    /// Waits until the regulation runs, the motors are live and the loop is fast enough. Returns the loop rate, kHz, and the force-off
    /// cause that the device reports.
    fn await_regulation(&mut self) -> Result<(f64, Option<ForceOffCause>), DeviceError> {
        let (sdk, id) = (Arc::clone(&self.sdk), self.opened.id);
        let least = self.config.trips.min_control_khz;
        let deadline = self.clock.now() + span(self.config.timeouts.regulation);
        // The library averages the rate since the previous call: this one starts the interval.
        let _ = sdk.control_khz(id);
        loop {
            let next = self.clock.now() + STATUS_EVERY;
            self.clock.wait_until(next);
            let running = sdk.is_running(id);
            let status = sdk.status(id).map_err(|e| self.call_error(e))?;
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
                    let words = crate::remark::describe_cause(cause);
                    format!(
                        "without motor power ({words}); press the force button on the base to allow it"
                    )
                };
                let expected = format!("regulated at {least} kHz or more with live motors");
                return Err(self.wrong_state(&expected, found));
            }
        }
    }

    /// Brakes after `error`; reports both if that fails too.
    pub(super) fn brake_after_error(&mut self, error: DeviceError) -> DeviceError {
        match self.brake() {
            Ok(()) => {
                self.state = State::Parked;
                error
            }
            Err(live) => self.brake_failed(format!("{error}; {live}")),
        }
    }

    /// Braking failed: stop commanding, report the failure at every poll, and retry when disarming.
    pub(super) fn brake_failed(&mut self, why: String) -> DeviceError {
        let error = self.lost(&why);
        self.state = State::Tripped(Trip::BrakeFailed(why));
        self.stream.clear_failure();
        self.stream.fail(error.clone());
        error
    }
}
