//! A model of an EVK1 behind the transport: registers that store written values, and a stream that depends on them.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use skinrig_device::Clock;
use skinrig_evk1::inbox::Inbox;
use skinrig_evk1::registers::{self as r, Field, Register};
use skinrig_evk1::requests;
use skinrig_evk1::usb::Transport;
use skinrig_evk1::{Evk1, Evk1Config, Evk1Error, UsbError};
use skinrig_formats::evt2::Encoder;
use skinrig_model::{CameraId, CdEvent, HostDuration, HostTime, Polarity};

/// Approximate interval at which the FPGA closes packets.
const PACKET: HostDuration = HostDuration::from_micros(1024);

/// One action of the driver.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Step {
    Read(u32, u32),
    Write(u32, u32),
    Other(String),
}

/// Faults of the model.
#[derive(Debug, Clone, Default)]
pub struct Faults {
    /// Replies to requests other than register accesses.
    pub answers: BTreeMap<u8, u16>,
    /// Bits of registers that cannot be set.
    pub stuck_at_zero: BTreeMap<u32, u32>,
    /// Registers that reject writes: the request stalls.
    pub refused: Vec<u32>,
    /// Transfers never complete.
    pub stop_fails: bool,
    /// Status byte of register reads.
    pub read_status: Option<u8>,
    /// Registers of the sensor read as 0 with status 0 while it is unpowered.
    pub mute_without_power: bool,
    /// Resets on the bus fail.
    pub reset_fails: bool,
    /// Ends the stream; every later request fails, too, when the device is disconnected.
    pub error: Option<UsbError>,
}

pub struct Model {
    pub registers: BTreeMap<u32, u32>,
    pub steps: Vec<Step>,
    pub faults: Faults,
    /// The master's clock arrives on the sync line.
    pub sync_clock: bool,
    /// CD events per packet while the pixels are released.
    pub events_per_packet: u64,
    now: HostTime,
    inbox: Option<Arc<Inbox>>,
    encoder: Encoder,
    camera_us: u64,
    unsent: Duration,
    /// Bytes in the camera's buffers while it does not stream.
    pub left_over: usize,
    /// Sends its time base even while it does not stream: one word within the time limit of every read.
    pub never_silent: bool,
}

/// One camera model and its clock.
#[derive(Clone)]
pub struct Bench(Arc<Mutex<Model>>);

impl Bench {
    pub fn new() -> Self {
        let mut registers: BTreeMap<u32, u32> = r::all().map(|r| (r.address, r.default)).collect();
        registers.insert(r::SERIAL_MSB.address, 0x1621);
        Self(Arc::new(Mutex::new(Model {
            registers,
            steps: Vec::new(),
            faults: Faults::default(),
            sync_clock: false,
            events_per_packet: 20,
            now: HostTime::ZERO,
            inbox: None,
            encoder: Encoder::new(0),
            camera_us: 0,
            unsent: Duration::ZERO,
            left_over: 0,
            never_silent: false,
        })))
    }

    pub fn model(&self) -> MutexGuard<'_, Model> {
        self.0.lock().unwrap()
    }

    pub fn open(&self) -> Result<Evk1, Evk1Error> {
        self.open_with(Evk1Config::default())
    }

    pub fn open_with(&self, config: Evk1Config) -> Result<Evk1, Evk1Error> {
        let (usb, clock) = (Box::new(self.clone()), Box::new(self.clone()));
        Evk1::open(usb, CameraId::One, config, clock)
    }

    /// Advances the time.
    pub fn pass(&self, ms: i64) {
        let mut clock = self.clone();
        let end = clock.now() + HostDuration::from_millis(ms);
        clock.wait_until(end);
    }

    /// Actions since the last call, one line each. Reading, writing and reading back one register is one line.
    pub fn trace(&self) -> String {
        let steps = std::mem::take(&mut self.model().steps);
        let mut rest = steps.as_slice();
        let mut lines = Vec::new();
        while !rest.is_empty() {
            let (line, used) = match *rest {
                [
                    Step::Read(a, old),
                    Step::Write(b, new),
                    Step::Read(c, back),
                    ..,
                ] if a == b && b == c && new == back && reads_back(a) => {
                    (format!("{} {old:08x} -> {new:08x}", name(a)), 3)
                }
                [Step::Write(a, new), Step::Read(b, back), ..]
                    if a == b && new == back && reads_back(a) =>
                {
                    (format!("{} = {new:08x}", name(a)), 2)
                }
                [Step::Read(a, old), Step::Write(b, new), ..] if a == b => {
                    let text = format!("{} {old:08x} -> {new:08x}, not read back", name(a));
                    (text, 2)
                }
                [Step::Write(a, new), ..] => (format!("{} = {new:08x}, not read back", name(a)), 1),
                [Step::Read(a, found), ..] => (format!("{} is {found:08x}", name(a)), 1),
                [Step::Other(ref text), ..] => (text.clone(), 1),
                [] => break,
            };
            lines.push(line);
            rest = &rest[used..];
        }
        lines.join("\n")
    }

    /// The registers written since the last call of this or of [`Self::trace`], in order.
    pub fn writes(&self) -> Vec<(u32, u32)> {
        let steps = std::mem::take(&mut self.model().steps);
        let written = steps.into_iter().filter_map(|s| match s {
            Step::Write(a, v) => Some((a, v)),
            _ => None,
        });
        written.collect()
    }
}

