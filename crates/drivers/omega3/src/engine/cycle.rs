//! The cycle of the engine: read, check, advance, publish; and the reaction to trips.

use skinrig_device::{Clock, RobotSample};
use skinrig_drd_abi::{ErrorCode, ForceOffCause};
use skinrig_model::HostDuration;

use super::armed::TareState;
use super::{CONTROL_EVERY, Engine, STATUS_EVERY, State, span};
use crate::monitor::Trip;
use crate::sdk::CallResult;

/// Longest time that one step of the set point covers, s: after a later cycle the motion is delayed instead.
const MAX_CYCLE_S: f64 = 0.004;

/// A reading that takes longer has no reliable time, because the thread was interrupted. It controls the motion but is left out of
/// the stream, which then has a gap.
const MAX_READING_TIME: HostDuration = HostDuration::from_millis(2);

/// Consecutive readings that may fail because the controller was busy.
const MAX_BUSY_READINGS: u32 = 5;

impl<C: Clock> Engine<C> {
    /// Runs one cycle.
    pub(crate) fn tick(&mut self) {
        let outcome = match &mut self.state {
            State::Armed(_) => self.armed_cycle(),
            State::Parked | State::Tripped(_) => self.parked_cycle(),
            State::Lost(_) => Ok(()),
        };
        if let Err(trip) = outcome {
            self.trip(trip);
        }
    }

    fn trip(&mut self, trip: Trip) {
        let trip = match trip {
            // An unplugged robot may first show as a regulation that ended.
            Trip::RegulationEnded => self.find_regulation_end_cause(),
            Trip::Call(e) if e.code == ErrorCode::NO_REGULATION => self.find_regulation_end_cause(),
            // The regulation switches the power off when it ends by itself.
            Trip::ForceOff(ForceOffCause::None | ForceOffCause::Software)
                if !self.sdk.is_running(self.opened.id) =>
            {
                self.find_regulation_end_cause()
            }
            // The device still reports the cause of an earlier event.
            Trip::ForceOff(cause) if Some(cause) == self.old_cause() => Trip::ForceOffAgain(cause),
            other => other,
        };
        self.stream.fail(self.trip_error(&trip));
        if let Err(live) = self.brake() {
            let _ = self.brake_failed(format!("{trip}; {live}"));
            if !trip.is_loss() {
                return;
            }
        }
        self.state = if trip.is_loss() {
            State::Lost(trip)
        } else {
            State::Tripped(trip)
        };
    }

    /// Force-off cause that the device already reported when arming.
    fn old_cause(&self) -> Option<ForceOffCause> {
        match &self.state {
            State::Armed(armed) => armed
                .old_cause
                .filter(|cause| *cause != ForceOffCause::None),
            _ => None,
        }
    }

    fn find_regulation_end_cause(&self) -> Trip {
        match self.sdk.status(self.opened.id) {
            Err(e) => Trip::Call(e),
            Ok(status) => match status.force_off_cause() {
                None | Some(ForceOffCause::None | ForceOffCause::Software) => Trip::RegulationEnded,
                cause if cause == self.old_cause() => Trip::RegulationEnded,
                Some(cause) => Trip::ForceOff(cause),
            },
        }
    }

    fn parked_cycle(&mut self) -> Result<(), Trip> {
        let t = self.clock.now();
        let reading = self.sdk.position(self.opened.id);
        let Some(reading) = tolerate(&mut self.parked_busy_readings, reading)? else {
            return Ok(());
        };
        let tip = self.config.mount.axes.point_from_metres(reading.position_m);
        if !tip.is_finite() {
            return Err(Trip::NotFinite);
        }
        if !reading.cached {
            self.stream.push(RobotSample {
                t,
                commanded: tip,
                measured: tip,
                force_n: f64::NAN,
            });
        }
        Ok(())
    }

    fn armed_cycle(&mut self) -> Result<(), Trip> {
        let Self {
            sdk,
            config,
            opened,
            clock,
            stream,
            supervisor,
            state,
            ..
        } = self;
        let State::Armed(armed) = state else {
            return Ok(());
        };
        let id = opened.id;
        if !sdk.is_running(id) {
            return Err(Trip::RegulationEnded);
        }
        let now = clock.now();
        // Arming is a blocking call, during which no polls occur.
        if stream.take_activity() || matches!(armed.tare, TareState::Averaging(_)) {
            armed.last_activity = now;
        } else if now - armed.last_activity > span(config.trips.max_unwatched) {
            let limit = config.trips.max_unwatched;
            return Err(Trip::Unwatched { limit });
        }
        // One counter for both: a reading is good if position and force are.
        let reading = sdk
            .regulated_position(id)
            .and_then(|reading| sdk.force(id).map(|force| (reading, force)));
        let timely = clock.now() - now <= MAX_READING_TIME;
        let Some((reading, force)) = tolerate(&mut armed.busy_readings, reading)? else {
            return armed.check_silence(now, &config.trips);
        };
        let axes = config.mount.axes;
        let tip = axes.point_from_metres(reading.position_m);
        let set_point = armed.trajectory.set_point();
        armed
            .monitor
            .position(now, tip.to_array(), set_point.to_array())?;
        armed.tip = tip;
        if now >= armed.status_due {
            armed.status_due = now + STATUS_EVERY;
            let status = sdk.status(id).map_err(Trip::Call)?;
            armed.monitor.status(&status)?;
        }
        if now >= armed.control_due {
            armed.control_due = now + CONTROL_EVERY;
            let khz = sdk.control_khz(id).map_err(Trip::Call)?;
            armed.monitor.control(khz)?;
            armed.freshness.set_rate(khz);
            if let Some(supervisor) = supervisor {
                supervisor.check().map_err(Trip::Supervisor)?;
            }
        }

        let sign = config.mount.reported_force_sign;
        let pushed = axes.robot_from_device(force.map(|f| sign * f));
        let new = armed
            .freshness
            .is_new(now, reading.position_m, reading.cached);
        let force_n = armed.check_force(now, pushed, new, &config.trips)?;

        let dt_s = (now - armed.last).as_secs_f64().min(MAX_CYCLE_S);
        armed.last = now;
        let target = armed.advance(dt_s);
        sdk.track(id, axes.metres_from_point(target))
            .map_err(Trip::Call)?;

        if new {
            armed.last_reading = now;
            if timely {
                stream.push(RobotSample {
                    t: now,
                    commanded: set_point,
                    measured: tip,
                    force_n,
                });
            }
            return Ok(());
        }
        armed.check_silence(now, &config.trips)
    }
}

/// Tolerates a few consecutive readings that fail because the controller was busy.
fn tolerate<T>(busy_readings: &mut u32, answer: CallResult<T>) -> Result<Option<T>, Trip> {
    match answer {
        Ok(value) => {
            *busy_readings = 0;
            Ok(Some(value))
        }
        Err(e)
            if matches!(e.code, ErrorCode::DHC_BUSY | ErrorCode::TIMEOUT)
                && *busy_readings < MAX_BUSY_READINGS =>
        {
            *busy_readings += 1;
            Ok(None)
        }
        Err(e) => Err(Trip::Call(e)),
    }
}
