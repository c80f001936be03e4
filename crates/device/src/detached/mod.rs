//! Devices on separate threads, so that a blocking call never delays the control of the robot.
//!
//! A driver's call may block: a serial line that accepts no bytes, a control transfer that never completes. [`DetachedCamera`] and
//! [`DetachedBox`] wrap such a driver so that calls return immediately. Calls run on the device's thread; an unfinished call returns
//! [`DeviceError::Pending`], and after its [`Timeouts`] [`DeviceError::Silent`]. Simulated and replayed devices do not need this.

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

/// Polling interval while waiting for a reply.
const LOOK: HostDuration = HostDuration::from_millis(1);

/// Time limit for closing a responsive device, on the operating system's clock.
const CLOSE_WITHIN: Duration = Duration::from_secs(5);

/// Time limits of a device's calls, on the rig's clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timeouts {
    /// For calls during robot motion. The caller does not wait; exceeding this is a fault.
    pub running: HostDuration,
    /// For blocking calls outside motion: settings, start and stop.
    pub set_up: HostDuration,
}

impl Timeouts {
    /// For hardware: longer than the drivers' own limit of one second per request, so that their errors come first. Our own choice.
    pub const BENCH: Self = Self {
        running: HostDuration::from_millis(2_000),
        set_up: HostDuration::from_millis(10_000),
    };
}

/// Number of unfinished calls of a device. Clones share the counter.
#[derive(Debug, Clone, Default)]
pub struct Calls(Arc<AtomicUsize>);

impl Calls {
    /// Number of calls that are queued or in progress.
    #[must_use]
    pub fn pending_calls(&self) -> usize {
        self.0.load(Ordering::Acquire)
    }
}

/// Guard of one unfinished call; counted until dropped.
struct CallGuard(Calls);

impl CallGuard {
    fn new(calls: &Calls) -> Self {
        calls.0.fetch_add(1, Ordering::AcqRel);
        Self(calls.clone())
    }
}

impl Drop for CallGuard {
    fn drop(&mut self) {
        self.0.0.fetch_sub(1, Ordering::AcqRel);
    }
}

type Job<D> = Box<dyn FnOnce(&mut D) + Send>;

/// An unfinished call.
struct Call<T> {
    reply: Receiver<T>,
    doing: &'static str,
    within: HostDuration,
    due: skinrig_model::HostTime,
}

/// Handle of the thread that owns a device.
struct Worker<D> {
    role: DeviceRole,
    identity: DeviceIdentity,
    clock: Box<dyn Clock>,
    timeouts: Timeouts,
    jobs: Option<Sender<Job<D>>>,
    ended: Receiver<()>,
    calls: Calls,
    /// Whether a call has exceeded its time limit.
    silent: bool,
}

impl<D: Send + 'static> Worker<D> {
    fn start(
        role: DeviceRole,
        identity: DeviceIdentity,
        device: D,
        clock: Box<dyn Clock>,
        timeouts: Timeouts,
    ) -> Result<Self, DeviceError> {
        let (jobs, inbox) = mpsc::channel::<Job<D>>();
        let (tell_ended, ended) = mpsc::channel::<()>();
        let body = move || {
            // Dropped last, after the device is closed, which wakes waiting threads.
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
                detail: format!("cannot start a thread: {e}"),
            })?;
        Ok(Self {
            role,
            identity,
            clock,
            timeouts,
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

    /// Sends a call without waiting.
    fn request<T: Send + 'static>(
        &self,
        doing: &'static str,
        within: HostDuration,
        call: impl FnOnce(&mut D) -> T + Send + 'static,
    ) -> Result<Call<T>, DeviceError> {
        let (tell, reply) = mpsc::channel();
        let counted = CallGuard::new(&self.calls);
        let job: Job<D> = Box::new(move |device| {
            // Sending fails if the caller is gone.
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

    /// Takes the reply if it is available; otherwise the call stays pending.
    fn answer<T>(&mut self, call_slot: &mut Option<Call<T>>) -> Result<Option<T>, DeviceError> {
        let Some(call) = call_slot else {
            return Ok(None);
        };
        match call.reply.try_recv() {
            Ok(answer) => {
                *call_slot = None;
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
                    doing: call.doing.into(),
                    within: call.within,
                })
            }
        }
    }

    /// Sends a call and waits for the reply. Fails immediately if an earlier call is overdue.
    fn wait<T: Send + 'static>(
        &mut self,
        doing: &'static str,
        call: impl FnOnce(&mut D) -> T + Send + 'static,
    ) -> Result<T, DeviceError> {
        let within = match self.silent && self.calls.pending_calls() > 0 {
            true => HostDuration::ZERO,
            false => self.timeouts.set_up,
        };
        let mut call_slot = Some(self.request(doing, within, call)?);
        loop {
            if let Some(answer) = self.answer(&mut call_slot)? {
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
            doing: doing.into(),
        }
    }
}

impl<D> Drop for Worker<D> {
    /// Waits until the thread has closed the device, so that it can be reopened immediately. Does not wait for a thread that hangs in a
    /// call.
    fn drop(&mut self) {
        self.jobs = None;
        if self.silent && self.calls.pending_calls() > 0 {
            return;
        }
        // If it did not close in time, reopening it will fail and report that.
        let _: Result<(), RecvTimeoutError> = self.ended.recv_timeout(CLOSE_WITHIN);
    }
}
