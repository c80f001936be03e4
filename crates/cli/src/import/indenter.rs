//! A robot that follows a schedule exactly: its position is always the scheduled one.
//!
//! Datasets recorded without skinrig have no pose stream. Importing one drives this indenter through the same
//! controller, so that an imported session has the same shape as any other; its outcomes are marked as
//! scheduled, because nothing was measured.

use skinrig_device::{
    Clock, DeviceError, Indenter, IndenterCapabilities, MotionLimits, RobotSample,
};
use skinrig_model::{DeviceIdentity, DeviceRole, HostDuration, HostTime, Point3, Robot, Setting};
use skinrig_sim::SimClock;

/// Rate of the scheduled pose stream, Hz.
const POSE_RATE_HZ: i64 = 100;
const POSE_PERIOD: HostDuration = HostDuration(1_000_000_000 / POSE_RATE_HZ);

/// The scheduled indenter. Moves at exactly the commanded speed, without acceleration phases.
pub(crate) struct ScheduledIndenter {
    clock: SimClock,
    from: Point3<Robot>,
    to: Point3<Robot>,
    speed_mm_s: f64,
    since: HostTime,
    next_sample: HostTime,
    armed: bool,
    configured: bool,
}

impl ScheduledIndenter {
    /// At rest at `start`.
    pub(super) fn new(clock: SimClock, start: Point3<Robot>) -> Self {
        Self {
            clock,
            from: start,
            to: start,
            speed_mm_s: 1.0,
            since: HostTime::ZERO,
            next_sample: HostTime::ZERO,
            armed: false,
            configured: false,
        }
    }

    fn position_at(&self, t: HostTime) -> Point3<Robot> {
        let length = self.from.distance_mm(self.to);
        let travelled = self.speed_mm_s * (t - self.since).as_secs_f64();
        if length == 0.0 || travelled >= length {
            return self.to;
        }
        let share = (travelled / length).max(0.0);
        let [a, b, c] = self.from.to_array();
        let [x, y, z] = self.to.to_array();
        Point3::new(
            a + share * (x - a),
            b + share * (y - b),
            c + share * (z - c),
        )
    }

    fn state_error(&self, expected: &str, found: &str) -> DeviceError {
        DeviceError::State {
            role: DeviceRole::Indenter,
            serial: self.identity().serial,
            expected: expected.into(),
            found: found.into(),
        }
    }
}

impl Indenter for ScheduledIndenter {
    fn identity(&self) -> DeviceIdentity {
        DeviceIdentity {
            model: "scheduled (no robot: positions and times from the schedule)".into(),
            serial: "none".into(),
            firmware: "none".into(),
        }
    }

    fn capabilities(&self) -> IndenterCapabilities {
        IndenterCapabilities {
            workspace_min_mm: [-1e6; 3],
            workspace_max_mm: [1e6; 3],
            max_speed_mm_s: 1e9,
            max_acceleration_mm_s2: 1e9,
            max_force_n: 1e9,
            pose_rate_hz: POSE_RATE_HZ as f64,
            reports_force: false,
        }
    }

    fn configure(&mut self, _limits: &MotionLimits) -> Result<Vec<Setting>, DeviceError> {
        self.configured = true;
        Ok(Vec::new())
    }

    fn arm(&mut self) -> Result<(), DeviceError> {
        if !self.configured {
            return Err(self.state_error("configured", "not configured"));
        }
        self.armed = true;
        Ok(())
    }

    fn command(&mut self, target: Point3<Robot>, speed_mm_s: f64) -> Result<(), DeviceError> {
        if !self.armed {
            return Err(self.state_error("armed", "disarmed"));
        }
        if !(target.is_finite() && speed_mm_s > 0.0 && speed_mm_s.is_finite()) {
            return Err(DeviceError::Refused {
                role: DeviceRole::Indenter,
                serial: self.identity().serial,
                expected: "a finite target and a positive speed".into(),
                found: format!("{:?} at {speed_mm_s} mm/s", target.to_array()),
            });
        }
        let now = self.clock.now();
        self.from = self.position_at(now);
        self.to = target;
        self.speed_mm_s = speed_mm_s;
        self.since = now;
        Ok(())
    }

    fn poll(&mut self, samples: &mut Vec<RobotSample>) -> Result<(), DeviceError> {
        let now = self.clock.now();
        while self.next_sample <= now {
            let t = self.next_sample;
            let measured = self.position_at(t);
            samples.push(RobotSample {
                t,
                commanded: self.to,
                measured,
                force_n: f64::NAN,
            });
            self.next_sample += POSE_PERIOD;
        }
        Ok(())
    }

    fn hold(&mut self) -> Result<(), DeviceError> {
        let now = self.clock.now();
        let position = self.position_at(now);
        (self.from, self.to, self.since) = (position, position, now);
        Ok(())
    }

    fn disarm(&mut self) -> Result<(), DeviceError> {
        self.armed = false;
        self.hold()
    }
}
