//! Where to look for a fault.

use serde::{Deserialize, Serialize};

/// What a failed check points to.
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
