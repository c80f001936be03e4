//! Error handling of the driver, with a scripted box behind the byte stream.
#![expect(clippy::unwrap_used, reason = "tests")]

use std::io;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use skinrig_device::{DeviceError, RealClock, TriggerBox};
use skinrig_model::{BoxReport, Mark, MarkKind, PressId};
use skinrig_trigger_box::frame::{self, FrameReader};
use skinrig_trigger_box::{Connector, OpenError, SerialTriggerBox, TriggerBoxConfig, Wire};

const TIMEOUT: Duration = Duration::from_secs(60);
const HELLO: u8 = 1;
const ARM: u8 = 2;
const DISARM: u8 = 3;
const MARK: u8 = 4;
const SYNC: u8 = 5;
const EVENTS: u8 = 6;

/// A scripted box.
struct Script {
    // identity
    firmware: [u8; 3],
    protocol: u8,
    name: &'static str,
    boot: u16,
    // behaviour
    armed: bool,
    arms: u32,
    last_mark: u32,
    trains: Vec<u32>,
    /// First counts in the sync requests received.
    firsts: Vec<u32>,
    dropped: u16,
    // faults
    /// Drops this many requests of this command.
    deaf_to: Option<(u8, u32)>,
    /// Executes this many requests of this command but loses the reply.
    mute_after: Option<(u8, u32)>,
    /// Sends each reply twice, as after a request that was repeated too early.
    doubled: bool,
    /// Delay of each reply.
    slow: Duration,
    ready: Instant,
    /// Resets when it receives a mark.
    reset_at_mark: bool,
    always_busy: bool,
    silent_disarm: bool,
    strange_event: bool,
    broken: bool,
    /// Number of connection attempts that fail.
    absent: u32,
    began: Instant,
    to_host: Vec<u8>,
    reader: FrameReader,
}

impl Default for Script {
    fn default() -> Self {
        Self {
            firmware: [1, 1, 1],
            protocol: 2,
            name: "skinrig-trigger-box",
            boot: 7,
            armed: false,
            arms: 0,
            last_mark: 0,
            trains: Vec::new(),
            firsts: Vec::new(),
            dropped: 0,
            deaf_to: None,
            mute_after: None,
            doubled: false,
            slow: Duration::ZERO,
            ready: Instant::now(),
            reset_at_mark: false,
            always_busy: false,
            silent_disarm: false,
            strange_event: false,
            broken: false,
            absent: 0,
            began: Instant::now(),
            to_host: Vec::new(),
            reader: FrameReader::default(),
        }
    }
}

/// Counts a fault down; returns whether it applies.
fn take_fault(fault: &mut Option<(u8, u32)>, command: u8) -> bool {
    match fault {
        Some((which, left)) if *which == command && *left > 0 => {
            *left -= 1;
            true
        }
        _ => false,
    }
}

impl Script {
    fn reset(&mut self) {
        self.boot = self.boot.wrapping_add(1);
        self.began = Instant::now();
        (self.armed, self.last_mark, self.dropped) = (false, 0, 0);
    }

    fn take(&mut self, body: &[u8]) {
        let (command, arguments) = (body[1], &body[4..]);
        if take_fault(&mut self.deaf_to, command) {
            return;
        }
        let number = |at: usize| u32::from_le_bytes(arguments[at..at + 4].try_into().unwrap());
        let ticks = self.began.elapsed().as_nanos() as u64 * 16 / 1_000;
        let mut result = 0;
        let mut answers = Vec::new();
        match command {
            HELLO => {
                (self.armed, self.last_mark, self.silent_disarm) = (false, 0, false);
                answers.extend(self.firmware);
                answers.extend([16, 2, b'S', b'1', self.name.len() as u8]);
                answers.extend(self.name.bytes());
            }
            ARM => {
                (self.armed, self.silent_disarm) = (true, false);
                self.arms += 1;
            }
            DISARM => self.armed = false,
            SYNC => self.firsts.push(number(2)),
            MARK if self.reset_at_mark => {
                self.reset_at_mark = false;
                self.reset();
                result = 5;
            }
            MARK if number(0) == self.last_mark => answers.extend(ticks.to_le_bytes()),
            MARK if number(0) != self.last_mark + 1 => result = 5,
            MARK if !self.armed => result = 3,
            MARK if self.always_busy => result = 4,
            MARK => {
                self.last_mark += 1;
                self.trains.push(number(4));
                answers.extend(ticks.to_le_bytes());
            }
            EVENTS => {
                answers.extend(self.dropped.to_le_bytes());
                let kind = if self.strange_event { 99 } else { 4 };
                let n = u8::from(self.strange_event);
                answers.extend(u32::from(n).to_le_bytes());
                answers.extend([0, 0, 0, 0, n]);
                if self.strange_event {
                    answers.extend([0, 0, 0, kind]);
                    answers.extend(ticks.to_le_bytes());
                }
            }
            _ => {}
        }
        if take_fault(&mut self.mute_after, command) {
            return;
        }
        let flags = u8::from(self.armed) | u8::from(self.silent_disarm) << 3;
        let mut reply = vec![
            self.protocol,
            command | 0x80,
            body[2],
            body[3],
            result,
            flags,
        ];
        reply.extend(self.boot.to_le_bytes());
        reply.extend(ticks.to_le_bytes());
        reply.extend(answers);
        if self.to_host.is_empty() {
            self.ready = Instant::now() + self.slow;
        }
        let frame = frame::encode(&reply).unwrap();
        self.to_host.extend(&frame);
        if self.doubled {
            self.to_host.extend(&frame);
        }
    }
}

