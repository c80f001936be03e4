//! The trigger box as a `TriggerBox` device.

use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use skinrig_device::{DeviceError, RealClock, TriggerBox, TriggerCapabilities};
use skinrig_model::pulse::LAST_MARKED_PRESS;
use skinrig_model::{
    BoxReport, DeviceIdentity, DeviceRole, HostDuration, Mark, PulseTrain, SentMark,
};

use crate::config::TriggerBoxConfig;
use crate::handshake::run_handshake;
use crate::link::Link;
use crate::notes::{Losses, describe_losses};
use crate::protocol::{Counters, MAX_SERIAL, MIN_SYNC_PERIOD_MS, SelfTest};
use crate::serial::SerialConnector;
use crate::shared::{Shared, lock};
use crate::wire::{Connector, OpenError, connect_when_free};
use crate::worker::{Command, CommandResult, Job, Worker};

/// Extra time after a command's deadline, for one more try or handshake.
const REPLY_GRACE: Duration = Duration::from_secs(2);

/// Upper limit of the configurable drift: 10 %.
const MAX_DRIFT_PPM: f64 = 100_000.0;

/// A trigger box on a serial line that is owned by a separate thread.
///
/// It is disarmed after opening: call [`SerialTriggerBox::arm`] first. Dropping it disarms the box.
pub struct SerialTriggerBox {
    identity: DeviceIdentity,
    command_timeout: Duration,
    jobs: Option<SyncSender<Job>>,
    shared: Arc<Mutex<Shared>>,
    thread: Option<JoinHandle<()>>,
    reported: ReportedCounters,
}

/// Counters that notes have already reported.
#[derive(Default)]
struct ReportedCounters {
    /// Counters at that time; `None` before arming, or if they could not be read.
    losses: Option<Losses>,
    /// Number of resets at that time: a reset restarts the box's counters at 0.
    resets: u64,
    contradictions: u64,
}

impl SerialTriggerBox {
    /// Opens the serial port and waits for the box's handshake.
    ///
    /// # Errors
    /// [`DeviceError::Lost`] when the port cannot be opened (with the reason and the next step) or the box does not reply,
    /// [`DeviceError::Refused`] for another device, firmware or serial number.
    pub fn open(config: TriggerBoxConfig, clock: RealClock) -> Result<Self, DeviceError> {
        let connector = SerialConnector::new(config.port.clone());
        Self::open_with(config, Box::new(connector), clock)
    }

    /// Like [`SerialTriggerBox::open`], with any connector.
    ///
    /// # Errors
    /// As [`SerialTriggerBox::open`].
    pub fn open_with(
        config: TriggerBoxConfig,
        mut connector: Box<dyn Connector>,
        clock: RealClock,
    ) -> Result<Self, DeviceError> {
        let named = config.serial.clone().unwrap_or_else(|| config.port.clone());
        if !(0.0..=MAX_DRIFT_PPM).contains(&config.max_drift_ppm) {
            return Err(DeviceError::Refused {
                role: DeviceRole::TriggerBox,
                serial: named,
                expected: format!("a largest drift of 0 to {MAX_DRIFT_PPM} ppm"),
                found: format!("{} ppm", config.max_drift_ppm),
            });
        }
        let wire = connect_when_free(connector.as_mut(), config.hello_timeout)
            .map_err(|e| open_failed(&e, &named))?;
        let mut link = Link::new(wire, clock);
        let handshake = run_handshake(
            &mut link,
            connector.target(),
            config.serial.as_deref(),
            config.hello_timeout,
        )
        .map_err(|e| e.into_device_error(&named))?;
        let shared = Arc::new(Mutex::new(Shared::default()));
        let command_timeout = config.command_timeout;
        let mut worker = Worker::new(
            config,
            connector,
            clock,
            link,
            &handshake,
            Arc::clone(&shared),
        );
        worker.begin()?;
        let (jobs, inbox): (_, Receiver<Job>) = sync_channel(8);
        let thread = std::thread::Builder::new()
            .name("trigger-box".to_owned())
            .spawn(move || worker.run(&inbox))
            .map_err(|e| lost(&named, format!("cannot start a thread: {e}")))?;
        Ok(Self {
            identity: handshake.identity,
            command_timeout,
            jobs: Some(jobs),
            shared,
            thread: Some(thread),
            reported: ReportedCounters::default(),
        })
    }