fn reads_back(address: u32) -> bool {
    r::at(address).is_some_and(|r| r.stable != 0)
}

fn name(address: u32) -> String {
    let name = r::at(address).map_or("?", |r| r.name);
    format!("{address:04x} {name}")
}

impl Model {
    pub fn get(&self, field: Field) -> u32 {
        field.of(self.registers[&field.register.address])
    }

    pub fn word(&self, register: Register) -> u32 {
        self.registers[&register.address]
    }

    fn check(&self) -> Result<(), UsbError> {
        match &self.faults.error {
            Some(UsbError::Gone) => Err(UsbError::Gone),
            _ => Ok(()),
        }
    }

    fn other(&mut self, text: impl Into<String>) {
        self.steps.push(Step::Other(text.into()));
    }

    /// Sends bytes as one packet.
    pub fn send(&mut self, bytes: &[u8]) {
        let now = self.now;
        if let Some(inbox) = &self.inbox {
            inbox.push(bytes, now);
        }
    }

    /// Advances the time by one packet.
    fn packet(&mut self) {
        if let (Some(error), Some(inbox)) = (&self.faults.error, &self.inbox) {
            inbox.fail(error.clone());
            return;
        }
        if self.inbox.is_none() || self.get(r::STEREO_MERGE_ENABLE) == 0 {
            return;
        }
        let slave = self.get(r::MASTER_MODE) == 0 && self.get(r::USE_EXT_START) == 1;
        let stands = slave && !self.sync_clock;
        let from = self.camera_us;
        let to = from + PACKET.0.unsigned_abs() / 1000;
        let pixels = self.get(r::ROI_TD_RSTN) == 1 && self.get(r::NFL_EN) == 0;
        // The pattern replaces the output of sensor and filter.
        let live = pixels || self.get(r::PATTERN_ENABLE) == 1;
        let mut bytes = Vec::new();
        if stands {
            bytes.extend(0x8000_0000_u32.to_le_bytes());
        }
        for k in 0..if live { self.events_per_packet } else { 0 } {
            let (x, y) = ((k * 37 % 640) as u16, (k * 11 % 480) as u16);
            if stands {
                bytes.extend((u32::from(x) << 11 | u32::from(y)).to_le_bytes());
            } else {
                let t_us = from + k * (to - from) / self.events_per_packet;
                let polarity = Polarity::from_bit(k % 3 == 0);
                let event = CdEvent {
                    t_us,
                    x,
                    y,
                    polarity,
                };
                self.encoder.cd(event, &mut bytes).unwrap();
            }
        }
        if !stands {
            self.encoder.advance_to(to, &mut bytes).unwrap();
            self.camera_us = to;
        }
        self.send(&bytes);
    }
}

impl Clock for Bench {
    fn now(&self) -> HostTime {
        self.model().now
    }

    fn wait_until(&mut self, t: HostTime) {
        let mut model = self.model();
        let span = t - model.now;
        if span.0 > 0 && span.0 % 100_000_000 == 0 {
            let text = format!("wait {} ms", span.0 / 1_000_000);
            model.other(text);
        }
        let mut left = model.unsent + Duration::from_nanos(span.0.max(0).unsigned_abs());
        let packet = Duration::from_nanos(PACKET.0.unsigned_abs());
        while left >= packet {
            left -= packet;
            model.now = HostTime(t.0 - i64::try_from(left.as_nanos()).unwrap());
            model.packet();
        }
        model.unsent = left;
        model.now = model.now.max(t);
    }
}