#[derive(Clone)]
struct Line(Arc<Mutex<Script>>);

impl Line {
    fn script(&self) -> MutexGuard<'_, Script> {
        self.0.lock().unwrap()
    }
}

impl Wire for Line {
    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut script = self.script();
        if script.broken {
            return Err(io::ErrorKind::BrokenPipe.into());
        }
        for &byte in bytes {
            if let Some(body) = script.reader.push(byte) {
                script.take(&body);
            }
        }
        Ok(())
    }

    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        let end = Instant::now() + timeout;
        loop {
            let mut script = self.script();
            if script.broken {
                return Err(io::ErrorKind::BrokenPipe.into());
            }
            let there = if Instant::now() < script.ready {
                0
            } else {
                script.to_host.len()
            };
            let n = there.min(buffer.len());
            if n > 0 || Instant::now() >= end {
                buffer[..n].copy_from_slice(&script.to_host[..n]);
                script.to_host.drain(..n);
                return Ok(n);
            }
            drop(script);
            std::thread::yield_now();
        }
    }
}

impl Connector for Line {
    fn target(&self) -> &str {
        "/dev/script"
    }

    fn connect(&mut self) -> Result<Box<dyn Wire>, OpenError> {
        let mut script = self.script();
        if script.absent > 0 {
            script.absent -= 1;
            return Err(OpenError::Absent("/dev/script".to_owned()));
        }
        script.broken = false;
        drop(script);
        Ok(Box::new(self.clone()))
    }
}

fn config() -> TriggerBoxConfig {
    TriggerBoxConfig {
        reply_timeout: Duration::from_millis(5),
        command_timeout: TIMEOUT,
        hello_timeout: TIMEOUT,
        events_interval: Duration::from_millis(5),
        exchange_interval: Duration::from_millis(5),
        ..TriggerBoxConfig::new("/dev/script")
    }
}

fn try_open(
    script: Script,
    config: TriggerBoxConfig,
) -> (Line, Result<SerialTriggerBox, DeviceError>) {
    let line = Line(Arc::new(Mutex::new(script)));
    let device = SerialTriggerBox::open_with(config, Box::new(line.clone()), RealClock::start());
    (line, device)
}

fn open() -> (Line, SerialTriggerBox) {
    let (line, device) = try_open(Script::default(), config());
    let mut device = device.unwrap();
    device.arm().unwrap();
    (line, device)
}

fn mark(press: u32) -> Mark {
    Mark {
        kind: MarkKind::Contact,
        press: PressId::from_index(press),
    }
}

fn payload(press: u32) -> u32 {
    2 << 17 | press
}

/// Polls until an error other than `Lost`.
fn next_fault(device: &mut SerialTriggerBox) -> DeviceError {
    let end = Instant::now() + TIMEOUT;
    loop {
        match device.poll(&mut Vec::new()) {
            Ok(()) => assert!(Instant::now() < end, "no fault was reported"),
            Err(fault) => return fault,
        }
        std::thread::yield_now();
    }
}

