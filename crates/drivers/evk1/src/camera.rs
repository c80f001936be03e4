//! The EVK1 as an `EventCamera`.

use std::sync::Arc;
use std::time::Duration;

use skinrig_device::{
    CameraCapabilities, CameraSettings, Clock, DeviceError, EventCamera, OpenChunk, PatternScan,
    RealClock, SyncMode, TestPattern,
};
use skinrig_model::{
    CameraId, DeviceIdentity, DeviceRole, HostDuration, HostTime, RawChunk, SENSOR_HEIGHT,
    SENSOR_WIDTH, Setting, StreamFormat,
};

use crate::access::Registers;
use crate::biases::{BIASES, DIFF};
use crate::chunks::Chunker;
use crate::config::Evk1Config;
use crate::error::{Evk1Error, FirstError, UsbError};
use crate::identify::{Identity, identify_tolerating, open_serial};
use crate::inbox::{Inbox, QueuedData};
use crate::overflow::{OVERFLOW_PERIOD, Overflow};
use crate::registers::{CHIP_ID, OVERFLOW_HITCOUNT, TEMPERATURE};
use crate::report::StreamReport;
use crate::settings::ValidatedSettings;
use crate::tolerance::{Mismatch, Mismatches, Tolerance, ToleranceKey};
use crate::triggers::{self, CHANNELS, TriggerOut};
use crate::usb::Transport;
use crate::{noise_filter, pattern, sequences, sync};

/// An initialised Prophesee EVK1 Gen3.1. Powered down on drop.
pub struct Evk1 {
    camera: CameraId,
    identity: Identity,
    config: Evk1Config,
    /// Tolerated mismatches.
    mismatches: Mismatches,
    transport: Box<dyn Transport>,
    clock: Box<dyn Clock>,
    settings: Option<ValidatedSettings>,
    /// Whether the pattern generator may be on.
    pattern: bool,
    stream: Option<Stream>,
    chunker: Chunker,
    report: StreamReport,
    notes: Vec<String>,
    /// Whether it was started before.
    used: bool,
    gone: bool,
    closed: bool,
}

/// Prefix of a port name, which can replace an unreadable serial number.
const BY_PORT: &str = "usb-";

/// The registers with the exceptions of `config`.
fn registers_of<'a>(
    transport: &'a mut dyn Transport,
    config: &'a Evk1Config,
    mismatches: &Mismatches,
) -> Registers<'a> {
    Registers::new(transport, &config.read_back_exceptions)
        .tolerating(&config.tolerance, mismatches)
}

/// Resets the camera on the bus.
fn reset(
    transport: &mut dyn Transport,
    tolerance: &Tolerance,
    mismatches: &Mismatches,
) -> Result<(), Evk1Error> {
    match transport.reset() {
        Ok(()) => Ok(()),
        Err(e) if tolerance.failed_reset && e != UsbError::Gone => Ok(()),
        Err(e) if tolerance.everything && e != UsbError::Gone => {
            mismatches.add(
                ToleranceKey::FailedReset,
                format!("expected a reset on the bus, found {e}"),
            );
            Ok(())
        }
        Err(e) => Err(e.during("resetting the camera on the bus")),
    }
}

/// State that exists only while streaming.
struct Stream {
    inbox: Arc<Inbox>,
    /// Overflow counter before the start.
    overflow_hits: u16,
    overflow: Overflow,
}

impl Evk1 {
    /// Opens the camera with this serial number (8 hexadecimal digits) or at this port (`usb-BUS-PORT.PORT`) through libusb. Data are stamped
    /// with `clock`.
    ///
    /// # Errors
    /// [`Evk1Error::NotFound`] lists the connected cameras; otherwise as [`Self::open`].
    pub fn open_serial(
        serial: &str,
        camera: CameraId,
        config: Evk1Config,
        clock: RealClock,
    ) -> Result<Self, Evk1Error> {
        config.check()?;
        let usb = open_serial(serial, clock, &config.tolerance)?;
        let mut opened = Self::open(Box::new(usb), camera, config, Box::new(clock))?;
        if serial.starts_with(BY_PORT) {
            // Findings while listing were not requested.
            opened.identity.serial = serial.to_owned();
        }
        Ok(opened)
    }

