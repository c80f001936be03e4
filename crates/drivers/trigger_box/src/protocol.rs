//! Protocol between host and box. Mirrors `hil/trigger_box/protocol.h`; documented in `hil/trigger_box/README.md`.

use skinrig_model::pulse::{MAX_MARKED_PRESS, SYNC_CODE};
use skinrig_model::{BoxTime, Mark, MarkKind, PressId, PulseTrain};

/// Protocol version of this driver.
pub const PROTOCOL_VERSION: u8 = 2;
/// Firmware version for which this driver was written.
pub const FIRMWARE_VERSION: Firmware = Firmware {
    major: 1,
    minor: 1,
    patch: 1,
};
/// Device name in the handshake.
pub(crate) const BOX_NAME: &str = "skinrig-trigger-box";
/// Baud rate of the serial line: exact with the box's 16 MHz clock.
pub(crate) const BAUD_RATE: u32 = 250_000;
/// Resolution of the box's clock: ticks of 62.5 ns.
pub(crate) const TICKS_PER_US: u64 = 16;
/// Maximum length of a serial number, characters.
pub(crate) const MAX_SERIAL: usize = 16;
/// Minimum period of sync trains, ms: twice the duration of a train, so that marks fit in between.
pub(crate) const MIN_SYNC_PERIOD_MS: u16 = (2 * PulseTrain::DURATION_US).div_ceil(1_000) as u16;

const REPLY: u8 = 0x80;
const HELLO: u8 = 0x01;

/// A version of the firmware.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Firmware {
    /// Incompatible changes.
    pub major: u8,
    /// Compatible additions.
    pub minor: u8,
    /// Corrections.
    pub patch: u8,
}

impl std::fmt::Display for Firmware {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{}.{}", self.major, self.minor, self.patch)
    }
}

/// A request to the box.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Request {
    /// Handshake. Disarms the box, stops the sync trains, and restarts the numbering of marks.
    Hello,
    /// Enables pulses until disarmed, or until the host has been silent for this time (0: forever).
    Arm {
        /// ms.
        silence_ms: u16,
    },
    /// Disables pulses.
    Disarm,
    /// Sends the train of a mark. A repeated number is answered again without a second train.
    Mark {
        /// The previous mark's number plus one; 1 after [`Request::Hello`].
        number: u32,
        /// The mark to send.
        mark: Mark,
    },
    /// Sets up periodic sync trains.
    Sync {
        /// Period, ms; 0 stops them, otherwise at least `MIN_SYNC_PERIOD_MS`.
        period_ms: u16,
        /// Count of the first train.
        first: u32,
    },
    /// Drops events before this number and reads those from it on.
    Events {
        /// Number of the first requested event.
        from: u32,
    },
    /// Reads the counters.
    Status,
    /// Raises and lowers all outputs once and reads the pins.
    SelfTest,
    /// Reads the clock.
    Time,
    /// Stores a serial number.
    SetSerial(String),
}

impl Request {
    /// Name in messages.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Hello => "hello",
            Self::Arm { .. } => "arm",
            Self::Disarm => "disarm",
            Self::Mark { .. } => "mark",
            Self::Sync { .. } => "sync",
            Self::Events { .. } => "events",
            Self::Status => "status",
            Self::SelfTest => "self test",
            Self::Time => "time",
            Self::SetSerial(_) => "set serial",
        }
    }

    fn command(&self) -> u8 {
        match self {
            Self::Hello => HELLO,
            Self::Arm { .. } => 0x02,
            Self::Disarm => 0x03,
            Self::Mark { .. } => 0x04,
            Self::Sync { .. } => 0x05,
            Self::Events { .. } => 0x06,
            Self::Status => 0x07,
            Self::SelfTest => 0x08,
            Self::Time => 0x09,
            Self::SetSerial(_) => 0x0a,
        }
    }

    /// Encodes the body of the request's frame.
    #[must_use]
    pub fn encode(&self, id: u16) -> Vec<u8> {
        let mut body = vec![PROTOCOL_VERSION, self.command()];
        body.extend_from_slice(&id.to_le_bytes());
        match self {
            Self::Arm { silence_ms } => body.extend_from_slice(&silence_ms.to_le_bytes()),
            Self::Mark { number, mark } => {
                let data = (mark.kind.code() << 17) | mark.press.index();
                body.extend_from_slice(&number.to_le_bytes());
                body.extend_from_slice(&data.to_le_bytes());
            }
            Self::Sync { period_ms, first } => {
                body.extend_from_slice(&period_ms.to_le_bytes());
                body.extend_from_slice(&first.to_le_bytes());
            }
            Self::Events { from } => body.extend_from_slice(&from.to_le_bytes()),
            Self::SetSerial(serial) => body.extend_from_slice(serial.as_bytes()),
            Self::Hello | Self::Disarm | Self::Status | Self::SelfTest | Self::Time => {}
        }
        body
    }
}

