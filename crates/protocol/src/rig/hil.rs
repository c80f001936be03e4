//! Permissions for suites of checks on a bench.

use serde::Serialize;
use skinrig_settings::{Choice, Settings};

use super::variables;

/// Permissions for suites of checks (`skinrig hil run`) on this bench.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Settings)]
#[settings(name = "hil")]
pub struct HilSetup {
    /// Drills that this bench permits. Emulated benches permit all.
    #[setting(default = "[]", items = 0..=2)]
    pub drills: Vec<Drill>,
    /// Programs that switch the bench's lamps; absent: noise in the dark is not measured.
    #[setting(key = "light")]
    pub lamps: Option<Lamps>,
}

/// A drill.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Choice)]
#[serde(rename_all = "snake_case")]
pub enum Drill {
    /// Kills the program that holds the arm in free air.
    Watchdog,
    /// Stops the arm in the middle of a move in free air.
    Stop,
}

/// Programs that switch the lamps. Each runs without a shell and must exit with 0 within 10 s.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Settings)]
#[settings(name = "light")]
pub struct Lamps {
    /// Switches the lamps off: a program and its arguments; `${NAME}` is looked up in the environment.
    #[setting(items = 1..=20, read = variables::texts, example = "[/usr/local/bin/lamp, \"off\"]")]
    pub dark: Vec<String>,
    /// Switches them on.
    #[setting(items = 1..=20, read = variables::texts, example = "[/usr/local/bin/lamp, \"on\"]")]
    pub lit: Vec<String>,
}