    /// Identifies and initialises the camera behind `transport`. Waits, such as half a second at each start, use `clock`.
    ///
    /// # Errors
    /// [`Evk1Error::NotEvk1`] before anything is written; [`Evk1Error::Refused`] for an inconsistent configuration;
    /// [`Evk1Error::NotBooted`], [`Evk1Error::ReadBack`], [`Evk1Error::Usb`].
    pub fn open(
        mut transport: Box<dyn Transport>,
        camera: CameraId,
        config: Evk1Config,
        mut clock: Box<dyn Clock>,
    ) -> Result<Self, Evk1Error> {
        config.check()?;
        let mismatches = Mismatches::default();
        let identity = identify_tolerating(
            transport.as_mut(),
            clock.as_mut(),
            &config.tolerance,
            &mismatches,
        )?;
        // Data left by an earlier program would come first, with other times.
        reset(transport.as_mut(), &config.tolerance, &mismatches)?;
        let mut registers = registers_of(transport.as_mut(), &config, &mismatches);
        // Its value is not meaningful yet, and the sensor may be unpowered.
        registers.read_unpowered(CHIP_ID)?;
        sequences::initialise(&mut registers, identity.fpga_version)?;
        pattern::clear(&mut registers)?;
        let chunker = Chunker::new(camera, config.max_time_step_us);
        Ok(Self {
            camera,
            identity,
            config,
            mismatches,
            transport,
            clock,
            settings: None,
            pattern: false,
            stream: None,
            chunker,
            report: StreamReport::default(),
            notes: Vec::new(),
            used: false,
            gone: false,
            closed: false,
        })
    }

    /// Mismatches tolerated so far, each with the key that accepts it.
    #[must_use]
    pub fn mismatches(&self) -> Vec<Mismatch> {
        self.mismatches.all()
    }

    /// Shared list of mismatches, which grows while the camera runs.
    #[must_use]
    pub fn tolerated(&self) -> Mismatches {
        self.mismatches.clone()
    }

    /// Report of the current or last stream.
    #[must_use]
    pub fn report(&self) -> &StreamReport {
        &self.report
    }

    /// Whether the stream has valid times; a slave's does not until its master's clock arrives.
    #[must_use]
    pub fn time_runs(&self) -> bool {
        self.stream.is_some() && self.chunker.time_runs()
    }

    /// Switches the trigger output on or off. With input channel 6 enabled, the camera receives its own pulses without a wire.
    ///
    /// # Errors
    /// [`Evk1Error::Refused`] on a master, whose output line carries the sync clock, with an FPGA version before 3.0.0, and for pulses out of
    /// range; [`Evk1Error::Usb`], [`Evk1Error::ReadBack`].
    pub fn set_trigger_out(&mut self, pulses: Option<TriggerOut>) -> Result<(), Evk1Error> {
        if let Some(pulses) = pulses {
            pulses.check()?;
            let mode = self.settings.as_ref().map(ValidatedSettings::sync);
            sync::check(mode.unwrap_or_default(), true)?;
        }
        if self.identity.fpga_version < sequences::TRIGGER_OUT_SINCE {
            if pulses.is_none() {
                return Ok(()); // There is none to switch off.
            }
            return Err(Evk1Error::refused(
                "FPGA version 3.0.0 or later for a trigger output",
                self.identity.firmware(),
            ));
        }
        triggers::write_out(&mut self.registers(), pulses)
    }

    /// Stops the stream, powers the camera down, empties its buffers and releases it. Continues after a failed step. Discards the bytes of
    /// a running stream.
    ///
    /// # Errors
    /// The first [`Evk1Error::Usb`] or [`Evk1Error::ReadBack`]; the camera is released anyway.
    pub fn close(mut self) -> Result<(), Evk1Error> {
        self.close_device()
    }

