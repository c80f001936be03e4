//! The thread that makes all library calls, and the requests to it.

use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, SyncSender, TrySendError};
use std::time::Duration;

use skinrig_device::{DeviceError, MotionLimits, RealClock};
use skinrig_drd_abi::DeviceId;
use skinrig_model::{DeviceRole, Point3, Robot, Setting};

use crate::brake::brake;
use crate::config::{OmegaConfig, Timeouts};
use crate::engine::Engine;
use crate::error::OmegaError;
use crate::open::{self, OpenRobot};
use crate::sdk::Sdk;
use crate::stream::Stream;
use crate::supervisor::Supervisor;

/// Capacity of the request queue. Each caller waits for its reply, so usually one entry is used.
const QUEUE: usize = 8;

type Reply<T> = SyncSender<Result<T, DeviceError>>;

/// A request to the thread.
enum Request {
    Configure(MotionLimits, Reply<Vec<Setting>>),
    Arm(Reply<()>),
    Go(Point3<Robot>, f64, Reply<()>),
    Hold(Reply<()>),
    Disarm(Reply<()>),
}

/// Handle of the thread.
pub(crate) struct Owner {
    requests: Option<SyncSender<Request>>,
    ended: Receiver<()>,
    sdk: Arc<dyn Sdk>,
    id: DeviceId,
    serial: String,
    timeouts: Timeouts,
    arm_within: Duration,
    /// Why no more requests are accepted.
    failure: Option<String>,
}

impl Owner {
    /// Starts the thread and waits until it has opened the robot.
    pub(crate) fn start(
        sdk: Arc<dyn Sdk>,
        config: Arc<OmegaConfig>,
        library: std::path::PathBuf,
        clock: RealClock,
        stream: Arc<Stream>,
    ) -> Result<(Self, OpenRobot), OmegaError> {
        let timeouts = config.timeouts;
        let (requests, inbox) = mpsc::sync_channel(QUEUE);
        let (opened_sender, opened) = mpsc::sync_channel(1);
        let (ended_sender, ended) = mpsc::sync_channel::<()>(1);
        let thread_sdk = Arc::clone(&sdk);
        let thread_config = Arc::clone(&config);
        let body = move || {
            let (sdk, config) = (thread_sdk, thread_config);
            // Dropped last, after the device is closed, which wakes waiting threads.
            let _ended = ended_sender;
            let mut supervisor = None;
            let opened = open::open(&*sdk, &config, |serial| {
                if let Some(command) = &config.supervisor {
                    let started = Supervisor::start(command, &library, serial, timeouts.open)?;
                    supervisor = Some(started);
                }
                Ok(())
            });
            match opened {
                Err(e) => {
                    // Without dismissal it makes sure that an arm whose initialisation failed is braked.
                    drop(supervisor);
                    let _ = opened_sender.send(Err(e));
                }
                Ok(opened) => {
                    let info = opened.clone();
                    let engine = Engine::new(sdk, config, opened, clock, stream, supervisor);
                    // If the receiver is gone, dropping the engine closes the device.
                    if opened_sender.send(Ok(info)).is_ok() {
                        serve(engine, clock, &inbox);
                    }
                }
            }
        };
        std::thread::Builder::new()
            .name("omega3".to_owned())
            .spawn(body)
            .map_err(|e| OmegaError::Thread(e.to_string()))?;
        let mut within = timeouts.open;
        if config.initialise == crate::config::InitialiseRule::SampleIsOff {
            within += timeouts.initialise;
        }
        let opened = match opened.recv_timeout(within) {
            Ok(answer) => answer?,
            Err(_) => {
                // A call hangs, perhaps while the arm initialises itself: brake every device.
                emergency_brake(Arc::clone(&sdk), skinrig_drd_abi::DEFAULT_DEVICE, timeouts);
                return Err(OmegaError::TimedOut {
                    what: "opening the robot",
                    waited: within,
                });
            }
        };
        let owner = Self {
            requests: Some(requests),
            ended,
            sdk,
            id: opened.id,
            serial: opened.serial.clone(),
            timeouts,
            arm_within: timeouts.regulation * 2 + config.trips.tare,
            failure: None,
        };
        Ok((owner, opened))
    }

    pub(crate) fn configure(&mut self, limits: MotionLimits) -> Result<Vec<Setting>, DeviceError> {
        self.request("configuring", Duration::ZERO, |reply| {
            Request::Configure(limits, reply)
        })
    }

    pub(crate) fn arm(&mut self) -> Result<(), DeviceError> {
        self.request("arming", self.arm_within, Request::Arm)
    }

    pub(crate) fn go(&mut self, target: Point3<Robot>, speed_mm_s: f64) -> Result<(), DeviceError> {
        self.request("a motion command", Duration::ZERO, |reply| {
            Request::Go(target, speed_mm_s, reply)
        })
    }

