//! Kinds of faults that make an attempt at a press invalid.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::text::UnknownName;

/// Kind of fault that made an attempt invalid, for programs; the reason beside it is for display.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PressFaultKind {
    /// A camera lost bytes.
    DataLost,
    /// A camera sent no bytes at all.
    NoData,
    /// A camera's data did not arrive before the verdict was due.
    DataLate,
    /// A camera sent more events per second than the plan allows.
    Storm,
    /// The tip was too late: at the surface, at depth or back at clearance height.
    Late,
    /// The tip was pushed aside on its way down.
    Aside,
    /// The operator or a suspension interrupted the press.
    Paused,
    /// The run ended during the press.
    RunEnded,
    /// The surface was outside its band, or was not found.
    Surface,
    /// The robot reported no force, or too few.
    NoForce,
    /// A moment of the press was not measured.
    Unmeasured,
    /// The tip left its location during the hold.
    Hold,
}

impl PressFaultKind {
    /// All kinds.
    pub const ALL: [Self; 12] = [
        Self::DataLost,
        Self::NoData,
        Self::DataLate,
        Self::Storm,
        Self::Late,
        Self::Aside,
        Self::Paused,
        Self::RunEnded,
        Self::Surface,
        Self::NoForce,
        Self::Unmeasured,
        Self::Hold,
    ];

    /// The name used in sessions.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::DataLost => "data_lost",
            Self::NoData => "no_data",
            Self::DataLate => "data_late",
            Self::Storm => "storm",
            Self::Late => "late",
            Self::Aside => "aside",
            Self::Paused => "paused",
            Self::RunEnded => "run_ended",
            Self::Surface => "surface",
            Self::NoForce => "no_force",
            Self::Unmeasured => "unmeasured",
            Self::Hold => "hold",
        }
    }

    /// True for faults of the skin or the robot at that location: another press would only wear it. False for transient
    /// faults: lost data, a late motion, an interruption by the operator, the end of the run.
    #[must_use]
    pub const fn is_of_the_place(self) -> bool {
        matches!(
            self,
            Self::Surface | Self::NoForce | Self::Unmeasured | Self::Hold
        )
    }
}

impl fmt::Display for PressFaultKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for PressFaultKind {
    type Err = UnknownName;

    fn from_str(text: &str) -> Result<Self, UnknownName> {
        let found = Self::ALL.into_iter().find(|kind| kind.name() == text);
        found.ok_or_else(|| UnknownName {
            expected: "a kind of press fault",
            found: text.to_owned(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_read_back() {
        for kind in PressFaultKind::ALL {
            assert_eq!(kind.name().parse(), Ok(kind));
        }
        assert!("other".parse::<PressFaultKind>().is_err());
    }
}
