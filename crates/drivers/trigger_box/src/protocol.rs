//! What host and box say to each other. Twin of `hil/trigger_box/protocol.h`; the table is in `hil/trigger_box/README.md`.

use skinrig_model::pulse::{MAX_MARKED_PRESS, SYNC_CODE};
use skinrig_model::{BoxTime, Mark, MarkKind, PressId, PulseTrain};

/// The version of the protocol that this driver speaks.
pub const PROTOCOL_VERSION: u8 = 2;
/// The firmware that this driver was written for.
pub const FIRMWARE_VERSION: Firmware = Firmware {
    major: 1,
    minor: 1,
    patch: 1,
};
/// How a box names itself.
pub(crate) const BOX_NAME: &str = "skinrig-trigger-box";
/// Speed of the serial line, bit/s: exact with the box's 16 MHz.
pub(crate) const BAUD_RATE: u32 = 250_000;
/// The box's clock: ticks of 62.5 ns.
pub(crate) const TICKS_PER_US: u64 = 16;
/// The longest serial number, characters.
pub(crate) const MAX_SERIAL: usize = 16;
/// The shortest period of sync trains, ms: twice a train, so that marks find room between them.
pub(crate) const MIN_SYNC_PERIOD_MS: u16 = (2 * PulseTrain::DURATION_US).div_ceil(1_000) as u16;

const REPLY: u8 = 0x80;
const HELLO: u8 = 0x01;

/// A version of the firmware.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Firmware {
    /// Changes of meaning.
    pub major: u8,
    /// Additions.
    pub minor: u8,
    /// Repairs.
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
    /// Who are you? Disarms, ends the sync trains, and begins the numbers of marks anew.
    Hello,
    /// Allow pulses, until disarmed or until nothing was heard from the host for so long (0: for ever).
    Arm {
        /// ms.
        silence_ms: u16,
    },
    /// Forbid pulses.
    Disarm,
    /// Send the train of a mark. A number that was answered already is answered again, without a second train.
    Mark {
        /// One more than the last mark's, beginning with 1 after [`Request::Hello`].
        number: u32,
        /// Which mark.
        mark: Mark,
    },
    /// Send sync trains by itself.
    Sync {
        /// ms; 0 ends them, else at least `MIN_SYNC_PERIOD_MS`.
        period_ms: u16,
        /// The count that the next train carries.
        first: u32,
    },
    /// Forget the events before this number and tell those after it.
    Events {
        /// Number of the first event that is still wanted.
        from: u32,
    },
    /// Tell the counters.
    Status,
    /// Raise and lower all outputs once and look at the pins.
    SelfTest,
    /// Tell the clock.
    Time,
    /// Keep this serial number.
    SetSerial(String),
}

impl Request {
    /// What to call it in messages.
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

    /// The body of the request's frame.
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

/// An instant of the box's clock, in ticks of 62.5 ns since its reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Ticks(pub u64);

impl Ticks {
    /// The whole microseconds of it.
    #[must_use]
    pub(crate) fn to_box_time(self) -> BoxTime {
        BoxTime {
            us: self.0 / TICKS_PER_US,
        }
    }
}

/// How the box took a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Carried out.
    Done,
    /// It does not know the command.
    UnknownCommand,
    /// It does not accept the arguments.
    BadArgument,
    /// Not while it is disarmed.
    NotArmed,
    /// Not while a train is under way.
    Busy,
    /// Neither the last mark again nor the next.
    OutOfOrder,
    /// It speaks another version of the protocol.
    BadVersion,
    /// Not while it is armed.
    Armed,
    /// A code that this driver does not know.
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

/// The state that comes with every reply.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Flags(pub u8);

impl Flags {
    /// Pulses are allowed.
    #[must_use]
    pub fn armed(self) -> bool {
        self.0 & 1 != 0
    }
    /// Sync trains are being sent.
    #[must_use]
    pub fn syncing(self) -> bool {
        self.0 & 2 != 0
    }
    /// A train is under way.
    #[must_use]
    pub fn train(self) -> bool {
        self.0 & 4 != 0
    }
    /// It disarmed itself because the host was silent.
    #[must_use]
    pub fn disarmed_by_silence(self) -> bool {
        self.0 & 8 != 0
    }
    /// The input's level.
    #[must_use]
    pub fn input_high(self) -> bool {
        self.0 & 16 != 0
    }
}

/// A reply of the box.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reply {
    /// The protocol that the box speaks.
    pub version: u8,
    /// The command that it answers.
    pub command: u8,
    /// The request that it answers.
    pub id: u16,
    /// How it went.
    pub outcome: Outcome,
    /// The state of the box.
    pub flags: Flags,
    /// How often the box was reset in its life, modulo 2^16.
    pub boot: u16,
    /// The box's clock when it took the request.
    pub at: Ticks,
    /// What the command asked for.
    pub answers: Vec<u8>,
}

