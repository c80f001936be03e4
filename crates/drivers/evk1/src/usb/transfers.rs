//! Asynchronous bulk transfers that are always queued.
//!
//! An event thread runs libusb's event loop. The completion callback stamps the arrival, copies the bytes into the inbox's current block
//! (which becomes a chunk without another copy), and resubmits the transfer with its own buffer. The inbox never blocks, so the pipe keeps
//! moving whatever the rest of the program does.

#![expect(
    unsafe_code,
    reason = "rusb has no asynchronous interface: libusb's is called here and nowhere else"
)]

use std::ffi::c_void;
use std::ptr::NonNull;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use rusb::constants::{
    LIBUSB_TRANSFER_CANCELLED, LIBUSB_TRANSFER_COMPLETED, LIBUSB_TRANSFER_NO_DEVICE,
    LIBUSB_TRANSFER_OVERFLOW, LIBUSB_TRANSFER_STALL, LIBUSB_TRANSFER_TIMED_OUT,
};
use rusb::ffi::{
    libusb_alloc_transfer, libusb_cancel_transfer, libusb_fill_bulk_transfer, libusb_free_transfer,
    libusb_submit_transfer, libusb_transfer,
};
use rusb::{Context, DeviceHandle, UsbContext};
use skinrig_device::RealClock;

use crate::config::Evk1Config;
use crate::error::UsbError;
use crate::inbox::Inbox;
use crate::requests::EVENT_ENDPOINT;

/// Time limit for cancelled transfers and for the event thread.
const STOP_LIMIT: Duration = Duration::from_secs(1);
/// Consecutive failed transfers that end the stream, if failures count as losses.
const FAILURES: u32 = 100;
/// Longest wait of the event loop.
const LOOK_UP: Duration = Duration::from_millis(100);

/// State shared by the callbacks and the owner of the stream.
struct Shared {
    inbox: Arc<Inbox>,
    clock: RealClock,
    /// Whether a failed transfer is a loss instead of the end of the stream.
    failures_are_losses: bool,
    flight: Mutex<PendingTransfers>,
    /// Notified when a transfer is not resubmitted, and when the event thread ends.
    landed: Condvar,
    /// Whether the event thread must end despite transfers in flight.
    abandoned: AtomicBool,
}

#[derive(Default)]
struct PendingTransfers {
    /// Transfers in flight.
    count: usize,
    /// Whether submission is disabled.
    ending: bool,
    /// Consecutive failed transfers.
    failed: u32,
    stalled: bool,
    thread_ended: bool,
}

impl Shared {
    fn flight(&self) -> MutexGuard<'_, PendingTransfers> {
        self.flight.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until `done` or the time limit, and returns the state.
    fn wait(&self, done: impl Fn(&PendingTransfers) -> bool) -> MutexGuard<'_, PendingTransfers> {
        self.landed
            .wait_timeout_while(self.flight(), STOP_LIMIT, |f| !done(f))
            .unwrap_or_else(PoisonError::into_inner)
            .0
    }
}

/// A transfer with its buffer.
struct Job {
    transfer: NonNull<libusb_transfer>,
    buffer: NonNull<[u8]>,
    /// Target of the transfer's `user_data`.
    shared: *const Shared,
}

// SAFETY: the transfer and its buffer belong to this job alone; libusb allows any thread to submit, cancel and free a
// transfer, and the target of `shared` is Sync.
unsafe impl Send for Job {}

impl Job {
    fn new(
        handle: &DeviceHandle<Context>,
        shared: &Arc<Shared>,
        config: &Evk1Config,
    ) -> Result<Self, UsbError> {
        // SAFETY: allocates a transfer without isochronous packets, or returns null.
        let transfer = NonNull::new(unsafe { libusb_alloc_transfer(0) })
            .ok_or_else(|| UsbError::Other("no memory for a transfer".to_owned()))?;
        let buffer = Box::into_raw(vec![0_u8; config.transfer_bytes].into_boxed_slice());
        // SAFETY: a pointer that comes from a box is not null.
        let buffer = unsafe { NonNull::new_unchecked(buffer) };
        let shared = Arc::into_raw(Arc::clone(shared));
        // `Evk1Config::check` holds both numbers far below the limits of these types.
        let length = config.transfer_bytes as i32;
        let timeout_ms = config.transfer_timeout.as_millis() as u32;
        // SAFETY: the transfer was just allocated and is not submitted; the buffer has `length` bytes; both, and the target
        // of `user_data`, live until `Drop`, which runs only while the transfer is not in flight.
        unsafe {
            libusb_fill_bulk_transfer(
                transfer.as_ptr(),
                handle.as_raw(),
                EVENT_ENDPOINT,
                buffer.cast().as_ptr(),
                length,
                completed,
                shared.cast_mut().cast::<c_void>(),
                timeout_ms,
            );
        }
        Ok(Self {
            transfer,
            buffer,
            shared,
        })
    }
}

