//! Owns what is compared: sessions with their facts, put together to skins.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};
use skinrig_analysis::Analysis;
use skinrig_model::SkinOutline;

/// What is known of a session besides its results.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Facts {
    /// The file's name.
    pub file: String,
    /// Names the session whatever its file is called.
    pub session_id: String,
    /// Which prototype was pressed.
    pub prototype: String,
    /// Civil time of the start, RFC 3339.
    pub started: String,
    /// `simulated`, `replayed`, `imported`, `emulated` or `bench`.
    pub rig_kind: String,
    /// Name of the rig.
    pub rig_name: String,
    /// Everything else by path: `protocol.motion.hold`, `bias.camera1.bias_fo`, `simulation.geometric.halo_mm`, ...
    pub values: BTreeMap<String, String>,
}

/// A session: its facts and its results.
#[derive(Debug, Clone)]
pub struct Session {
    /// What is known of it.
    pub facts: Facts,
    /// Its results.
    pub analysis: Analysis,
}

/// One of those that are compared: a skin, with all its sessions.
#[derive(Debug, Clone)]
pub struct Subject {
    /// `A`, `B`, ... in the order given.
    pub letter: char,
    /// The prototype, or what the user called it by.
    pub name: String,
    /// At least one.
    pub sessions: Vec<Session>,
}

impl Subject {
    /// Every value that its sessions have for a fact; `none` where one has none.
    pub(crate) fn fact(&self, of: impl Fn(&Session) -> Option<String>) -> BTreeSet<String> {
        let value = |s: &Session| of(s).unwrap_or_else(|| "none".to_owned());
        self.sessions.iter().map(value).collect()
    }

    /// The outline of the skin, as the first session has it.
    pub(crate) fn outline(&self) -> Option<&SkinOutline> {
        self.sessions.first().map(|s| &s.analysis.rig.outline)
    }
}

/// Values in one line.
pub(crate) fn joined(values: &BTreeSet<String>) -> String {
    values.iter().cloned().collect::<Vec<_>>().join(" and ")
}
