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
    /// 32-bit words, as sent by an EVK1 Gen3.1.
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

    /// Length of a word, bytes.
    #[must_use]
    pub const fn word_bytes(self) -> usize {
        match self {
            Self::Evt2 => 4,
            Self::Evt21 | Self::Evt21Legacy => 8,
            Self::Evt3 => 2,
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

/// Contents of a chunk, determined by decoding it once in stream order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct ChunkFacts {
    /// Number of CD events.
    pub cd_events: u64,
    /// Number of those that are ON.
    pub on_events: u64,
    /// Number of trigger edges.
    pub trigger_edges: u64,
    /// Camera time of the first timed word (time base words included), µs; `None` for a chunk without time.
    pub first_us: Option<u64>,
    /// Camera time of the last timed word, µs.
    pub last_us: Option<u64>,
}

/// Consecutive bytes of one camera, exactly as received.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RawChunk {
    /// The camera.
    pub camera: CameraId,
    /// 0, 1, 2, ... without gaps, per camera.
    pub seq: u64,
    /// Arrival of the last byte at the host.
    pub host_time: HostTime,
    /// Bytes known to be lost between the previous chunk and this one; exact, or exact except for whole words, so that the next
    /// word boundary is known. After a loss these bytes are decoded with a new decoder, see [`Self::facts`].
    pub lost_before: u64,
    /// Camera time after which they were lost, µs, if the device knows it to be before the end of the previous chunks,
    /// for example from a counter that is read periodically. `None`: they were lost after those chunks.
    pub lost_from_us: Option<u64>,
    /// The bytes. A word may be split between two chunks.
    pub bytes: Vec<u8>,
    /// Contents of these bytes. After a loss the decoder carries no partial word and no time over: events before
    /// the next time base word have no time and are not counted.
    pub facts: ChunkFacts,
    /// The trigger edges in these bytes, in stream order.
    pub triggers: Vec<TriggerEdge>,
}

/// Time lost together with bytes of a camera, on its clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct LostTime {
    /// Last good time before the loss, µs; `None` if there is none.
    pub from_us: Option<u64>,
    /// First time after it, µs; `None` if there is none.
    pub to_us: Option<u64>,
}

impl LostTime {
    /// Its length, if both ends are known.
    #[must_use]
    pub fn span_us(self) -> Option<u64> {
        self.to_us?.checked_sub(self.from_us?)
    }

    /// Both ends `(from_us, to_us)`; 0 and the largest number where unknown.
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