fn poll_until_well(device: &mut SerialTriggerBox) -> Vec<BoxReport> {
    let end = Instant::now() + TIMEOUT;
    let mut reports = Vec::new();
    while device.poll(&mut reports).is_err() {
        assert!(Instant::now() < end, "it did not recover");
        std::thread::yield_now();
    }
    reports
}

fn resets(reports: &[BoxReport]) -> usize {
    let only = reports
        .iter()
        .filter(|r| matches!(r, BoxReport::Reset { .. }));
    only.count()
}

#[test]
fn another_firmware_is_rejected_with_the_flash_command() {
    let old = Script {
        firmware: [0, 9, 2],
        ..Script::default()
    };
    let other_protocol = Script {
        protocol: 9,
        ..Script::default()
    };
    for (script, found) in [(old, "firmware 0.9.2"), (other_protocol, "protocol 9")] {
        let text = try_open(script, config()).1.err().unwrap().to_string();
        assert!(text.contains(found), "{text}");
        assert!(
            text.contains("make -C hil/trigger_box flash PORT=/dev/script"),
            "{text}"
        );
    }
}

#[test]
fn an_impossible_drift_is_rejected() {
    for max_drift_ppm in [-1.0, 1e6, f64::NAN] {
        let bad = TriggerBoxConfig {
            max_drift_ppm,
            ..config()
        };
        let refused = try_open(Script::default(), bad).1.err().unwrap();
        assert!(matches!(refused, DeviceError::Refused { .. }), "{refused}");
    }
}

#[test]
fn other_devices_and_silence_are_distinguished() {
    let stranger = Script {
        name: "toaster",
        ..Script::default()
    };
    let refused = try_open(stranger, config()).1.err().unwrap();
    assert!(refused.to_string().contains("found toaster"), "{refused}");
    let dead = Script {
        deaf_to: Some((HELLO, u32::MAX)),
        ..Script::default()
    };
    let short = TriggerBoxConfig {
        hello_timeout: Duration::from_millis(1),
        ..config()
    };
    let lost = try_open(dead, short).1.err().unwrap();
    assert!(matches!(lost, DeviceError::Lost { .. }), "{lost}");
    let absent = Script {
        absent: 1,
        ..Script::default()
    };
    let lost = try_open(absent, config()).1.err().unwrap();
    assert!(lost.to_string().contains("connect the box"), "{lost}");
}

#[test]
fn a_lost_request_and_a_lost_reply_both_end_in_one_train() {
    let (line, mut device) = open();
    line.script().deaf_to = Some((MARK, 3));
    device.send(mark(1)).unwrap();
    line.script().mute_after = Some((MARK, 3));
    device.send(mark(2)).unwrap();
    device.send(mark(3)).unwrap();
    assert_eq!(line.script().trains, [payload(1), payload(2), payload(3)]);
}

#[test]
fn a_slow_box_is_not_lost() {
    let (line, mut device) = open();
    // Ten times the time limit of one try.
    line.script().slow = Duration::from_millis(50);
    device.send(mark(1)).unwrap();
    let end = Instant::now() + TIMEOUT;
    let mut reports = Vec::new();
    while reports.len() < 3 {
        device.poll(&mut reports).unwrap();
        assert!(Instant::now() < end, "no time exchange succeeded");
        std::thread::yield_now();
    }
    device.send(mark(2)).unwrap();
    assert_eq!(line.script().trains, [payload(1), payload(2)]);
}

#[test]
fn duplicate_replies_are_ignored() {
    let (line, mut device) = open();
    line.script().doubled = true;
    let mut reports = Vec::new();
    for press in 1..=5 {
        device.send(mark(press)).unwrap();
        device.counters().unwrap_err(); // the script has none
        device.poll(&mut reports).unwrap();
    }
    assert_eq!(
        line.script().trains,
        (1..=5).map(payload).collect::<Vec<_>>()
    );
}

#[test]
fn a_mark_without_a_reply_is_lost_and_not_confused_with_the_next_one() {
    for carried_out in [false, true] {
        let (line, device) = try_open(
            Script::default(),
            TriggerBoxConfig {
                command_timeout: Duration::from_secs(1),
                ..config()
            },
        );
        let mut device = device.unwrap();
        device.arm().unwrap();
        let fault = Some((MARK, u32::MAX));
        if carried_out {
            line.script().mute_after = fault;
        } else {
            line.script().deaf_to = fault;
        }
        let lost = device.send(mark(1)).unwrap_err();
        assert!(lost.to_string().contains("no reply to `mark`"), "{lost}");
        (line.script().mute_after, line.script().deaf_to) = (None, None);
        poll_until_well(&mut device);
        device.send(mark(2)).unwrap();
        let expected: &[u32] = if carried_out {
            &[payload(1), payload(2)]
        } else {
            &[payload(2)]
        };
        assert_eq!(line.script().trains, expected);
    }
}

