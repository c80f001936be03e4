//! The trigger box as the controller sees it.

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
use crate::greeting::greet;
use crate::link::Link;
use crate::notes::{Losses, note};
use crate::protocol::{Counters, MAX_SERIAL, MIN_SYNC_PERIOD_MS, SelfTest};
use crate::serial::SerialDial;
use crate::shared::{Shared, lock};
use crate::wire::{Dial, OpenError, dial_patiently};
use crate::worker::{Command, Done, Job, Worker};

/// Beyond its deadline a command may still be on the line for one more try or one hello.
const GRACE: Duration = Duration::from_secs(2);

/// No clock drifts by more than a tenth.
const MAX_DRIFT_PPM: f64 = 100_000.0;

/// A trigger box over a line that a thread of its own keeps.
///
/// After opening it is disarmed: [`SerialTriggerBox::arm`] first. Dropping it disarms the box.
pub struct SerialTriggerBox {
    identity: DeviceIdentity,
    command_timeout: Duration,
    jobs: Option<SyncSender<Job>>,
    shared: Arc<Mutex<Shared>>,
    thread: Option<JoinHandle<()>>,
    told: Told,
}

/// What notes need not tell (again).
#[derive(Default)]
struct Told {
    /// What the box had counted; `None` before it was armed, or when it did not say.
    losses: Option<Losses>,
    /// Resets until then: after another one the box counts from 0.
    resets: u64,
    contradictions: u64,
}

impl SerialTriggerBox {
    /// Opens the serial port and waits for the box to say hello.
    ///
    /// # Errors
    /// [`DeviceError::Lost`] when the port cannot be opened (with the reason and what to do) or nobody answers,
    /// [`DeviceError::Refused`] for another device, firmware or serial number.
    pub fn open(config: TriggerBoxConfig, clock: RealClock) -> Result<Self, DeviceError> {
        let dial = SerialDial::new(config.port.clone());
        Self::open_with(config, Box::new(dial), clock)
    }

    /// As [`SerialTriggerBox::open`], over any line.
    ///
    /// # Errors
    /// As there.
    pub fn open_with(
        config: TriggerBoxConfig,
        mut dial: Box<dyn Dial>,
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
        let wire = dial_patiently(dial.as_mut(), config.hello_timeout)
            .map_err(|e| open_failed(&e, &named))?;
        let mut link = Link::new(wire, clock);
        let greeted = greet(
            &mut link,
            dial.target(),
            config.serial.as_deref(),
            config.hello_timeout,
        )
        .map_err(|e| e.into_device_error(&named))?;
        let shared = Arc::new(Mutex::new(Shared::default()));
        let command_timeout = config.command_timeout;
        let mut worker = Worker::new(config, dial, clock, link, &greeted, Arc::clone(&shared));
        worker.begin()?;
        let (jobs, inbox): (_, Receiver<Job>) = sync_channel(8);
        let thread = std::thread::Builder::new()
            .name("trigger-box".to_owned())
            .spawn(move || worker.run(&inbox))
            .map_err(|e| lost(&named, format!("no thread to be had: {e}")))?;
        Ok(Self {
            identity: greeted.identity,
            command_timeout,
            jobs: Some(jobs),
            shared,
            thread: Some(thread),
            told: Told::default(),
        })
    }

    /// Allows pulses, and starts the sync trains if a period was set. After a reset of the box both are put back.
    ///
    /// # Errors
    /// [`DeviceError::Lost`].
    pub fn arm(&mut self) -> Result<(), DeviceError> {
        self.ask(Command::Arm)?;
        // Only for the notes: a box that does not say is armed all the same, and they tell what it counted since its reset.
        let losses = self.counters().ok().map(Losses::from);
        self.told = self.told_until_now(losses);
        Ok(())
    }

    fn told_until_now(&self, losses: Option<Losses>) -> Told {
        let shared = lock(&self.shared);
        Told {
            losses,
            resets: shared.resets,
            contradictions: shared.contradictions,
        }
    }

    /// Forbids pulses and ends the sync trains.
    ///
    /// # Errors
    /// [`DeviceError::Lost`].
    pub fn disarm(&mut self) -> Result<(), DeviceError> {
        self.ask(Command::Disarm).map(|_| ())
    }