/// A time of the box's clock, in ticks of 62.5 ns since its reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Ticks(pub u64);

impl Ticks {
    /// Converts to whole microseconds, rounded down.
    #[must_use]
    pub(crate) fn to_box_time(self) -> BoxTime {
        BoxTime {
            us: self.0 / TICKS_PER_US,
        }
    }
}

/// Result of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Executed.
    Done,
    /// Unknown command.
    UnknownCommand,
    /// Invalid argument.
    BadArgument,
    /// Not allowed while disarmed.
    NotArmed,
    /// Not allowed during a train.
    Busy,
    /// The mark's number is neither the previous one nor the next.
    OutOfOrder,
    /// The box has another protocol version.
    BadVersion,
    /// Not allowed while armed.
    Armed,
    /// A code unknown to this driver.
    Unknown(u8),
}

impl From<u8> for Outcome {
    fn from(code: u8) -> Self {
        match code {
            0 => Self::Done,
            1 => Self::UnknownCommand,
            2 => Self::BadArgument,
            3 => Self::NotArmed,
            4 => Self::Busy,
            5 => Self::OutOfOrder,
            6 => Self::BadVersion,
            7 => Self::Armed,
            other => Self::Unknown(other),
        }
    }
}

/// State flags in every reply.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Flags(pub u8);

impl Flags {
    /// Whether pulses are enabled.
    #[must_use]
    pub fn armed(self) -> bool {
        self.0 & 1 != 0
    }
    /// Whether sync trains are enabled.
    #[must_use]
    pub fn syncing(self) -> bool {
        self.0 & 2 != 0
    }
    /// Whether a train is being sent.
    #[must_use]
    pub fn train(self) -> bool {
        self.0 & 4 != 0
    }
    /// Whether the box disarmed itself because the host was silent.
    #[must_use]
    pub fn disarmed_by_silence(self) -> bool {
        self.0 & 8 != 0
    }
}

/// A reply of the box.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reply {
    /// Protocol version of the box.
    pub version: u8,
    /// Command of the request.
    pub command: u8,
    /// Number of the request.
    pub id: u16,
    /// Result.
    pub outcome: Outcome,
    /// State of the box.
    pub flags: Flags,
    /// Number of resets of the box, modulo 2^16.
    pub boot: u16,
    /// Box time when the request was executed.
    pub at: Ticks,
    /// Result data of the command.
    pub data: Vec<u8>,
}

/// Reads little-endian numbers from a slice.
struct Cursor<'a>(&'a [u8]);

impl Cursor<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*first)
    }
    fn u8(&mut self) -> Option<u8> {
        self.take::<1>().map(|[b]| b)
    }
    fn u16(&mut self) -> Option<u16> {
        self.take().map(u16::from_le_bytes)
    }
    fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }
    fn u64(&mut self) -> Option<u64> {
        self.take().map(u64::from_le_bytes)
    }
    /// A length-prefixed string.
    fn text(&mut self) -> Option<String> {
        let n = usize::from(self.u8()?);
        let bytes = self.0.get(..n)?;
        self.0 = &self.0[n..];
        String::from_utf8(bytes.to_vec()).ok()
    }
    fn end(&self) -> Option<()> {
        self.0.is_empty().then_some(())
    }
}

impl Reply {
    /// Parses the body of a frame; `None` if it is not a reply.
    #[must_use]
    pub fn parse(body: &[u8]) -> Option<Self> {
        let mut c = Cursor(body);
        let version = c.u8()?;
        let command = c.u8()?;
        if command & REPLY == 0 {
            return None;
        }
        Some(Self {
            version,
            command: command & !REPLY,
            id: c.u16()?,
            outcome: c.u8()?.into(),
            flags: Flags(c.u8()?),
            boot: c.u16()?,
            at: Ticks(c.u64()?),
            data: c.0.to_vec(),
        })
    }