    fn close_device(&mut self) -> Result<(), Evk1Error> {
        if std::mem::replace(&mut self.closed, true) {
            return Ok(());
        }
        let streaming = self.stream.take().is_some();
        let back = self.transport.stop_stream();
        if self.gone {
            return Ok(());
        }
        // The sensor must never stay powered, whichever step failed.
        let mut done = FirstError::default();
        done.after(back.map_err(|e| e.during("stopping the stream")));
        let mut registers = registers_of(self.transport.as_mut(), &self.config, &self.mismatches);
        if streaming {
            done.after(sequences::stop(&mut registers));
        }
        if self.pattern {
            done.after(pattern::disable(&mut registers));
        }
        done.after(sequences::close(&mut registers, self.clock.as_ref()));
        done.outcome()
    }

    fn registers(&mut self) -> Registers<'_> {
        registers_of(self.transport.as_mut(), &self.config, &self.mismatches)
    }

    /// Converts to an error of the device trait, and remembers that the camera is disconnected.
    fn fault(&mut self, error: Evk1Error) -> DeviceError {
        let cause = |e: &Evk1Error| match e {
            Evk1Error::Usb { cause, .. } => Some(cause.clone()),
            _ => None,
        };
        self.gone |= cause(&error) == Some(UsbError::Gone);
        let role = DeviceRole::of_camera(self.camera);
        let serial = self.identity.serial.clone();
        match error {
            Evk1Error::ReadBack {
                name,
                address,
                expected,
                found,
            } => DeviceError::ReadBack {
                role,
                serial,
                name: format!("{name} ({address:#06x})"),
                expected: format!("{expected:#010x}"),
                found: format!("{found:#010x}"),
            },
            Evk1Error::Setting {
                name,
                expected,
                found,
            } => DeviceError::ReadBack {
                role,
                serial,
                name,
                expected,
                found,
            },
            Evk1Error::Refused { expected, found } => DeviceError::Refused {
                role,
                serial,
                expected,
                found,
            },
            Evk1Error::State { expected, found } => DeviceError::State {
                role,
                serial,
                expected: expected.to_owned(),
                found: found.to_owned(),
            },
            other => DeviceError::Lost {
                role,
                serial,
                detail: other.to_string(),
            },
        }
    }

    fn expect_stopped(&self) -> Result<(), Evk1Error> {
        match self.stream {
            None => Ok(()),
            Some(_) => Err(Evk1Error::State {
                expected: "stopped",
                found: "streaming",
            }),
        }
    }

    fn try_configure(&mut self, settings: &CameraSettings) -> Result<Vec<Setting>, Evk1Error> {
        self.expect_stopped()?;
        let checked = ValidatedSettings::new(settings)?;
        self.give_pixels_back()?;
        let mut registers = self.registers();
        checked.write(&mut registers)?;
        let mut read = checked.read_back(&mut registers)?;
        self.settings = Some(checked);
        read.extend(self.mismatches.all().into_iter().map(|mismatch| Setting {
            name: format!("tolerated: {}", mismatch.key),
            requested: Setting::TOLERATED.to_owned(),
            read_back: mismatch.what,
        }));
        Ok(read)
    }

    fn give_pixels_back(&mut self) -> Result<(), Evk1Error> {
        if self.pattern {
            pattern::disable(&mut self.registers())?;
            self.pattern = false;
        }
        Ok(())
    }

    fn try_pattern(
        &mut self,
        pattern: Option<TestPattern>,
    ) -> Result<Option<PatternScan>, Evk1Error> {
        self.expect_stopped()?;
        let Some(pattern) = pattern else {
            return self.give_pixels_back().map(|()| None);
        };
        self.pattern = true;
        pattern::on(&mut self.registers(), pattern).map(Some)
    }

    fn try_start(&mut self) -> Result<(), Evk1Error> {
        self.expect_stopped()?;
        let (channels, sync) = match &self.settings {
            Some(s) => (s.trigger_channels().to_vec(), s.sync()),
            None => (Vec::new(), SyncMode::default()),
        };
        let mut report = StreamReport::default();
        let mut registers = registers_of(self.transport.as_mut(), &self.config, &self.mismatches);
        if std::mem::replace(&mut self.used, true) {
            report.left_over_bytes =
                sequences::clear_left_over(&mut registers, self.clock.as_ref())?;
        }
        if !channels.is_empty() {
            // As in the public driver, they are off after a stop.
            triggers::write(&mut registers, &channels)?;
        }
        let overflow_hits = registers.read(OVERFLOW_HITCOUNT)? as u16;
        if self.config.overflow_is_loss && overflow_hits == u16::MAX {
            return Err(Evk1Error::OverflowCounterFull);
        }
        let inbox = Arc::new(Inbox::new(
            self.config.chunk_bytes,
            self.config.backlog_bytes,
        ));
        self.transport
            .start_stream(Arc::clone(&inbox), &self.config)
            .map_err(|e| e.during("queueing transfers"))?;
        self.chunker.start(sync == SyncMode::Slave);
        self.report = report;
        let clock = &mut self.clock;
        let mut wait = |span: Duration| {
            let span = i64::try_from(span.as_nanos()).unwrap_or(i64::MAX);
            let end = clock.now() + HostDuration(span);
            clock.wait_until(end);
        };
        let mut registers = registers_of(self.transport.as_mut(), &self.config, &self.mismatches);
        if let Err(error) = sequences::start(&mut registers, &mut wait) {
            self.undo_start();
            return Err(error);
        }
        // Overflows during the start are not losses: that data is discarded anyway.
        let hits = match registers.read(OVERFLOW_HITCOUNT) {
            Ok(hits) => hits as u16,
            Err(error) => {
                self.undo_start();
                return Err(error);
            }
        };
        self.stream = Some(Stream {
            inbox,
            overflow_hits,
            overflow: Overflow {
                hits,
                read_at: self.clock.now(),
                good_us: None,
            },
        });
        Ok(())
    }

    /// Reverts a failed start: transfers, time base, and the noise filter, which would drop everything and pass for the configured
    /// setting at the next start. Ignores further errors, because the first one is more informative.
    fn undo_start(&mut self) {
        let filter = self
            .settings
            .as_ref()
            .and_then(ValidatedSettings::noise_filter);
        let _ = self.transport.stop_stream();
        let mut registers = self.registers();
        let _ = sequences::stop(&mut registers);
        let _ = noise_filter::write(&mut registers, filter);
    }

    /// Converts received blocks to chunks, then returns the error that ended the stream, if any.
    fn hand_over(
        &mut self,
        taken: QueuedData,
        chunks: &mut Vec<RawChunk>,
    ) -> Result<(), Evk1Error> {
        for block in taken.blocks {
            self.chunker.take(block, &mut self.report, chunks);
        }
        match taken.error {
            Some(error) => Err(error.during("receiving events")),
            None => Ok(()),
        }
    }

    /// Returns received data, and losses counted by the camera.
    fn try_take(&mut self, all: bool, chunks: &mut Vec<RawChunk>) -> Result<(), Evk1Error> {
        let Some(mut stream) = self.stream.take() else {
            return Ok(());
        };
        let now = self.clock.now();
        let due = self.config.overflow_is_loss
            && (all || now - stream.overflow.read_at >= OVERFLOW_PERIOD);
        // Read before taking the bytes: counted losses lie before or within them.
        let hits = match due {
            true => self.registers().read(OVERFLOW_HITCOUNT).map(|w| w as u16),
            false => Ok(stream.overflow.hits),
        };
        let lost = due && hits.as_ref().is_ok_and(|h| stream.overflow.lost(*h));
        let taken = match all || lost {
            true => stream.inbox.take_all(),
            false => stream.inbox.take_full(),
        };
        let mut received = self.hand_over(taken, chunks);
        match hits {
            Ok(hits) if due => {
                self.follow_overflow(&mut stream.overflow, hits, now, chunks);
            }
            Ok(_) => {}
            Err(error) => received = received.and(Err(error)),
        }
        self.stream = Some(stream);
        received
    }

    /// Processes the overflow counter `hits` at `now`.
    fn follow_overflow(
        &mut self,
        last: &mut Overflow,
        hits: u16,
        now: HostTime,
        chunks: &mut Vec<RawChunk>,
    ) {
        if last.lost(hits) {
            let report = &mut self.report;
            self.chunker.overflowed(now, last.good_us, report, chunks);
        }
        *last = Overflow {
            hits,
            read_at: now,
            good_us: self.chunker.reached_us(),
        };
    }

    fn try_stop(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), Evk1Error> {
        let Some(mut stream) = self.stream.take() else {
            return Ok(());
        };
        let back = self.transport.stop_stream();
        let received = self.hand_over(stream.inbox.finish(), chunks);
        let answered = match &received {
            Err(Evk1Error::Usb {
                cause: UsbError::Gone,
                ..
            }) => Ok(()),
            _ => self.stop_device(stream.overflow_hits),
        };
        if let (true, Some((_, hits))) = (self.config.overflow_is_loss, self.report.overflow_hits) {
            let now = self.clock.now();
            self.follow_overflow(&mut stream.overflow, hits, now, chunks);
        }
        self.report.failed_transfers = stream.inbox.failed_transfers();
        let failed = self.report.failed_transfers;
        if failed > 0 && !self.config.tolerance.failed_transfers {
            let found = format!("expected transfers that succeed, found {failed} that failed");
            self.mismatches.add(ToleranceKey::FailedTransfers, found);
        }
        self.notes.extend(self.report.notes());
        let tolerated = self.mismatches.all().into_iter();
        self.notes.extend(tolerated.map(|m| m.to_string()));
        received?;
        back.map_err(|e| e.during("stopping the stream"))?;
        answered
    }

    fn stop_device(&mut self, overflow_hits: u16) -> Result<(), Evk1Error> {
        let mut registers = self.registers();
        sequences::stop(&mut registers)?;
        let after = registers.read(OVERFLOW_HITCOUNT)? as u16;
        self.report.overflow_hits = Some((overflow_hits, after));
        Ok(())
    }
}

