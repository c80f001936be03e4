//! The states of the robot and what is done in each cycle. Runs on the thread that owns the library, on any clock.

use std::sync::Arc;
use std::time::Duration;

use skinrig_device::{Clock, DeviceError, MotionLimits, RobotSample, limits};
use skinrig_drd_abi::{ErrorCode, ForceOffCause, StatusField};
use skinrig_model::{DeviceRole, HostDuration, HostTime, Point3, Robot, Setting};

use crate::brake::{MayBeLive, brake};
use crate::config::{OmegaConfig, Patience, Trips};
use crate::correction::Correction;
use crate::monitor::{Freshness, Monitor, Trip};
use crate::open::{NotSet, Opened, seen};
use crate::regulation;
use crate::sdk::{Answer, CallError, Sdk};
use crate::stream::Stream;
use crate::supervisor::Supervisor;
use crate::trajectory::{Trajectory, norm};
use crate::weighing::Weighing;

/// Longest time that one step of the set point stands for, s: a cycle that comes later makes the motion wait.
const LONGEST_CYCLE_S: f64 = 0.004;

/// Time between two looks at the status vector; each may cost an exchange on USB.
const STATUS_EVERY: HostDuration = HostDuration::from_millis(10);

/// Time between two looks at the rate of the regulation loop.
const CONTROL_EVERY: HostDuration = HostDuration::from_millis(100);

/// A position whose reading took longer has no time of its own (the thread was held up in between): it leads the motion and is kept
/// out of the stream, which shows a gap there.
const READ_WITHIN: HostDuration = HostDuration::from_millis(2);

/// Readings in a row that may fail because the controller was busy.
const HICCUPS: u32 = 5;

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

struct Armed {
    trajectory: Trajectory,
    monitor: Monitor,
    correction: Correction,
    freshness: Freshness,
    tare: Tare,
    last: HostTime,
    heard: HostTime,
    watched: HostTime,
    /// The cause that the device told when it was armed, of some earlier time.
    old_cause: Option<ForceOffCause>,
    tip: Point3<Robot>,
    status_due: HostTime,
    control_due: HostTime,
    hiccups: u32,
    /// The present motion leads up; no soft force limit stops it.
    rising: bool,
    /// Stopped by the soft force limit: only a rise is allowed.
    must_rise: bool,
    /// The force is above the soft limit now.
    overloaded: bool,
}

