//! A trigger box with arbitrary answers: on the line, in a frame, in a reply to a request.

use std::io;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use skinrig_device::{RealClock, TriggerBox as _};
use skinrig_model::{Mark, MarkKind, PressId};
use skinrig_trigger_box::frame::{self, FrameReader};
use skinrig_trigger_box::protocol::{Counters, Events, Hello, Reply, SelfTest, parse_mark};
use skinrig_trigger_box::{Connector, OpenError, SerialTriggerBox, TriggerBoxConfig, Wire};

/// Long enough for one thread to answer another, short enough for many cases.
const SOON: Duration = Duration::from_millis(2);

/// Processes the bytes as raw line data, as bodies of valid frames, and as answers to the driver's requests.
pub fn trigger_box(bytes: &[u8]) {
    let mut reader = FrameReader::default();
    for body in bytes.iter().filter_map(|b| reader.push(*b)) {
        exercise(&body);
    }
    for body in bytes.chunks(frame::MAX_BODY) {
        exercise(body);
        assert!(frame::encode(body).is_some());
    }
    drive(bytes);
}

fn exercise(body: &[u8]) {
    let answers = Reply::parse(body).map_or_else(|| body.to_vec(), |reply| reply.data);
    let _ = Hello::parse(&answers);
    let _ = Events::parse(&answers);
    let _ = Counters::parse(&answers);
    let _ = SelfTest::parse(&answers);
    let _ = parse_mark(&answers);
}

/// Opens a box on such a line and uses it.
fn drive(bytes: &[u8]) {
    let config = TriggerBoxConfig {
        exchange_interval: SOON,
        events_interval: SOON,
        reply_timeout: SOON,
        command_timeout: 2 * SOON,
        hello_timeout: SOON,
        ..TriggerBoxConfig::new("fuzz")
    };
    let script = Arc::new(Mutex::new(Script {
        left: bytes.to_vec(),
        line: Vec::new(),
        requests: FrameReader::default(),
        greeted: false,
    }));
    let dial = Line(script);
    let Ok(mut driver) = SerialTriggerBox::open_with(config, Box::new(dial), RealClock::start())
    else {
        return;
    };
    let mark = Mark {
        kind: MarkKind::Contact,
        press: PressId::from_index(1),
    };
    let _ = driver.arm();
    let _ = driver.send(mark);
    let _ = driver.counters();
    let _ = driver.set_sync(Some(u16::MAX));
    let _ = driver.poll(&mut Vec::new());
    let _ = driver.self_test();
    let _ = driver.take_notes();
    let _ = driver.disarm();
}

/// Remaining script, and data in flight.
struct Script {
    left: Vec<u8>,
    line: Vec<u8>,
    requests: FrameReader,
    greeted: bool,
}

impl Script {
    /// Takes the next bytes of the script; fewer at its end.
    fn take(&mut self, n: usize) -> Vec<u8> {
        self.left.drain(..n.min(self.left.len())).collect()
    }

    /// Replies to a request with its command and number, and the rest from the script. The first greeting is valid.
    fn answer(&mut self, request: &[u8]) {
        let [version, command, id @ ..] = request else {
            return;
        };
        let mut body = vec![*version, command | 0x80];
        body.extend(id.iter().take(2));
        if !self.greeted {
            self.greeted = true;
            // Outcome, flags, boot, ticks; then firmware, ticks per µs, no serial number, the name.
            body.extend([0; 12]);
            body.extend(GREETING);
        } else {
            let n = self.take(1).first().map_or(0, |n| usize::from(n % 100));
            let reply = self.take(n);
            body.extend(reply);
        }
        self.line.extend(frame::encode(&body).unwrap_or_default());
    }
}

/// Greeting of the firmware (`hil/trigger_box/protocol.h`).
const GREETING: &[u8] = b"\x01\x01\x00\x10\x00\x13skinrig-trigger-box";

struct Line(Arc<Mutex<Script>>);

impl Connector for Line {
    fn target(&self) -> &str {
        "fuzz"
    }

    fn connect(&mut self) -> Result<Box<dyn Wire>, OpenError> {
        Ok(Box::new(Self(Arc::clone(&self.0))))
    }
}

impl Wire for Line {
    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut script = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if script.left.is_empty() {
            return Err(io::ErrorKind::BrokenPipe.into());
        }
        for byte in bytes {
            if let Some(request) = script.requests.push(*byte) {
                script.answer(&request);
            }
        }
        Ok(())
    }

    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<usize> {
        let mut script = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let n = script.line.len().min(buffer.len());
        for (to, from) in buffer.iter_mut().zip(script.line.drain(..n)) {
            *to = from;
        }
        drop(script);
        if n == 0 {
            std::thread::park_timeout(patience.min(SOON));
        }
        Ok(n)
    }
}