impl EventCamera for Evk1 {
    fn camera(&self) -> CameraId {
        self.camera
    }

    fn identity(&self) -> DeviceIdentity {
        DeviceIdentity {
            model: "Prophesee EVK1 Gen3.1".to_owned(),
            serial: self.identity.serial.clone(),
            firmware: self.identity.firmware(),
        }
    }

    fn capabilities(&self) -> CameraCapabilities {
        let settable = BIASES.iter().filter(|b| b.name != DIFF);
        CameraCapabilities {
            width: SENSOR_WIDTH,
            height: SENSOR_HEIGHT,
            format: StreamFormat::Evt2,
            trigger_channels: CHANNELS.to_vec(),
            biases: settable.map(|b| b.name.to_owned()).collect(),
        }
    }

    fn configure(&mut self, settings: &CameraSettings) -> Result<Vec<Setting>, DeviceError> {
        self.try_configure(settings).map_err(|e| self.fault(e))
    }

    fn start(&mut self) -> Result<(), DeviceError> {
        self.try_start().map_err(|e| self.fault(e))
    }

    fn poll(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        self.try_take(false, chunks).map_err(|e| self.fault(e))
    }

    fn flush(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        self.try_take(true, chunks).map_err(|e| self.fault(e))
    }

    fn newest(&mut self, most: usize) -> Option<Vec<u8>> {
        Some(self.stream.as_ref()?.inbox.newest(most))
    }