enum Tare {
    Taking(Weighing),
    Known([f64; 3]),
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
                State::Armed(armed) if matches!(armed.tare, Tare::Known(_)) => return Ok(()),
                State::Armed(_) if self.clock.now() < deadline => {}
                State::Armed(_) => {
                    let e = self.wrong_state(
                        "still, to take the force at rest as zero",
                        "moving or without new readings; see that the arm hangs free",
                    );
                    return Err(self.brake_after(e));
                }
                _ => {
                    // The failure is told here, and not again by the next poll.
                    let failure = self.stream.failure();
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
    fn brake_after(&mut self, error: DeviceError) -> DeviceError {
        match self.brake() {
            Ok(()) => {
                self.state = State::Parked;
                error
            }
            Err(live) => self.not_braked(format!("{error}; {live}")),
        }
    }

    /// The brake failed: nothing is commanded any more, every poll says so, and disarming tries again.
    fn not_braked(&mut self, why: String) -> DeviceError {
        let error = self.lost(&why);
        self.state = State::Tripped(Trip::NotBraked(why));
        self.stream.heal();
        self.stream.fail(error.clone());
        error
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

    /// One cycle: read, check, move on, tell.
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
            // An unplugged robot may be seen first as a regulation that ended.
            Trip::RegulationEnded => self.why_regulation_ended(),
            Trip::Call(e) if e.code == ErrorCode::NO_REGULATION => self.why_regulation_ended(),
            // The regulation takes the power off when it ends by itself.
            Trip::ForceOff(ForceOffCause::None | ForceOffCause::Software)
                if !self.sdk.is_running(self.opened.id) =>
            {
                self.why_regulation_ended()
            }
            // It names what was the matter some earlier time.
            Trip::ForceOff(cause) if Some(cause) == self.old_cause() => Trip::ForceOffAgain(cause),
            other => other,
        };
        self.stream.fail(self.of_trip(&trip));
        if let Err(live) = self.brake() {
            let _ = self.not_braked(format!("{trip}; {live}"));
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

    /// The cause that the device told already when it was armed.
    fn old_cause(&self) -> Option<ForceOffCause> {
        match &self.state {
            State::Armed(armed) => armed
                .old_cause
                .filter(|cause| *cause != ForceOffCause::None),
            _ => None,
        }
    }

    fn why_regulation_ended(&self) -> Trip {
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
        let Some(reading) = tolerate(&mut self.parked_hiccups, reading)? else {
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
        // Arming itself waits for nobody.
        if stream.was_watched() || matches!(armed.tare, Tare::Taking(_)) {
            armed.watched = now;
        } else if now - armed.watched > span(config.trips.max_unwatched) {
            let limit = config.trips.max_unwatched;
            return Err(Trip::Unwatched { limit });
        }
        // One counter for both: the reading is good when position and force are.
        let reading = sdk
            .regulated_position(id)
            .and_then(|reading| sdk.force(id).map(|force| (reading, force)));
        let timely = clock.now() - now <= READ_WITHIN;
        let Some((reading, force)) = tolerate(&mut armed.hiccups, reading)? else {
            return armed.not_silent(now, &config.trips);
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
        let force_n = armed.weigh(now, pushed, new, &config.trips)?;

        let dt_s = (now - armed.last).as_secs_f64().min(LONGEST_CYCLE_S);
        armed.last = now;
        let target = armed.advance(dt_s);
        sdk.track(id, axes.metres_from_point(target))
            .map_err(Trip::Call)?;

        if new {
            armed.heard = now;
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
        armed.not_silent(now, &config.trips)
    }
}

/// Distance aside that a vertical rise may have, mm: far below what a tip of millimetres feels.
const ASIDE_MM: f64 = 0.05;

/// Whether the way from the set point to `target` leads up: at least as far up as aside. The set point, not the tip, is
/// where the way begins: under load the tip lags behind, and a level way would seem to rise or to fall.
fn rises(set_point: Point3<Robot>, target: Point3<Robot>) -> bool {
    let [dx, dy, up] = std::array::from_fn(|i| target.to_array()[i] - set_point.to_array()[i]);
    let aside = f64::hypot(dx, dy);
    up > 0.0 && (up >= aside || aside <= ASIDE_MM)
}

impl Armed {
    /// Checks that a reading was heard within the time.
    fn not_silent(&self, now: HostTime, trips: &Trips) -> Result<(), Trip> {
        let limit = trips.max_silence;
        if now - self.heard > span(limit) {
            return Err(Trip::Silent { limit });
        }
        Ok(())
    }

    /// Moves the set point on; gives what the regulation is told.
    fn advance(&mut self, dt_s: f64) -> Point3<Robot> {
        let tip = self.tip.to_array();
        let [x, y, z] = self.correction.without(tip);
        self.trajectory.step(dt_s, Point3::new(x, y, z));
        // Above the force limit nothing is added.
        let resting = match self.trajectory.is_still() {
            true if self.overloaded || self.must_rise => None,
            still => Some(still),
        };
        let set_point = self.trajectory.set_point().to_array();
        let [x, y, z] = self.correction.target(set_point, tip, resting, dt_s);
        Point3::new(x, y, z)
    }

    /// Checks the force with which the motors push the tip (robot frame, N). Gives the force with which the world
    /// pushes the tip up: opposite, and without what the arm needs to hang still; NaN while that is not known.
    fn weigh(
        &mut self,
        now: HostTime,
        pushed: [f64; 3],
        new: bool,
        trips: &Trips,
    ) -> Result<f64, Trip> {
        match &mut self.tare {
            Tare::Taking(weighing) => {
                self.monitor.force(pushed)?;
                if new && let Some(mean) = weighing.add(now, pushed, trips) {
                    if norm(mean) > trips.max_tare_n {
                        return Err(Trip::Tare {
                            limit_n: trips.max_tare_n,
                            found_n: norm(mean),
                        });
                    }
                    self.tare = Tare::Known(mean);
                }
                Ok(f64::NAN)
            }
            Tare::Known(tare) => {
                let free: [f64; 3] = std::array::from_fn(|i| pushed[i] - tare[i]);
                self.overloaded = self.monitor.force(free)?;
                if self.overloaded && !self.rising {
                    self.must_rise = true;
                    self.trajectory.halt();
                }
                Ok(-free[2])
            }
        }
    }
}

/// Lets a few readings in a row fail because the controller was busy.
fn tolerate<T>(hiccups: &mut u32, answer: Answer<T>) -> Result<Option<T>, Trip> {
    match answer {
        Ok(value) => {
            *hiccups = 0;
            Ok(Some(value))
        }
        Err(e)
            if matches!(e.code, ErrorCode::DHC_BUSY | ErrorCode::TIMEOUT) && *hiccups < HICCUPS =>
        {
            *hiccups += 1;
            Ok(None)
        }
        Err(e) => Err(Trip::Call(e)),
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

/// A duration of the standard library on the bench's clock.
pub(crate) fn span(duration: Duration) -> HostDuration {
    HostDuration(i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX))
}
