//! Owns the result of a comparison: everything that table, page and JSON show.

use serde::Serialize;
use skinrig_model::SkinOutline;

use crate::causes::{Again, Causes, causes};
use crate::comparability::{Difference, Weight, differences};
use crate::maps::{Location, locations};
use crate::places::Places;
use crate::statistics::{Pairing, Settings, Verdict};
use crate::subject::{Facts, Subject};
use crate::table::{Margins, Row, table};

/// How to compare.
#[derive(Debug, Clone, Default)]
pub struct Choices {
    /// Name of the limits.
    pub limits: Option<String>,
    /// Per metric, in the unit of its values.
    pub margins: Margins,
    /// X of the pass rate, mm; the first skin's own when absent.
    pub within_mm: Option<f64>,
    /// Keys of blocking differences to go on in spite of.
    pub despite: Vec<String>,
    /// Of the statistics.
    pub settings: Settings,
}

/// A skin, as the result names it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Skin {
    /// `A`, `B`, ...
    pub letter: char,
    /// The prototype, or what the user called it by.
    pub name: String,
    /// Its sessions.
    pub sessions: Vec<Facts>,
    /// Scored presses that were attempted at the depths that all skins share.
    pub attempted: u32,
    /// How many of them count.
    pub counted: u32,
    /// Places with an attempted press.
    pub places: u32,
}

/// A comparison of skins.
#[derive(Debug, Clone, Serialize)]
pub struct Comparison {
    /// The skins; the first is what the others are compared with.
    pub skins: Vec<Skin>,
    /// Everything in which they differ, the gravest first.
    pub differences: Vec<Difference>,
    /// Name of the limits.
    pub limits: Option<String>,
    /// X of the pass rate, mm.
    pub within_mm: f64,
    /// Whether places are compared one by one.
    pub settings: Settings,
    /// The metrics.
    pub table: Vec<Row>,
    /// The places, all of them.
    pub locations: Vec<Location>,
    /// Each skin but the first: why it differs; `None` where too few places are shared.
    pub causes: Vec<Option<Causes>>,
    /// The skin's outline.
    #[serde(skip)]
    pub outline: Option<SkinOutline>,
}

impl Comparison {
    /// Blocking differences that nobody lifted: with one of them there are no numbers.
    pub fn blocking(&self) -> impl Iterator<Item = &Difference> {
        let all = self.differences.iter();
        all.filter(|d| d.weight == Weight::Blocking && !d.lifted)
    }

    /// The row of the headline.
    #[must_use]
    pub fn headline(&self) -> Option<&Row> {
        self.table.first()
    }

    /// The verdict on the RMSE of a skin but the first.
    #[must_use]
    pub fn verdict(&self, subject: usize) -> Option<Verdict> {
        let row = self.headline()?;
        row.against_first
            .iter()
            .find(|a| a.subject == subject)?
            .verdict
    }
}

/// The skins analysed again with the settings of another one: `first[i]` the first skin with those of skin `i + 1`,
/// `others[i]` skin `i + 1` with those of the first; `None` where they do not differ.
pub type Exchanged = Vec<Option<[Subject; 2]>>;

/// May they be compared, and then: how do they compare. With a blocking difference table, places and causes are empty.
#[must_use]
pub fn compare(subjects: &[Subject], exchanged: &Exchanged, choices: &Choices) -> Comparison {
    let places = Places::of(subjects);
    let mut settings = choices.settings;
    let differences = differences(subjects, &choices.despite);
    if differences.iter().any(|d| d.key == "locations" && d.lifted) {
        settings.pairing = Pairing::Independent;
    }
    let own_within = subjects.first().and_then(|s| s.sessions.first());
    let within_mm = choices
        .within_mm
        .or(own_within.map(|s| s.analysis.settings.within_mm))
        .unwrap_or_default();
    let skin = |s: &Subject| {
        let attempts: Vec<_> = places.attempts(s).collect();
        let own: std::collections::BTreeSet<u32> = attempts.iter().map(|p| p.place).collect();
        Skin {
            letter: s.letter,
            name: s.name.clone(),
            sessions: s.sessions.iter().map(|s| s.facts.clone()).collect(),
            attempted: attempts.len() as u32,
            counted: attempts.iter().filter(|p| p.error().is_some()).count() as u32,
            places: own.len() as u32,
        }
    };
    let mut result = Comparison {
        skins: subjects.iter().map(skin).collect(),
        differences,
        limits: choices.limits.clone(),
        within_mm,
        settings,
        table: Vec::new(),
        locations: Vec::new(),
        causes: Vec::new(),
        outline: subjects.first().and_then(Subject::outline).copied(),
    };
    if result.blocking().next().is_some() {
        return result;
    }
    result.table = table(subjects, &places, within_mm, &choices.margins, &settings);
    result.locations = locations(subjects, &places, &settings);
    let others = subjects.iter().skip(1).enumerate();
    result.causes = others
        .map(|(i, other)| {
            let again = exchanged.get(i).and_then(Option::as_ref);
            let again = again.map(|[first, second]| Again { first, second });
            causes(&subjects[0], other, again, RESAMPLES, settings.seed)
        })
        .collect();
    result
}

/// Draws of places for the intervals of the causes.
const RESAMPLES: u32 = 400;