    /// Enables pulses, and starts the sync trains if a period is set. The driver restores both after a reset of the box.
    ///
    /// # Errors
    /// [`DeviceError::Lost`].
    pub fn arm(&mut self) -> Result<(), DeviceError> {
        self.execute(Command::Arm)?;
        // The counters are for notes only: if they cannot be read, notes report the counts since the reset.
        let losses = self.counters().ok().map(Losses::from);
        self.reported = self.current_counters(losses);
        Ok(())
    }

    fn current_counters(&self, losses: Option<Losses>) -> ReportedCounters {
        let shared = lock(&self.shared);
        ReportedCounters {
            losses,
            resets: shared.resets,
            contradictions: shared.contradictions,
        }
    }

    /// Disables pulses and stops the sync trains.
    ///
    /// # Errors
    /// [`DeviceError::Lost`].
    pub fn disarm(&mut self) -> Result<(), DeviceError> {
        self.execute(Command::Disarm).map(|_| ())
    }

    /// Sets the period of sync trains while the box is armed, ms; `None` stops them.
    ///
    /// # Errors
    /// [`DeviceError::Refused`] for a period below twice the duration of a train (`MIN_SYNC_PERIOD_MS`), [`DeviceError::Lost`].
    pub fn set_sync(&mut self, period_ms: Option<u16>) -> Result<(), DeviceError> {
        if let Some(found) = period_ms.filter(|&ms| ms < MIN_SYNC_PERIOD_MS) {
            return Err(self.refused(
                format!("a period of at least {MIN_SYNC_PERIOD_MS} ms"),
                format!("{found} ms"),
            ));
        }
        self.execute(Command::Sync(period_ms.unwrap_or(0)))
            .map(|_| ())
    }

    /// Raises and lowers all outputs once. Do not call it during a recording: the pulse belongs to no train.
    ///
    /// # Errors
    /// [`DeviceError::State`] while disarmed or during a train, [`DeviceError::Lost`].
    pub fn self_test(&mut self) -> Result<SelfTest, DeviceError> {
        match self.execute(Command::SelfTest)? {
            CommandResult::SelfTest(test) => Ok(test),
            other => Err(self.unexpected_result(&other)),
        }
    }

    /// The box's counters since its reset.
    ///
    /// # Errors
    /// [`DeviceError::Lost`].
    pub fn counters(&mut self) -> Result<Counters, DeviceError> {
        match self.execute(Command::Counters)? {
            CommandResult::Counters(counters) => Ok(counters),
            other => Err(self.unexpected_result(&other)),
        }
    }

    /// Number of contradictions between time exchanges. If positive, the box's clock drifts by more than the configured limit.
    #[must_use]
    pub fn clock_contradictions(&self) -> u64 {
        lock(&self.shared).contradictions
    }

    /// Stores a serial number in the box's non-volatile memory: 1 to 16 printable ASCII characters without blanks.
    ///
    /// # Errors
    /// [`DeviceError::Refused`] for another text, [`DeviceError::State`] while armed, [`DeviceError::Lost`].
    pub fn set_serial(&mut self, serial: &str) -> Result<(), DeviceError> {
        let fits = (1..=MAX_SERIAL).contains(&serial.len());
        if !fits || !serial.bytes().all(|b| b.is_ascii_graphic()) {
            return Err(self.refused(
                format!("1 to {MAX_SERIAL} printable characters without blanks"),
                format!("{serial:?}"),
            ));
        }
        self.execute(Command::SetSerial(serial.to_owned()))?;
        self.identity.serial = serial.to_owned();
        Ok(())
    }