/// Takes little-endian numbers from the front of some bytes.
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
    /// A text with its length in front.
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
    /// Reads the body of a frame; `None` when it is no reply.
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
            answers: c.0.to_vec(),
        })
    }

    /// Does it answer this request with this number?
    #[must_use]
    pub fn answers(&self, request: &Request, id: u16) -> bool {
        self.command == request.command()
            && self.id == id
            && (self.version == PROTOCOL_VERSION || self.command == HELLO)
    }
}

/// Who the box is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Hello {
    /// Its firmware.
    pub firmware: Firmware,
    /// Ticks of its clock per microsecond.
    pub ticks_per_us: u8,
    /// Its serial number; empty when it was never given one.
    pub serial: String,
    /// `BOX_NAME`.
    pub name: String,
}

impl Hello {
    /// Reads the answers to [`Request::Hello`].
    #[must_use]
    pub fn parse(answers: &[u8]) -> Option<Self> {
        let mut c = Cursor(answers);
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

/// Reads the answer to [`Request::Mark`]: when the start pulse rises, which may be later than the reply.
#[must_use]
pub fn parse_mark(answers: &[u8]) -> Option<Ticks> {
    let mut c = Cursor(answers);
    let start = Ticks(c.u64()?);
    c.end()?;
    Some(start)
}

/// Something that happened at the box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EventKind {
    /// The train of this mark began.
    Mark(Mark),
    /// The sync train with this count began.
    Sync(u32),
    /// An edge of the input.
    Input {
        /// True for a rising edge.
        rising: bool,
    },
}

/// An event with its instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Event {
    /// What.
    pub kind: EventKind,
    /// When.
    pub at: Ticks,
}

/// The answer to [`Request::Events`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Events {
    /// Events that found the box's memory full, since its reset.
    pub dropped: u16,
    /// Number of the event that comes next.
    pub next: u32,
    /// Number of the first of `events`.
    pub first: u32,
    /// The oldest events that the box keeps, in order; not all of them.
    pub events: Vec<Event>,
}

impl Events {
    /// Reads the answers; `None` also for an event of a kind that does not exist.
    #[must_use]
    pub fn parse(answers: &[u8]) -> Option<Self> {
        let mut c = Cursor(answers);
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

/// Why the box began anew: the processor's register MCUSR (ATmega328P data sheet DS40002061B, section 11.9.1).
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

/// The box's counters, each since its reset. Those of 16 bits stop at 65,535.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counters {
    /// Why it was reset.
    pub reset_cause: ResetCause,
    /// Trains of marks that began.
    pub marks: u32,
    /// Sync trains that began.
    pub syncs: u32,
    /// Edges of the input that were stamped.
    pub input_edges: u32,
    /// Edges of trains that came too late.
    pub late_edges: u16,
    /// Pulses at the input too short to be stamped.
    pub input_glitches: u16,
    /// Events that found the memory full.
    pub dropped_events: u16,
    /// Frames with a wrong checksum.
    pub bad_checksums: u16,
    /// Frames that were none.
    pub bad_frames: u16,
    /// Bytes that were lost because nobody took them in time.
    pub overruns: u16,
    /// Edges of the input that found its share of the memory taken.
    pub ignored_edges: u16,
    /// Times that the input changed too often and was not looked at for the rest of a turn of the clock, 4 ms at most.
    pub input_mutes: u16,
}

impl Counters {
    /// Reads the answers to [`Request::Status`].
    #[must_use]
    pub fn parse(answers: &[u8]) -> Option<Self> {
        let mut c = Cursor(answers);
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

/// What the box saw of its own outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SelfTest {
    /// All outputs rose.
    pub rose: bool,
    /// All outputs fell.
    pub fell: bool,
    /// The input followed: the spare output is wired to it.
    pub input_followed: bool,
}

impl SelfTest {
    /// Reads the answer to [`Request::SelfTest`].
    #[must_use]
    pub fn parse(answers: &[u8]) -> Option<Self> {
        let mut c = Cursor(answers);
        let flags = c.u8()?;
        c.end()?;
        Some(Self {
            rose: flags & 1 != 0,
            fell: flags & 2 != 0,
            input_followed: flags & 4 != 0,
        })
    }
}

/// The code of sync trains is beyond those of marks, so that neither can be taken for the other.
const _: () = assert!(SYNC_CODE > 5);

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn any_bytes_are_read_without_panic(body in prop::collection::vec(any::<u8>(), 0..120)) {
            if let Some(reply) = Reply::parse(&body) {
                let a = &reply.answers;
                let _ = (Hello::parse(a), Events::parse(a), Counters::parse(a), SelfTest::parse(a), parse_mark(a));
            }
            let _ = (Hello::parse(&body), Events::parse(&body), Counters::parse(&body));
        }

        #[test]
        fn requests_carry_their_number_and_fit_a_frame(id in any::<u16>(), number in any::<u32>(), press in 0..=MAX_MARKED_PRESS) {
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
    fn both_sides_agree_on_the_versions() {
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