    /// Sync trains with this period in ms while the box is armed; `None` ends them.
    ///
    /// # Errors
    /// [`DeviceError::Refused`] for a period below twice a train (`MIN_SYNC_PERIOD_MS`), [`DeviceError::Lost`].
    pub fn set_sync(&mut self, period_ms: Option<u16>) -> Result<(), DeviceError> {
        if let Some(found) = period_ms.filter(|&ms| ms < MIN_SYNC_PERIOD_MS) {
            return Err(self.refused(
                format!("a period of at least {MIN_SYNC_PERIOD_MS} ms"),
                format!("{found} ms"),
            ));
        }
        self.ask(Command::Sync(period_ms.unwrap_or(0))).map(|_| ())
    }

    /// Raises and lowers all outputs once. Not during a train, and not while anything is recorded: the pulse belongs to
    /// no train.
    ///
    /// # Errors
    /// [`DeviceError::State`] while disarmed or busy, [`DeviceError::Lost`].
    pub fn self_test(&mut self) -> Result<SelfTest, DeviceError> {
        match self.ask(Command::SelfTest)? {
            Done::SelfTest(test) => Ok(test),
            other => Err(self.mixed_up(&other)),
        }
    }

    /// The box's counters since its reset.
    ///
    /// # Errors
    /// [`DeviceError::Lost`].
    pub fn counters(&mut self) -> Result<Counters, DeviceError> {
        match self.ask(Command::Counters)? {
            Done::Counters(counters) => Ok(counters),
            other => Err(self.mixed_up(&other)),
        }
    }

    /// How often exchanges of time excluded each other: above 0 the box's clock drifts by more than the configured limit.
    #[must_use]
    pub fn clock_contradictions(&self) -> u64 {
        lock(&self.shared).contradictions
    }

    /// Gives the box a serial number that it keeps without power: 1 to 16 printable ASCII characters without blanks.
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
        self.ask(Command::SetSerial(serial.to_owned()))?;
        self.identity.serial = serial.to_owned();
        Ok(())
    }

    fn ask(&mut self, command: Command) -> Result<Done, DeviceError> {
        let (reply, answer) = sync_channel(1);
        let job = Job {
            command,
            reply,
            deadline: Instant::now() + self.command_timeout,
        };
        let gone = || lost(&self.identity.serial, "its thread ended".to_owned());
        let jobs = self.jobs.as_ref().ok_or_else(gone)?;
        jobs.try_send(job).map_err(|_| gone())?;
        // Queued, then carried out, each for at most the timeout.
        match answer.recv_timeout(2 * self.command_timeout + GRACE) {
            Ok(done) => done,
            Err(RecvTimeoutError::Disconnected) => Err(gone()),
            Err(RecvTimeoutError::Timeout) => Err(lost(
                &self.identity.serial,
                "the driver's thread did not answer in time; what was asked may still be carried out".to_owned(),
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

    fn mixed_up(&self, found: &Done) -> DeviceError {
        lost(
            &self.identity.serial,
            format!("the driver's thread answered another question: {found:?}"),
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

    /// The edge rose when this returns, but during a sync train: then the mark's train begins right after it, at
    /// the instant that is told.
    fn send(&mut self, mark: Mark) -> Result<SentMark, DeviceError> {
        if PulseTrain::new(mark).is_none() {
            return Err(self.refused(format!("up to {LAST_MARKED_PRESS}"), mark.press.to_string()));
        }
        match self.ask(Command::Send(mark))? {
            Done::Sent(sent) => Ok(sent),
            other => Err(self.mixed_up(&other)),
        }
    }

    /// # Errors
    /// Besides those of the trait: [`DeviceError::State`] once when the box disarmed itself or lost events.
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
        let now = self.told_until_now(counters.as_ref().ok().map(|&c| c.into()));
        let before = std::mem::replace(&mut self.told, now);
        let contradictions = self.told.contradictions - before.contradictions;
        let (since, losses) = match before.losses {
            Some(losses) if before.resets == self.told.resets => {
                ("it was armed or last asked", losses)
            }
            _ => ("its reset", Losses::default()),
        };
        let mut notes = Vec::new();
        if let Err(e) = counters {
            notes.push(format!(
                "what it lost is not known, because its counters could not be read ({e}): look at the alignment certificate"
            ));
        }
        let now = *self.told.losses.get_or_insert(losses);
        notes.extend(note(since, losses, now, contradictions));
        notes
    }
}

impl Drop for SerialTriggerBox {
    fn drop(&mut self) {
        // Ends the thread, which disarms the box; every wait of it has an end.
        self.jobs = None;
        if let Some(thread) = self.thread.take() {
            // A panic over there has been told by its own message.
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