impl Transport for Bench {
    fn control_in(
        &mut self,
        code: u8,
        value: u16,
        index: u16,
        answer: &mut [u8],
    ) -> Result<usize, UsbError> {
        let mut model = self.model();
        model.check()?;
        if code == requests::READ_REGISTER {
            let address = u32::from(value) | u32::from(index) << 16;
            let word = *model
                .registers
                .get(&address)
                .expect("a register of the map");
            model.steps.push(Step::Read(address, word));
            let sensor = (0x0200..0x0740).contains(&address);
            let mute = model.faults.mute_without_power && sensor && model.get(r::EN_VDDD) == 0;
            let status = match model.faults.read_status {
                Some(status) => status,
                None if mute => 0,
                None => requests::READ_OK,
            };
            let word = if mute { 0 } else { word };
            answer[..4].copy_from_slice(&[status, 0, 0, 0]);
            answer[4..].copy_from_slice(&word.to_be_bytes());
            return Ok(8);
        }
        let default = match code {
            requests::BOARD_VERSION => requests::BOARD_EVK1,
            requests::FPGA_BOOT_STATE => 1,
            requests::SYSTEM_ID => requests::SYSTEM_GEN31,
            requests::FX3_VERSION => {
                model.other("ask 79");
                answer.copy_from_slice(&[2, 3, 1, 0, 0, 0, 0, 0]);
                return Ok(8);
            }
            _ => return Err(UsbError::Stall),
        };
        let word = model.faults.answers.get(&code).copied().unwrap_or(default);
        model.other(format!("ask {code:02x} is {word:04x}"));
        answer.copy_from_slice(&[0, 0, word as u8, (word >> 8) as u8]);
        Ok(4)
    }

    fn control_out(
        &mut self,
        code: u8,
        value: u16,
        index: u16,
        data: &[u8],
    ) -> Result<(), UsbError> {
        let mut model = self.model();
        model.check()?;
        assert_eq!(
            code,
            requests::WRITE_REGISTER,
            "no other request may change anything"
        );
        let address = u32::from(value) | u32::from(index) << 16;
        let word = u32::from_be_bytes(data.try_into().expect("4 bytes"));
        if model.faults.refused.contains(&address) {
            return Err(UsbError::Stall);
        }
        model.steps.push(Step::Write(address, word));
        let stuck = model
            .faults
            .stuck_at_zero
            .get(&address)
            .copied()
            .unwrap_or(0);
        let old = model.registers.insert(address, word & !stuck);
        assert!(old.is_some(), "{address:#06x} is no register of the map");
        Ok(())
    }

    fn reset(&mut self) -> Result<(), UsbError> {
        self.model().other("reset on the bus");
        if self.model().faults.reset_fails {
            return Err(UsbError::Other("no reset".to_owned()));
        }
        self.model().check()
    }

    fn clear_halt(&mut self) -> Result<(), UsbError> {
        self.model().other("clear halt");
        self.model().check()
    }

    fn read_events(&mut self, buffer: &mut [u8], limit: Duration) -> Result<usize, UsbError> {
        let mut model = self.model();
        model.check()?;
        if model.never_silent {
            let waited = HostDuration(i64::try_from(limit.as_nanos()).unwrap());
            model.now += waited;
            // A reader that reads for a minute has no limit of its own; fail instead of hanging.
            let n = if model.now < HostTime(60_000_000_000) {
                4
            } else {
                0
            };
            return Ok(n);
        }
        let n = model.left_over.min(buffer.len());
        model.left_over -= n;
        model.other(format!("bulk read of {n}"));
        Ok(n)
    }

    fn start_stream(&mut self, inbox: Arc<Inbox>, config: &Evk1Config) -> Result<(), UsbError> {
        let mut model = self.model();
        model.other(format!("queue {} transfers", config.transfers));
        model.check()?;
        model.inbox = Some(inbox);
        Ok(())
    }

    fn stop_stream(&mut self) -> Result<(), UsbError> {
        let mut model = self.model();
        if model.inbox.take().is_some() {
            model.other("take transfers back");
        }
        if model.faults.stop_fails {
            return Err(UsbError::Stall);
        }
        Ok(())
    }

    fn place(&self) -> String {
        "model".to_owned()
    }
}
