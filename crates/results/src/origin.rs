//! What a session's data come from: hardware, stand-ins for it, or a simulation.

use std::collections::BTreeMap;
use std::fmt;

use serde_json::Value;
use skinrig_model::RunHeader;
use skinrig_model::level_bias::{LevelBias, SceneFigure};

/// What a session's data come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// The simulated rig.
    Simulated,
    /// Production drivers over stand-ins for the hardware.
    Emulated,
    /// A bench.
    Bench,
    /// Files that another program recorded.
    Imported,
}

impl Origin {
    const ALL: [Self; 4] = [Self::Simulated, Self::Emulated, Self::Bench, Self::Imported];

    /// The origin of the session with this header. A replay has the origin of the recording that it replays; `None` when
    /// the header names no origin that is known.
    #[must_use]
    pub fn of(header: &RunHeader) -> Option<Self> {
        Self::recorded(&header.rig_kind, &header.rig_json)
    }

    fn recorded(kind: &str, rig_json: &str) -> Option<Self> {
        Self::named(kind).or_else(|| {
            let document: Value = serde_json::from_str(rig_json).ok()?;
            Self::named(document["rig"]["kind"].as_str()?)
        })
    }

    fn named(kind: &str) -> Option<Self> {
        let named = |origin: &Self| origin.name().eq_ignore_ascii_case(kind);
        Self::ALL.into_iter().find(named)
    }

    /// `simulated`, `emulated`, `bench` or `imported`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Simulated => "simulated",
            Self::Emulated => "emulated",
            Self::Bench => "bench",
            Self::Imported => "imported",
        }
    }
}

/// Measured differences of a simulated session's level from the optical one, as known when it was recorded; empty for other
/// sessions, the optical level itself, and levels without events.
#[must_use]
pub fn differences_from_optical(header: &RunHeader) -> BTreeMap<SceneFigure, LevelBias> {
    let document: Value = serde_json::from_str(&header.rig_json).unwrap_or_default();
    serde_json::from_value(document["rig"]["against_optical"].clone()).unwrap_or_default()
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kind_decides_and_a_replay_has_the_origin_of_its_recording() {
        let named_otherwise = r#"{"rig": {"kind": "bench", "name": "twin of the simulated rig"}}"#;
        assert_eq!(
            Origin::recorded("bench", named_otherwise),
            Some(Origin::Bench)
        );
        assert_eq!(
            Origin::recorded("replayed", named_otherwise),
            Some(Origin::Bench)
        );
        let emulated = r#"{"rig": {"kind": "emulated", "name": "lab"}}"#;
        assert_eq!(
            Origin::recorded("replayed", emulated),
            Some(Origin::Emulated)
        );
        assert_eq!(Origin::recorded("replayed", "{}"), None);
    }
}
