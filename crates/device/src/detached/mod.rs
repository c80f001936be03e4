//! Devices on threads of their own: calls are asked and answered, so that none of them holds up whoever controls the robot.
//!
//! A driver's call may block: a serial line that takes no bytes, a control transfer that never completes. Around such a driver,
//! [`DetachedCamera`] and [`DetachedBox`] keep the promise that verbs return at once. What is asked goes to the device's thread; what
//! is not answered yet is [`DeviceError::Pending`], and what is not answered within its [`Patience`] is
//! [`DeviceError::Silent`]. Simulated and replayed devices answer at once and need neither.

mod camera;
mod trigger;

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender, TryRecvError};
use std::time::Duration;

use skinrig_model::{DeviceIdentity, DeviceRole, HostDuration};

use crate::{Clock, DeviceError};

pub use camera::DetachedCamera;
pub use trigger::DetachedBox;

/// From one look for an answer that is waited for to the next.
const LOOK: HostDuration = HostDuration::from_millis(1);

/// How long a device that still answers may take to close itself, on the operating system's clock.
const CLOSE_WITHIN: Duration = Duration::from_secs(5);

/// How long a device may take to answer, by the rig's clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Patience {
    /// A call that is made while the robot moves: nobody waits for it, and later than this it is a fault.
    pub running: HostDuration,
    /// A call that is waited for: settings, start and stop, all outside motions.
    pub set_up: HostDuration,
}

impl Patience {
    /// For hardware. Beyond the drivers' own time limits of one second for each request, so that what they say comes first. Our own
    /// choice.
    pub const BENCH: Self = Self {
        running: HostDuration::from_millis(2_000),
        set_up: HostDuration::from_millis(10_000),
    };
}

/// Counts the calls that a device has not answered. Clones share the count.
#[derive(Debug, Clone, Default)]
pub struct Calls(Arc<AtomicUsize>);

impl Calls {
    /// Calls under way or waiting.
    #[must_use]
    pub fn under_way(&self) -> usize {
        self.0.load(Ordering::Acquire)
    }
}

/// One call under way; counted until it is dropped.
struct Counted(Calls);

impl Counted {
    fn new(calls: &Calls) -> Self {
        calls.0.fetch_add(1, Ordering::AcqRel);
        Self(calls.clone())
    }
}

impl Drop for Counted {
    fn drop(&mut self) {
        self.0.0.fetch_sub(1, Ordering::AcqRel);
    }
}

type Job<D> = Box<dyn FnOnce(&mut D) + Send>;

/// A call that was asked.
struct Call<T> {
    reply: Receiver<T>,
    doing: &'static str,
    within: HostDuration,
    due: skinrig_model::HostTime,
}

/// The thread that owns a device, seen from outside.
struct Worker<D> {
    role: DeviceRole,
    identity: DeviceIdentity,
    clock: Box<dyn Clock>,
    patience: Patience,
    jobs: Option<Sender<Job<D>>>,
    ended: Receiver<()>,
    calls: Calls,
    /// A call is overdue.
    silent: bool,
}

impl<D: Send + 'static> Worker<D> {
    fn start(
        role: DeviceRole,
        identity: DeviceIdentity,
        device: D,
        clock: Box<dyn Clock>,
        patience: Patience,
    ) -> Result<Self, DeviceError> {
        let (jobs, inbox) = mpsc::channel::<Job<D>>();
        let (tell_ended, ended) = mpsc::channel::<()>();
        let body = move || {
            // Dropped last, when the device is closed: whoever waits is woken.
            let _ended = tell_ended;
            let mut device = device;
            for job in inbox {
                job(&mut device);
            }
        };
        std::thread::Builder::new()
            .name(role.to_string())
            .spawn(body)
            .map_err(|e| DeviceError::Lost {
                role,
                serial: identity.serial.clone(),
                detail: format!("no thread to be had: {e}"),
            })?;
        Ok(Self {
            role,
            identity,
            clock,
            patience,
            jobs: Some(jobs),
            ended,
            calls: Calls::default(),
            silent: false,
        })
    }

    fn lost(&self) -> DeviceError {
        DeviceError::Lost {
            role: self.role,
            serial: self.identity.serial.clone(),
            detail: "the thread that owns it ended".to_owned(),
        }
    }

    /// Asks the device, and does not wait.
    fn ask<T: Send + 'static>(
        &self,
        doing: &'static str,
        within: HostDuration,
        call: impl FnOnce(&mut D) -> T + Send + 'static,
    ) -> Result<Call<T>, DeviceError> {
        let (tell, reply) = mpsc::channel();
        let counted = Counted::new(&self.calls);
        let job: Job<D> = Box::new(move |device| {
            // Nobody may be left to hear it.
            let _ = tell.send(call(device));
            drop(counted);
        });
        let jobs = self.jobs.as_ref().ok_or_else(|| self.lost())?;
        jobs.send(job).map_err(|_| self.lost())?;
        Ok(Call {
            reply,
            doing,
            within,
            due: self.clock.now() + within,
        })
    }

    /// The answer, if it is there; the call stays asked otherwise.
    fn answer<T>(&mut self, asked: &mut Option<Call<T>>) -> Result<Option<T>, DeviceError> {
        let Some(call) = asked else { return Ok(None) };
        match call.reply.try_recv() {
            Ok(answer) => {
                *asked = None;
                self.silent = false;
                Ok(Some(answer))
            }
            Err(TryRecvError::Disconnected) => Err(self.lost()),
            Err(TryRecvError::Empty) if self.clock.now() < call.due => Ok(None),
            Err(TryRecvError::Empty) => {
                self.silent = true;
                Err(DeviceError::Silent {
                    role: self.role,
                    serial: self.identity.serial.clone(),
                    doing: call.doing,
                    within: call.within,
                })
            }
        }
    }

    /// Asks, and waits for the answer. A device that has not answered an earlier call is not waited for again.
    fn wait<T: Send + 'static>(
        &mut self,
        doing: &'static str,
        call: impl FnOnce(&mut D) -> T + Send + 'static,
    ) -> Result<T, DeviceError> {
        let within = match self.silent && self.calls.under_way() > 0 {
            true => HostDuration::ZERO,
            false => self.patience.set_up,
        };
        let mut asked = Some(self.ask(doing, within, call)?);
        loop {
            if let Some(answer) = self.answer(&mut asked)? {
                return Ok(answer);
            }
            let next = self.clock.now() + LOOK;
            self.clock.wait_until(next);
        }
    }

    fn pending(&self, doing: &'static str) -> DeviceError {
        DeviceError::Pending {
            role: self.role,
            serial: self.identity.serial.clone(),
            doing,
        }
    }
}

impl<D> Drop for Worker<D> {
    /// Lets the thread close the device, and waits for it, so that the device can be opened again at once. A thread that is held in a
    /// call is left to end with the process.
    fn drop(&mut self) {
        self.jobs = None;
        if self.silent && self.calls.under_way() > 0 {
            return;
        }
        // Whether it closed in time is told by whoever opens it next.
        let _: Result<(), RecvTimeoutError> = self.ended.recv_timeout(CLOSE_WITHIN);
    }
}
