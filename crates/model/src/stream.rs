//! Raw camera bytes on their way from a device to the session file.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::event::TriggerEdge;
use crate::id::CameraId;
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
    type Err = String;

    fn from_str(s: &str) -> Result<Self, String> {
        [Self::Evt2, Self::Evt21, Self::Evt21Legacy, Self::Evt3]
            .into_iter()
            .find(|f| f.name() == s)
            .ok_or_else(|| {
                format!("expected a stream format (evt2, evt21, evt21_legacy, evt3), found `{s}`")
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
    /// Bytes known to be lost between the previous chunk and this one.
    pub lost_before: u64,
    /// The bytes. A word may be split between two chunks.
    pub bytes: Vec<u8>,
    /// What the device's decoder saw in these bytes.
    pub facts: ChunkFacts,
    /// The trigger edges in these bytes, in stream order.
    pub triggers: Vec<TriggerEdge>,
}