impl Drop for Job {
    fn drop(&mut self) {
        // SAFETY: jobs are dropped only while their transfer is not in flight (`Transfers::stop` leaks the others),
        // so libusb and the callback no longer use any of this; `new` created each pointer with its counterpart.
        unsafe {
            libusb_free_transfer(self.transfer.as_ptr());
            drop(Box::from_raw(self.buffer.as_ptr()));
            drop(Arc::from_raw(self.shared));
        }
    }
}

/// Completion callback of libusb, on the thread that handles events.
extern "system" fn completed(transfer: *mut libusb_transfer) {
    // SAFETY: libusb passes a transfer that `Job::new` filled: its `user_data` is a `Shared` that the job keeps
    // alive, and the job outlives the transfer's flight.
    let shared = unsafe { &*(*transfer).user_data.cast::<Shared>().cast_const() };
    let arrived = shared.clock.now();
    // SAFETY: the transfer is no longer in flight, so its first `actual_length` bytes are initialised and are not written
    // until it is submitted again below.
    let (status, bytes) = unsafe {
        let length = usize::try_from((*transfer).actual_length).unwrap_or(0);
        let bytes = std::slice::from_raw_parts((*transfer).buffer.cast_const(), length);
        ((*transfer).status, bytes)
    };
    // A transfer that timed out or was cancelled may contain data too.
    shared.inbox.push(bytes, arrived);
    let outcome = match status {
        LIBUSB_TRANSFER_COMPLETED | LIBUSB_TRANSFER_TIMED_OUT => Ok(true),
        LIBUSB_TRANSFER_CANCELLED => Ok(false),
        LIBUSB_TRANSFER_NO_DEVICE => Err(UsbError::Gone),
        LIBUSB_TRANSFER_STALL => Err(UsbError::Stall),
        LIBUSB_TRANSFER_OVERFLOW => Err(UsbError::Other(
            "the device sent more than a transfer holds".to_owned(),
        )),
        other => Err(UsbError::Other(format!(
            "a transfer failed (libusb status {other})"
        ))),
    };
    let mut flight = shared.flight();
    let outcome = match outcome {
        Err(UsbError::Other(_)) if shared.failures_are_losses && flight.failed < FAILURES => {
            flight.failed += 1;
            shared.inbox.lose_some(arrived);
            Ok(true)
        }
        Ok(resubmit) => {
            flight.failed = 0;
            Ok(resubmit)
        }
        ended => ended,
    };
    let outcome = outcome.and_then(|resubmit| match resubmit && !flight.ending {
        true => submit(transfer),
        false => Ok(false),
    });
    match outcome {
        Ok(true) => return,
        Ok(false) => {}
        Err(error) => {
            flight.stalled |= error == UsbError::Stall;
            shared.inbox.fail(error);
        }
    }
    flight.ending = true;
    flight.count -= 1;
    shared.landed.notify_all();
}

/// Submits a filled, idle transfer; returns whether it is in flight.
fn submit(transfer: *mut libusb_transfer) -> Result<bool, UsbError> {
    // SAFETY: both callers hold the flight's lock and a transfer that `Job::new` filled and that is not in flight.
    match unsafe { libusb_submit_transfer(transfer) } {
        0 => Ok(true),
        code => Err(submit_error(code)),
    }
}

fn submit_error(code: i32) -> UsbError {
    match code {
        rusb::constants::LIBUSB_ERROR_NO_DEVICE => UsbError::Gone,
        rusb::constants::LIBUSB_ERROR_NO_MEM => UsbError::Other(
            "no memory for transfers in the kernel: raise /sys/module/usbcore/parameters/usbfs_memory_mb".to_owned(),
        ),
        other => UsbError::Other(format!("submitting a transfer failed (libusb error {other})")),
    }
}

