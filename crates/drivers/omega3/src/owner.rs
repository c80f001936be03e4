//! The one thread that calls the library, and how the rest of the program talks to it.

use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, SyncSender, TrySendError};
use std::time::Duration;

use skinrig_device::{DeviceError, MotionLimits, RealClock};
use skinrig_drd_abi::DeviceId;
use skinrig_model::{DeviceRole, Point3, Robot, Setting};

use crate::brake::brake;
use crate::config::{OmegaConfig, Patience};
use crate::engine::Engine;
use crate::error::OmegaError;
use crate::open::{self, Opened};
use crate::sdk::Sdk;
use crate::stream::Stream;
use crate::supervisor::Supervisor;

/// Requests that may wait; each caller waits for its reply, so one is the rule.
const QUEUE: usize = 8;

type Reply<T> = SyncSender<Result<T, DeviceError>>;

/// What the thread is asked to do.
enum Request {
    Configure(MotionLimits, Reply<Vec<Setting>>),
    Arm(Reply<()>),
    Go(Point3<Robot>, f64, Reply<()>),
    Hold(Reply<()>),
    Disarm(Reply<()>),
}

/// The thread, seen from outside.
pub(crate) struct Owner {
    requests: Option<SyncSender<Request>>,
    ended: Receiver<()>,
    sdk: Arc<dyn Sdk>,
    id: DeviceId,
    serial: String,
    patience: Patience,
    arm_within: Duration,
    /// Why nothing can be asked any more.
    dead: Option<String>,
}