    pub(crate) fn hold(&mut self) -> Result<(), DeviceError> {
        self.request("holding", Duration::ZERO, Request::Hold)
    }

    pub(crate) fn disarm(&mut self) -> Result<(), DeviceError> {
        self.request("disarming", Duration::ZERO, Request::Disarm)
    }

    fn lost(&self, detail: String) -> DeviceError {
        DeviceError::Lost {
            role: DeviceRole::Indenter,
            serial: self.serial.clone(),
            detail,
        }
    }

    /// Sends a request and waits for its reply. If the library does not return in time, brakes the arm from another thread and accepts no
    /// further requests.
    fn request<T>(
        &mut self,
        what: &'static str,
        extra: Duration,
        request: impl FnOnce(Reply<T>) -> Request,
    ) -> Result<T, DeviceError> {
        if let Some(reason) = &self.failure {
            return Err(self.lost(reason.clone()));
        }
        // The thread may first brake after a fault, with all attempts.
        let within = self.timeouts.reply + total_brake_time(&self.timeouts) + extra;
        let (reply, answer) = mpsc::sync_channel(1);
        let sent = match &self.requests {
            Some(requests) => requests.try_send(request(reply)),
            None => return Err(self.lost("closed".to_owned())),
        };
        let reason = match sent {
            Ok(()) => match answer.recv_timeout(within) {
                Ok(answer) => return answer,
                Err(RecvTimeoutError::Timeout) => {
                    format!("{what}: the library did not return within {within:?}")
                }
                Err(RecvTimeoutError::Disconnected) => {
                    format!("{what}: the thread that owns the library ended")
                }
            },
            Err(TrySendError::Full(_)) => format!("{what}: the request queue is full"),
            Err(TrySendError::Disconnected(_)) => {
                format!("{what}: the thread that owns the library ended")
            }
        };
        let braked = emergency_brake(Arc::clone(&self.sdk), self.id, self.timeouts);
        let outcome = if braked {
            "the arm was braked from another thread"
        } else {
            "the arm may be live: press the force button on its base or switch it off at the mains"
        };
        let reason = format!("{reason}; {outcome}");
        self.failure = Some(reason.clone());
        Err(self.lost(reason))
    }
}

/// Duration of all attempts to brake.
fn total_brake_time(timeouts: &Timeouts) -> Duration {
    timeouts.brake_retry * timeouts.brake_attempts
}

impl Drop for Owner {
    /// Brakes, closes the device and waits for that, so that the robot can be reopened at once.
    fn drop(&mut self) {
        drop(self.requests.take());
        let within = self.timeouts.reply + total_brake_time(&self.timeouts);
        let ended = matches!(
            self.ended.recv_timeout(within),
            Err(RecvTimeoutError::Disconnected)
        );
        if !ended && self.failure.is_none() {
            emergency_brake(Arc::clone(&self.sdk), self.id, self.timeouts);
        }
    }
}

/// Brakes from a separate thread while the owner hangs in a call. The library's documentation allows calls from any thread. Returns
/// whether the robot confirmed.
fn emergency_brake(sdk: Arc<dyn Sdk>, id: DeviceId, timeouts: Timeouts) -> bool {
    let (sender, receiver) = mpsc::sync_channel(1);
    let body = move || {
        let braked = brake(&*sdk, id, &timeouts, std::thread::sleep).is_ok();
        let _ = sender.send(braked);
    };
    let started = std::thread::Builder::new()
        .name("omega3-emergency".to_owned())
        .spawn(body);
    started.is_ok()
        && receiver
            .recv_timeout(timeouts.reply + total_brake_time(&timeouts))
            .unwrap_or(false)
}

/// Handles requests and runs cycles until all handles are gone.
fn serve(mut engine: Engine<RealClock>, clock: RealClock, inbox: &Receiver<Request>) {
    let mut next = clock.now();
    loop {
        let left = next - clock.now();
        let wait = Duration::from_nanos(u64::try_from(left.0).unwrap_or(0));
        match inbox.recv_timeout(wait) {
            Ok(request) => handle(&mut engine, request),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return,
        }
        let now = clock.now();
        if now >= next {
            engine.tick();
            // Late cycles are not caught up: the set point waits, see the engine.
            next = (next + engine.period()).max(now);
        }
    }
}

/// Handles one request. The reply is dropped if the caller no longer waits.
fn handle(engine: &mut Engine<RealClock>, request: Request) {
    match request {
        Request::Configure(limits, reply) => {
            let _ = reply.send(engine.configure(&limits));
        }
        Request::Arm(reply) => {
            let _ = reply.send(engine.arm());
        }
        Request::Go(target, speed, reply) => {
            let _ = reply.send(engine.go(target, speed));
        }
        Request::Hold(reply) => {
            let _ = reply.send(engine.hold());
        }
        Request::Disarm(reply) => {
            let _ = reply.send(engine.disarm());
        }
    }
}