    /// Whether this is the reply to `request` with number `id`.
    #[must_use]
    pub(crate) fn is_reply_to(&self, request: &Request, id: u16) -> bool {
        self.command == request.command()
            && self.id == id
            && (self.version == PROTOCOL_VERSION || self.command == HELLO)
    }
}

/// Identity of the box.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Hello {
    /// Firmware version.
    pub firmware: Firmware,
    /// Clock ticks per microsecond.
    pub ticks_per_us: u8,
    /// Serial number; empty if never set.
    pub serial: String,
    /// Device name; `BOX_NAME` for a trigger box.
    pub name: String,
}

impl Hello {
    /// Parses the data of a reply to [`Request::Hello`].
    #[must_use]
    pub fn parse(data: &[u8]) -> Option<Self> {
        let mut c = Cursor(data);
        Some(Self {
            firmware: Firmware {
                major: c.u8()?,
                minor: c.u8()?,
                patch: c.u8()?,
            },
            ticks_per_us: c.u8()?,
            serial: c.text()?,
            name: c.text()?,
        })
    }
}

/// Parses the data of a reply to [`Request::Mark`]: rise of the start pulse, which may be after the reply.
#[must_use]
pub fn parse_mark(data: &[u8]) -> Option<Ticks> {
    let mut c = Cursor(data);
    let start = Ticks(c.u64()?);
    c.end()?;
    Some(start)
}

/// Kind of an event at the box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EventKind {
    /// The train of this mark started.
    Mark(Mark),
    /// The sync train with this count started.
    Sync(u32),
    /// An edge of the input.
    Input {
        /// Whether it is a rising edge.
        rising: bool,
    },
}

/// An event with its time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Event {
    /// Kind.
    pub kind: EventKind,
    /// Time.
    pub at: Ticks,
}

/// Data of a reply to [`Request::Events`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Events {
    /// Events dropped since the reset because the box's memory was full.
    pub dropped: u16,
    /// Number of the next event.
    pub next: u32,
    /// Number of the first event in `events`.
    pub first: u32,
    /// The oldest stored events in order, possibly not all of them.
    pub events: Vec<Event>,
}

impl Events {
    /// Parses reply data; `None` also for an unknown kind of event.
    #[must_use]
    pub fn parse(data: &[u8]) -> Option<Self> {
        let mut c = Cursor(data);
        let (dropped, next, first, n) = (c.u16()?, c.u32()?, c.u32()?, c.u8()?);
        let mut events = Vec::with_capacity(usize::from(n));
        for _ in 0..n {
            let word = c.u32()?;
            let at = Ticks(c.u64()?);
            let code = word & 0x00ff_ffff;
            let kind = match word >> 24 {
                1 => EventKind::Mark(Mark {
                    kind: MarkKind::from_code(code >> 17)?,
                    press: PressId::from_index(code & MAX_MARKED_PRESS),
                }),
                2 if code >> 17 == SYNC_CODE => EventKind::Sync(code & MAX_MARKED_PRESS),
                3 => EventKind::Input { rising: false },
                4 => EventKind::Input { rising: true },
                _ => return None,
            };
            events.push(Event { kind, at });
        }
        c.end()?;
        Some(Self {
            dropped,
            next,
            first,
            events,
        })
    }
}

/// Cause of the last reset: the processor's register MCUSR (ATmega328P data sheet DS40002061B, section 11.9.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ResetCause(pub u8);

impl std::fmt::Display for ResetCause {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let names = [
            (1, "power on"),
            (2, "reset button or opening of the port"),
            (4, "brown-out"),
            (8, "watchdog"),
        ];
        let causes: Vec<&str> = names
            .iter()
            .filter(|(bit, _)| self.0 & bit != 0)
            .map(|(_, name)| *name)
            .collect();
        if causes.is_empty() {
            f.write_str("unknown (the boot loader cleared it)")
        } else {
            f.write_str(&causes.join(", "))
        }
    }
}

/// Counters since the reset. The 16-bit counters saturate at 65,535.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counters {
    /// Cause of the reset.
    pub reset_cause: ResetCause,
    /// Mark trains started.
    pub marks: u32,
    /// Sync trains started.
    pub syncs: u32,
    /// Time-stamped input edges.
    pub input_edges: u32,
    /// Train edges that were late.
    pub late_edges: u16,
    /// Input pulses too short for a time stamp.
    pub input_glitches: u16,
    /// Events dropped because the memory was full.
    pub dropped_events: u16,
    /// Frames with a wrong checksum.
    pub bad_checksums: u16,
    /// Malformed frames.
    pub bad_frames: u16,
    /// Bytes lost by receiver overruns.
    pub overruns: u16,
    /// Input edges ignored because their share of the memory was full.
    pub ignored_edges: u16,
    /// Times the input changed so often that it was ignored for the rest of a clock turn, at most 4 ms.
    pub input_mutes: u16,
}