    fn execute(&mut self, command: Command) -> Result<CommandResult, DeviceError> {
        let (reply, answer) = sync_channel(1);
        let job = Job {
            command,
            reply,
            deadline: Instant::now() + self.command_timeout,
        };
        let ended = || lost(&self.identity.serial, "its thread ended".to_owned());
        let jobs = self.jobs.as_ref().ok_or_else(ended)?;
        jobs.try_send(job).map_err(|_| ended())?;
        // Up to one timeout in the queue and one for the execution.
        match answer.recv_timeout(2 * self.command_timeout + REPLY_GRACE) {
            Ok(done) => done,
            Err(RecvTimeoutError::Disconnected) => Err(ended()),
            Err(RecvTimeoutError::Timeout) => Err(lost(
                &self.identity.serial,
                "the driver's thread did not reply in time; the command may still be executed"
                    .to_owned(),
            )),
        }
    }

    fn refused(&self, expected: String, found: String) -> DeviceError {
        DeviceError::Refused {
            role: DeviceRole::TriggerBox,
            serial: self.identity.serial.clone(),
            expected,
            found,
        }
    }

    fn unexpected_result(&self, found: &CommandResult) -> DeviceError {
        lost(
            &self.identity.serial,
            format!("the driver's thread returned an unexpected result: {found:?}"),
        )
    }
}

impl TriggerBox for SerialTriggerBox {
    fn identity(&self) -> DeviceIdentity {
        self.identity.clone()
    }

    fn capabilities(&self) -> TriggerCapabilities {
        TriggerCapabilities {
            train_duration: HostDuration::from_micros(PulseTrain::DURATION_US as i64),
        }
    }

    /// The edge has risen when this returns, except during a sync train: then the mark's train follows it, at the returned time.
    fn send(&mut self, mark: Mark) -> Result<SentMark, DeviceError> {
        if PulseTrain::new(mark).is_none() {
            return Err(self.refused(format!("up to {LAST_MARKED_PRESS}"), mark.press.to_string()));
        }
        match self.execute(Command::Send(mark))? {
            CommandResult::Sent(sent) => Ok(sent),
            other => Err(self.unexpected_result(&other)),
        }
    }

    /// # Errors
    /// Also [`DeviceError::State`], once, when the box disarmed itself or dropped events.
    fn poll(&mut self, reports: &mut Vec<BoxReport>) -> Result<(), DeviceError> {
        let mut shared = lock(&self.shared);
        reports.append(&mut shared.reports);
        if let Some(why) = &shared.down {
            return Err(lost(&self.identity.serial, why.clone()));
        }
        shared.next_fault(&self.identity.serial).map_or(Ok(()), Err)
    }

    fn take_notes(&mut self) -> Vec<String> {
        let counters = self.counters();
        let now = self.current_counters(counters.as_ref().ok().map(|&c| c.into()));
        let before = std::mem::replace(&mut self.reported, now);
        let contradictions = self.reported.contradictions - before.contradictions;
        let (since, losses) = match before.losses {
            Some(losses) if before.resets == self.reported.resets => {
                ("it was armed or last queried", losses)
            }
            _ => ("its reset", Losses::default()),
        };
        let mut notes = Vec::new();
        if let Err(e) = counters {
            notes.push(format!(
                "losses are unknown because the counters could not be read ({e}): check the alignment certificate"
            ));
        }
        let now = *self.reported.losses.get_or_insert(losses);
        notes.extend(describe_losses(since, losses, now, contradictions));
        notes
    }
}

impl Drop for SerialTriggerBox {
    fn drop(&mut self) {
        // Ends the thread, which disarms the box; all its waits have time limits.
        self.jobs = None;
        if let Some(thread) = self.thread.take() {
            // A panic has already printed its message.
            let _ = thread.join();
        }
    }
}

fn lost(serial: &str, detail: String) -> DeviceError {
    DeviceError::Lost {
        role: DeviceRole::TriggerBox,
        serial: serial.to_owned(),
        detail,
    }
}

fn open_failed(error: &OpenError, serial: &str) -> DeviceError {
    lost(serial, error.to_string())
}