    /// None while words have no valid time.
    fn open_chunk(&mut self, from: usize) -> Option<OpenChunk> {
        let seq = self.chunker.open_seq()?;
        let inbox = &self.stream.as_ref()?.inbox;
        inbox.with_open(|bytes| OpenChunk::of(seq, 0, bytes, from))?
    }

    fn stop(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        self.try_stop(chunks).map_err(|e| self.fault(e))
    }

    fn test_pattern(
        &mut self,
        pattern: Option<TestPattern>,
    ) -> Result<Option<PatternScan>, DeviceError> {
        self.try_pattern(pattern).map_err(|e| self.fault(e))
    }

    fn take_notes(&mut self, notes: &mut Vec<String>) {
        notes.append(&mut self.notes);
    }

    /// Temperature of the board's sensor, in steps of 1/4096 °C (OpenEB 3.1.2, `gen31_monitoring.cpp`).
    fn temperature_c(&mut self) -> Result<Option<f64>, DeviceError> {
        let read = self.registers().get(TEMPERATURE);
        let steps = read.map_err(|e| self.fault(e))?;
        Ok(Some(f64::from(steps) / 4096.0))
    }
}

impl Drop for Evk1 {
    fn drop(&mut self) {
        // Errors cannot be returned here; `close` returns them.
        let _ = self.close_device();
    }
}
