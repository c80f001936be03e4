//! Raw camera bytes on their way from a device to the session file.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::event::TriggerEdge;
use crate::id::CameraId;
use crate::text::UnknownName;
use crate::time::HostTime;

/// How the bytes of a camera stream encode events.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StreamFormat {
    /// 32-bit words; what an EVK1 Gen3.1 sends.
    Evt2,
    /// 64-bit vectorised words, little-endian.
    Evt21,
    /// 64-bit vectorised words, high half first (older devices).
    Evt21Legacy,
    /// 16-bit words with state.
    Evt3,
}

impl StreamFormat {
    /// The name stored in sessions.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Evt2 => "evt2",
            Self::Evt21 => "evt21",
            Self::Evt21Legacy => "evt21_legacy",
            Self::Evt3 => "evt3",
        }
    }
}

impl fmt::Display for StreamFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for StreamFormat {
    type Err = UnknownName;

    fn from_str(s: &str) -> Result<Self, UnknownName> {
        [Self::Evt2, Self::Evt21, Self::Evt21Legacy, Self::Evt3]
            .into_iter()
            .find(|f| f.name() == s)
            .ok_or_else(|| UnknownName {
                expected: "a stream format (evt2, evt21, evt21_legacy, evt3)",
                found: s.to_owned(),
            })
    }
}

/// What a chunk contains, found by decoding it once in stream order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct ChunkFacts {
    /// Number of CD events.
    pub cd_events: u64,
    /// How many of them are ON.
    pub on_events: u64,
    /// Number of trigger edges.
    pub trigger_edges: u64,
    /// Camera time of the first timed word (time base words included), µs; `None` for a chunk without time.
    pub first_us: Option<u64>,
    /// Camera time of the last timed word, µs.
    pub last_us: Option<u64>,
}

/// A run of bytes of one camera, exactly as they came.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RawChunk {
    /// Which camera.
    pub camera: CameraId,
    /// 0, 1, 2, ... without gaps, per camera.
    pub seq: u64,
    /// When the last byte reached the host.
    pub host_time: HostTime,
    /// Bytes known to be lost between the previous chunk and this one; exact, or but for whole words: where the next word begins
    /// is known. After a loss these bytes go on with a decoder that carries nothing over, see [`Self::facts`].
    pub lost_before: u64,
    /// The camera time after which they were lost, µs, when the device knows it to be before the last time of the chunks before,
    /// as from a counter that is read now and then. `None`: they were lost after those.
    pub lost_from_us: Option<u64>,
    /// The bytes. A word may be split between two chunks.
    pub bytes: Vec<u8>,
    /// What the device's decoder saw in these bytes. After a loss it carries no torn word and no old time over: events before
    /// the next time base word have no time and are not counted.
    pub facts: ChunkFacts,
    /// The trigger edges in these bytes, in stream order.
    pub triggers: Vec<TriggerEdge>,
}

/// The time that was lost with bytes of a camera, on its clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct LostTime {
    /// The last time known to be good before the loss, µs; `None`: there is none.
    pub from_us: Option<u64>,
    /// The first time after it, µs; `None`: none came.
    pub to_us: Option<u64>,
}

impl LostTime {
    /// How long it was, when both ends are known.
    #[must_use]
    pub fn span_us(self) -> Option<u64> {
        self.to_us?.checked_sub(self.from_us?)
    }

    /// Both ends, as far as they are known: `(from_us, to_us)`, 0 and the largest number where there is none.
    #[must_use]
    pub fn bounds_us(self) -> (u64, u64) {
        (self.from_us.unwrap_or(0), self.to_us.unwrap_or(u64::MAX))
    }
}

impl fmt::Display for LostTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let s = |us: u64| us as f64 * 1e-6;
        match (self.from_us, self.to_us) {
            (Some(from), Some(to)) => {
                let ms = to.saturating_sub(from) as f64 * 1e-3;
                write!(f, "{ms:.3} ms from camera time {:.6} s on", s(from))
            }
            (Some(from), None) => write!(f, "from camera time {:.6} s to the end", s(from)),
            (None, Some(to)) => write!(f, "from the beginning to camera time {:.6} s", s(to)),
            (None, None) => f.write_str("at a time that is not known"),
        }
    }
}