/// The transfers of a running stream and their thread.
pub(super) struct Transfers {
    jobs: Vec<Job>,
    shared: Arc<Shared>,
    context: Context,
    handle: Arc<DeviceHandle<Context>>,
    thread: Option<JoinHandle<()>>,
}

impl Transfers {
    /// Queues all transfers.
    pub fn start(
        context: Context,
        handle: Arc<DeviceHandle<Context>>,
        inbox: Arc<Inbox>,
        clock: RealClock,
        config: &Evk1Config,
    ) -> Result<Self, UsbError> {
        let shared = Arc::new(Shared {
            inbox,
            clock,
            failures_are_losses: config.tolerance.failed_transfers || config.tolerance.everything,
            flight: Mutex::default(),
            landed: Condvar::new(),
            abandoned: AtomicBool::new(false),
        });
        let jobs = (0..config.transfers)
            .map(|_| Job::new(&handle, &shared, config))
            .collect::<Result<Vec<_>, _>>()?;
        let thread = {
            let (context, shared) = (context.clone(), Arc::clone(&shared));
            std::thread::Builder::new()
                .name("evk1-usb".to_owned())
                .spawn(move || serve(&context, &shared))
                .map_err(|e| UsbError::Other(format!("starting the event thread: {e}")))?
        };
        let mut stream = Self {
            jobs,
            shared,
            context,
            handle,
            thread: Some(thread),
        };
        match stream.submit_all() {
            Ok(()) => Ok(stream),
            Err(error) => stream.stop().and(Err(error)),
        }
    }

    fn submit_all(&self) -> Result<(), UsbError> {
        for job in &self.jobs {
            let mut flight = self.shared.flight();
            if flight.ending {
                break; // One returned with an error, which is in the inbox.
            }
            submit(job.transfer.as_ptr())?;
            flight.count += 1;
        }
        Ok(())
    }

    /// Whether the endpoint stalled.
    pub fn stalled(&self) -> bool {
        self.shared.flight().stalled
    }

    /// Cancels the transfers and waits for them. Transfers that do not return are never freed.
    pub fn stop(&mut self) -> Result<(), UsbError> {
        let Some(thread) = self.thread.take() else {
            return Ok(());
        };
        self.shared.flight().ending = true;
        for job in &self.jobs {
            // SAFETY: the transfer is allocated. One that is not in flight returns an error, which needs no handling.
            unsafe { libusb_cancel_transfer(job.transfer.as_ptr()) };
        }
        let left = self.shared.wait(|f| f.count == 0).count;
        self.shared.abandoned.store(left > 0, Ordering::Release);
        self.context.interrupt_handle_events();
        let ended = self.shared.wait(|f| f.thread_ended).thread_ended;
        if ended {
            // A panic of the thread, which is not expected, has ended the stream.
            let _ = thread.join();
        }
        if left > 0 || !ended {
            // libusb or the kernel may still write to the buffers.
            std::mem::forget(std::mem::take(&mut self.jobs));
            std::mem::forget((Arc::clone(&self.handle), self.context.clone()));
            return Err(UsbError::Stuck {
                limit_ms: STOP_LIMIT.as_millis() as u64,
                left,
            });
        }
        Ok(())
    }
}

impl Drop for Transfers {
    fn drop(&mut self) {
        // The jobs must not be freed in flight; other errors cannot be reported here.
        let _ = self.stop();
    }
}

/// The event thread: runs until the last transfer returns.
fn serve(context: &Context, shared: &Shared) {
    /// Notifies waiting threads when the event thread exits, including by panic.
    struct ExitNotifier<'a>(&'a Shared);
    impl Drop for ExitNotifier<'_> {
        fn drop(&mut self) {
            let mut flight = self.0.flight();
            flight.ending = true;
            flight.thread_ended = true;
            self.0.landed.notify_all();
        }
    }
    let _end = ExitNotifier(shared);
    loop {
        match context.handle_events(Some(LOOK_UP)) {
            Ok(()) | Err(rusb::Error::Interrupted) => {}
            Err(e) => {
                shared
                    .inbox
                    .fail(UsbError::Other(format!("handling USB events: {e}")));
                return;
            }
        }
        let flight = shared.flight();
        if (flight.ending && flight.count == 0) || shared.abandoned.load(Ordering::Acquire) {
            return;
        }
    }
}
