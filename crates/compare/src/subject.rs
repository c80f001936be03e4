//! Owns the inputs of a comparison: sessions with their facts, grouped into skins.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};
use skinrig_analysis::Analysis;
use skinrig_analysis::result::PressView;
use skinrig_model::SkinOutline;
use skinrig_statistics::{Sample, SampleFault};

/// Everything known about a session besides its results.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct SessionFacts {
    /// File name.
    pub file: String,
    /// Unique ID, independent of the file name.
    pub session_id: String,
    /// Name of the pressed prototype.
    pub prototype: String,
    /// Start, civil time, RFC 3339.
    pub started: String,
    /// `simulated`, `replayed`, `imported`, `emulated` or `bench`.
    pub rig_kind: String,
    /// Source of the data (of a replay: that of the recording): `simulated`, `emulated`, `bench` or `imported`; `None` when
    /// unknown.
    pub origin: Option<String>,
    /// Name of the rig.
    pub rig_name: String,
    /// All other facts by path: `protocol.motion.hold`, `bias.camera1.bias_fo`, `simulation.geometric.halo_mm`, ...
    pub values: BTreeMap<String, String>,
    /// Documentation of the settings among them, by path.
    #[serde(skip)]
    pub docs: BTreeMap<String, String>,
    /// CRC-32 and length of the chunks with events: they identify a recording under any name.
    #[serde(skip)]
    pub chunks: BTreeSet<(u32, u64)>,
}

/// A session with its results.
#[derive(Debug, Clone)]
pub struct Session {
    /// Facts of the session.
    pub facts: SessionFacts,
    /// Results of the session.
    pub analysis: Analysis,
}

/// A skin to compare, with all its sessions.
#[derive(Debug, Clone)]
pub struct Subject {
    /// `A`, `B`, ... in the order given.
    pub letter: char,
    /// Prototype, or the name that the user gave.
    pub name: String,
    /// At least one.
    pub sessions: Vec<Session>,
}

impl SessionFacts {
    /// True if both hold the same bytes.
    fn has_same_chunks(&self, other: &Self) -> bool {
        mostly_shared(&self.chunks, &other.chunks)
    }
}

impl Session {
    /// True if both are of one recording, imported, replayed or simulated twice. Another file format or origin of time changes
    /// every byte, but not the events of the presses.
    pub(crate) fn is_same_recording(&self, other: &Self) -> bool {
        self.facts.has_same_chunks(&other.facts)
            || mostly_shared(&self.press_events(), &other.press_events())
    }

    /// What identifies the events of each press that both cameras saw: their number, and the bits of the centroids.
    fn press_events(&self) -> BTreeSet<[(u32, u32, u64, u64); 2]> {
        let of = |view: &PressView| {
            let [u, v] = [view.centroid_u?, view.centroid_v?].map(f64::to_bits);
            Some((view.on_events, view.cluster_events, u, v))
        };
        let presses = self.analysis.presses.iter();
        presses
            .filter_map(|p| Some([of(p.views[0].as_ref()?)?, of(p.views[1].as_ref()?)?]))
            .collect()
    }
}

/// True if both share more than half of what the smaller one has.
fn mostly_shared<T: Ord>(one: &BTreeSet<T>, other: &BTreeSet<T>) -> bool {
    2 * one.intersection(other).count() > one.len().min(other.len())
}

impl Subject {
    /// Distinct values of a fact over the sessions; `none` for a session without it.
    pub(crate) fn fact(&self, of: impl Fn(&Session) -> Option<String>) -> BTreeSet<String> {
        let value = |s: &Session| of(s).unwrap_or_else(|| "none".to_owned());
        self.sessions.iter().map(value).collect()
    }

    /// The skin as each of its sessions has it; nothing for a single session.
    pub(crate) fn by_session(&self) -> Vec<Self> {
        if self.sessions.len() < 2 {
            return Vec::new();
        }
        let alone = |session: &Session| Self {
            letter: self.letter,
            name: self.name.clone(),
            sessions: vec![session.clone()],
        };
        self.sessions.iter().map(alone).collect()
    }

    /// Outline of the skin in the first session.
    pub(crate) fn outline(&self) -> Option<&SkinOutline> {
        self.sessions.first().map(|s| &s.analysis.rig.outline)
    }
}

/// A sample of a skin that tells its sessions apart. `by_session`: as [`Subject::by_session`].
pub(crate) fn sample(
    subject: &Subject,
    by_session: &[Subject],
    of: impl Fn(&Subject) -> Result<Sample, SampleFault>,
) -> Result<Sample, SampleFault> {
    let sessions = by_session.iter().map(&of).collect::<Result<Vec<_>, _>>()?;
    Ok(of(subject)?.of_sessions(sessions))
}

/// Values in one line.
pub(crate) fn join_values(values: &BTreeSet<String>) -> String {
    values.iter().cloned().collect::<Vec<_>>().join(" and ")
}