impl Owner {
    /// Starts the thread, which opens the robot, and waits until it is open.
    pub(crate) fn start(
        sdk: Arc<dyn Sdk>,
        config: Arc<OmegaConfig>,
        library: std::path::PathBuf,
        clock: RealClock,
        stream: Arc<Stream>,
    ) -> Result<(Self, Opened), OmegaError> {
        let patience = config.patience;
        let (requests, inbox) = mpsc::sync_channel(QUEUE);
        let (tell_opened, opened) = mpsc::sync_channel(1);
        let (tell_ended, ended) = mpsc::sync_channel::<()>(1);
        let thread_sdk = Arc::clone(&sdk);
        let thread_config = Arc::clone(&config);
        let body = move || {
            let (sdk, config) = (thread_sdk, thread_config);
            // Dropped last, when the device is closed: whoever waits is woken.
            let _ended = tell_ended;
            let mut supervisor = None;
            let opened = open::open(&*sdk, &config, |serial| {
                if let Some(command) = &config.supervisor {
                    let started = Supervisor::start(command, &library, serial, patience.open)?;
                    supervisor = Some(started);
                }
                Ok(())
            });
            match opened {
                Err(e) => {
                    // Not dismissed: it makes sure that an arm whose initialisation failed is braked.
                    drop(supervisor);
                    let _ = tell_opened.send(Err(e));
                }
                Ok(opened) => {
                    let news = opened.clone();
                    let engine = Engine::new(sdk, config, opened, clock, stream, supervisor);
                    // Nobody waits any more: the engine's end closes the device.
                    if tell_opened.send(Ok(news)).is_ok() {
                        serve(engine, clock, &inbox);
                    }
                }
            }
        };
        std::thread::Builder::new()
            .name("omega3".to_owned())
            .spawn(body)
            .map_err(|e| OmegaError::Thread(e.to_string()))?;
        let mut within = patience.open;
        if config.initialise == crate::config::Initialise::SampleIsOff {
            within += patience.initialise;
        }
        let opened = match opened.recv_timeout(within) {
            Ok(answer) => answer?,
            Err(_) => {
                // It hangs in a call, perhaps while the arm initialises itself: every device is told to brake.
                emergency(Arc::clone(&sdk), skinrig_drd_abi::DEFAULT_DEVICE, patience);
                return Err(OmegaError::Late {
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
            patience,
            arm_within: patience.regulation * 2 + config.trips.tare,
            dead: None,
        };
        Ok((owner, opened))
    }

    pub(crate) fn configure(&mut self, limits: MotionLimits) -> Result<Vec<Setting>, DeviceError> {
        self.ask("configuring", Duration::ZERO, |reply| {
            Request::Configure(limits, reply)
        })
    }

    pub(crate) fn arm(&mut self) -> Result<(), DeviceError> {
        self.ask("arming", self.arm_within, Request::Arm)
    }

    pub(crate) fn go(&mut self, target: Point3<Robot>, speed_mm_s: f64) -> Result<(), DeviceError> {
        self.ask("a motion command", Duration::ZERO, |reply| {
            Request::Go(target, speed_mm_s, reply)
        })
    }

    pub(crate) fn hold(&mut self) -> Result<(), DeviceError> {
        self.ask("holding", Duration::ZERO, Request::Hold)
    }

    pub(crate) fn disarm(&mut self) -> Result<(), DeviceError> {
        self.ask("disarming", Duration::ZERO, Request::Disarm)
    }

    fn lost(&self, detail: String) -> DeviceError {
        DeviceError::Lost {
            role: DeviceRole::Indenter,
            serial: self.serial.clone(),
            detail,
        }
    }

    /// Sends a request and waits for its answer. A library that does not return within the time is given up: the arm
    /// is told to brake from another thread, and nothing can be asked any more.
    fn ask<T>(
        &mut self,
        what: &'static str,
        beyond: Duration,
        request: impl FnOnce(Reply<T>) -> Request,
    ) -> Result<T, DeviceError> {
        if let Some(why) = &self.dead {
            return Err(self.lost(why.clone()));
        }
        // A fault may be braking, with all its attempts, before the request is heard.
        let within = self.patience.reply + braking(&self.patience) + beyond;
        let (reply, answer) = mpsc::sync_channel(1);
        let sent = match &self.requests {
            Some(requests) => requests.try_send(request(reply)),
            None => return Err(self.lost("closed".to_owned())),
        };
        let why = match sent {
            Ok(()) => match answer.recv_timeout(within) {
                Ok(answer) => return answer,
                Err(RecvTimeoutError::Timeout) => {
                    format!("{what}: the library did not return within {within:?}")
                }
                Err(RecvTimeoutError::Disconnected) => {
                    format!("{what}: the thread that owns the library ended")
                }
            },
            Err(TrySendError::Full(_)) => format!("{what}: requests are not heard"),
            Err(TrySendError::Disconnected(_)) => {
                format!("{what}: the thread that owns the library ended")
            }
        };
        let braked = emergency(Arc::clone(&self.sdk), self.id, self.patience);
        let outcome = if braked {
            "the arm was braked from another thread"
        } else {
            "the arm may be live: press the force button on its base or switch it off at the mains"
        };
        let why = format!("{why}; {outcome}");
        self.dead = Some(why.clone());
        Err(self.lost(why))
    }
}

/// Time that all attempts to brake take.
fn braking(patience: &Patience) -> Duration {
    patience.brake_retry * patience.brake_attempts
}

impl Drop for Owner {
    /// Brakes, closes, and waits for it, so that the robot can be opened again at once.
    fn drop(&mut self) {
        drop(self.requests.take());
        let within = self.patience.reply + braking(&self.patience);
        let ended = matches!(
            self.ended.recv_timeout(within),
            Err(RecvTimeoutError::Disconnected)
        );
        if !ended && self.dead.is_none() {
            emergency(Arc::clone(&self.sdk), self.id, self.patience);
        }
    }
}

/// Brakes from a thread of its own while the owner hangs in a call: the library's documentation says that its calls
/// may come from any thread. True when the robot confirmed.
fn emergency(sdk: Arc<dyn Sdk>, id: DeviceId, patience: Patience) -> bool {
    let (tell, hear) = mpsc::sync_channel(1);
    let body = move || {
        let braked = brake(&*sdk, id, &patience, std::thread::sleep).is_ok();
        let _ = tell.send(braked);
    };
    let started = std::thread::Builder::new()
        .name("omega3-emergency".to_owned())
        .spawn(body);
    started.is_ok()
        && hear
            .recv_timeout(patience.reply + braking(&patience))
            .unwrap_or(false)
}

/// Serves requests and cycles until nobody asks any more.
fn serve(mut engine: Engine<RealClock>, clock: RealClock, inbox: &Receiver<Request>) {
    let mut next = clock.now();
    loop {
        let left = next - clock.now();
        let wait = Duration::from_nanos(u64::try_from(left.0).unwrap_or(0));
        match inbox.recv_timeout(wait) {
            Ok(request) => answer(&mut engine, request),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return,
        }
        let now = clock.now();
        if now >= next {
            engine.tick();
            // A late cycle is not made up for: the set point waits, see the engine.
            next = (next + engine.period()).max(now);
        }
    }
}

/// Answers one request. Whoever asked may have given up: then the answer is dropped.
fn answer(engine: &mut Engine<RealClock>, request: Request) {
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