impl Counters {
    /// Parses the data of a reply to [`Request::Status`].
    #[must_use]
    pub fn parse(data: &[u8]) -> Option<Self> {
        let mut c = Cursor(data);
        let counters = Self {
            reset_cause: ResetCause(c.u8()?),
            marks: c.u32()?,
            syncs: c.u32()?,
            input_edges: c.u32()?,
            late_edges: c.u16()?,
            input_glitches: c.u16()?,
            dropped_events: c.u16()?,
            bad_checksums: c.u16()?,
            bad_frames: c.u16()?,
            overruns: c.u16()?,
            ignored_edges: c.u16()?,
            input_mutes: c.u16()?,
        };
        c.end()?;
        Some(counters)
    }
}

/// Result of the self-test of the outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SelfTest {
    /// All outputs rose.
    pub rose: bool,
    /// All outputs fell.
    pub fell: bool,
    /// The input followed, so the spare output is wired to it.
    pub input_followed: bool,
}

impl SelfTest {
    /// Parses the data of a reply to [`Request::SelfTest`].
    #[must_use]
    pub fn parse(data: &[u8]) -> Option<Self> {
        let mut c = Cursor(data);
        let flags = c.u8()?;
        c.end()?;
        Some(Self {
            rose: flags & 1 != 0,
            fell: flags & 2 != 0,
            input_followed: flags & 4 != 0,
        })
    }
}

/// The code of sync trains lies above those of marks, so that they are never confused.
const _: () = assert!(SYNC_CODE > 5);

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn parsers_never_panic(body in prop::collection::vec(any::<u8>(), 0..120)) {
            if let Some(reply) = Reply::parse(&body) {
                let a = &reply.data;
                let _ = (Hello::parse(a), Events::parse(a), Counters::parse(a), SelfTest::parse(a), parse_mark(a));
            }
            let _ = (Hello::parse(&body), Events::parse(&body), Counters::parse(&body));
        }

        #[test]
        fn requests_contain_their_number_and_fit_a_frame(id in any::<u16>(), number in any::<u32>(), press in 0..=MAX_MARKED_PRESS) {
            let mark = Mark { kind: MarkKind::Release, press: PressId::from_index(press) };
            let body = Request::Mark { number, mark }.encode(id);
            prop_assert_eq!(&body[..2], &[PROTOCOL_VERSION, 4]);
            prop_assert_eq!(u16::from_le_bytes([body[2], body[3]]), id);
            prop_assert_eq!(u32::from_le_bytes([body[4], body[5], body[6], body[7]]), number);
            let payload = u32::from_le_bytes([body[8], body[9], body[10], body[11]]);
            prop_assert_eq!((payload >> 17, payload & MAX_MARKED_PRESS), (5, press));
            prop_assert!(crate::frame::encode(&body).is_some());
        }
    }

    #[test]
    fn driver_and_firmware_have_the_same_constants() {
        let header = include_str!("../../../../hil/trigger_box/protocol.h");
        let value = |name: &str| {
            let line = header
                .lines()
                .find(|l| l.starts_with(&format!("#define {name} ")));
            line.unwrap().rsplit(' ').next().unwrap().to_owned()
        };
        assert_eq!(value("PROTOCOL_VERSION"), PROTOCOL_VERSION.to_string());
        assert_eq!(value("FIRMWARE_MAJOR"), FIRMWARE_VERSION.major.to_string());
        assert_eq!(value("FIRMWARE_MINOR"), FIRMWARE_VERSION.minor.to_string());
        assert_eq!(value("FIRMWARE_PATCH"), FIRMWARE_VERSION.patch.to_string());
        assert_eq!(value("BAUD_RATE"), format!("{BAUD_RATE}UL"));
        assert_eq!(value("SERIAL_MAX"), MAX_SERIAL.to_string());
        assert_eq!(
            value("MAX_BODY"),
            crate::frame::MAX_BODY.to_string(),
            "the longest body"
        );
    }
}
