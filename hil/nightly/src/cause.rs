//! Probable cause of a failed check: the part of the bench to investigate.

use serde::{Deserialize, Serialize};

/// Probable cause of a failed check.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// The computer: its disk, cables, permissions, load; or another program.
    Infrastructure,
    /// A device of the rig.
    Rig,
    /// The skin on the bench.
    Skin,
    /// skinrig itself.
    Software,
}

impl Cause {
    /// Display name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Infrastructure => "infrastructure",
            Self::Rig => "rig",
            Self::Skin => "skin",
            Self::Software => "software",
        }
    }
}