#[test]
fn a_reset_during_a_mark_is_reported_and_recovered() {
    let (line, mut device) = open();
    line.script().reset_at_mark = true;
    let lost = device.send(mark(1)).unwrap_err();
    assert!(lost.to_string().contains("may or may not"), "{lost}");
    let reports = poll_until_well(&mut device);
    assert_eq!(resets(&reports), 1, "{reports:?}");
    device.send(mark(2)).unwrap();
    assert_eq!(line.script().trains, [payload(2)]);
}

#[test]
fn a_broken_line_is_reconnected() {
    let (line, mut device) = open();
    {
        let mut script = line.script();
        (script.broken, script.absent) = (true, u32::MAX);
    }
    let lost = device.send(mark(1)).unwrap_err();
    assert!(matches!(lost, DeviceError::Lost { .. }), "{lost}");
    line.script().absent = 3;
    let reports = poll_until_well(&mut device);
    // The box kept its power, so its clock continues.
    assert_eq!(resets(&reports), 0, "{reports:?}");
    device.send(mark(2)).unwrap();
    assert_eq!(line.script().trains, [payload(2)]);
    assert_eq!(line.script().absent, 0);
}

#[test]
fn busy_and_disarmed_are_states() {
    let (line, mut device) = open();
    line.script().always_busy = true;
    let busy = device.send(mark(1)).unwrap_err();
    assert!(busy.to_string().contains("busy with a train"), "{busy}");
    line.script().always_busy = false;
    device.disarm().unwrap();
    let disarmed = device.send(mark(1)).unwrap_err();
    assert!(matches!(disarmed, DeviceError::State { .. }), "{disarmed}");
    let too_large = device.send(mark(1 << 17)).unwrap_err();
    assert!(
        matches!(too_large, DeviceError::Refused { .. }),
        "{too_large}"
    );
    assert!(matches!(
        device.set_sync(Some(27)),
        Err(DeviceError::Refused { .. })
    ));
    assert_eq!(line.script().trains, []);
}

#[test]
fn each_fault_of_the_box_is_reported_once() {
    let (line, mut device) = open();
    {
        let mut script = line.script();
        (script.armed, script.silent_disarm) = (false, true);
    }
    let fault = next_fault(&mut device);
    assert!(fault.to_string().contains("without a request"), "{fault}");
    assert_eq!(line.script().arms, 2, "rearmed");
    poll_until_well(&mut device);
    line.script().dropped = 12;
    let fault = next_fault(&mut device);
    assert!(fault.to_string().contains("12 dropped events"), "{fault}");
    poll_until_well(&mut device);
    line.script().strange_event = true;
    let fault = next_fault(&mut device);
    assert!(fault.to_string().contains("expected events"), "{fault}");
}

#[test]
fn sync_counts_are_never_reused_after_a_reset_or_reconnection() {
    let (line, mut device) = open();
    line.script().firsts.clear();
    device.set_sync(Some(28)).unwrap();
    {
        let mut script = line.script();
        (script.armed, script.silent_disarm) = (false, true);
    }
    next_fault(&mut device);
    line.script().reset_at_mark = true;
    device.send(mark(1)).unwrap_err();
    poll_until_well(&mut device);
    {
        let mut script = line.script();
        (script.broken, script.absent) = (true, u32::MAX);
    }
    device.send(mark(2)).unwrap_err();
    line.script().absent = 0;
    poll_until_well(&mut device);
    device.arm().unwrap();
    // During a silence of 5 s the box sends 178 trains that the host may never learn about.
    let firsts: Vec<u32> = (0..5).map(|k| k * (178 + 64)).collect();
    let mut script = line.script();
    script.firsts.dedup(); // a request may be repeated
    assert_eq!(script.firsts, firsts);
}

#[test]
fn dropping_the_driver_disarms_the_box() {
    let (line, device) = open();
    assert!(line.script().armed);
    drop(device);
    assert!(!line.script().armed);
}
