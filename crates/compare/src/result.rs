//! Owns the result of a comparison: everything that terminal, page and JSON show.

use serde::Serialize;
use skinrig_model::SkinOutline;

use crate::causes::{Causes, Reanalysis, causes};
use crate::comparability::{Difference, Severity, differences};
use crate::location_results::{Location, compare_locations};
use crate::locations::Locations;
use crate::metrics::Metric;
use crate::no_result::NoResult;
use crate::sequential::{SequentialComparison, first_repetitions, look};
use crate::subject::{SessionFacts, Subject};
use crate::table::{BaselineComparison, Margins, Row, table};
use skinrig_statistics::{AlphaSpending, Pairing, Settings, Verdict};

/// Options of a comparison.
#[derive(Debug, Clone, Default)]
pub struct ComparisonOptions {
    /// Name of the limits file.
    pub limits: Option<String>,
    /// Equivalence margins, in the unit of each metric's values.
    pub margins: Margins,
    /// Limit of the pass rate, mm; defaults to the first skin's setting.
    pub within_mm: Option<f64>,
    /// Keys of blocking differences to ignore.
    pub overrides: Vec<String>,
    /// Statistical settings.
    pub settings: Settings,
    /// Look after each repetition of exactly two skins, and spend alpha over the looks; `None`: one look at all data.
    pub sequential: Option<AlphaSpending>,
}

/// Summary of one skin.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Skin {
    /// `A`, `B`, ... in the order given.
    pub letter: char,
    /// Prototype, or the name that the user gave.
    pub name: String,
    /// Its sessions.
    pub sessions: Vec<SessionFacts>,
    /// Scored presses attempted at the depths that all skins share.
    pub attempted: u32,
    /// Attempted presses that count, at locations and depths that all skins located.
    pub counted: u32,
    /// Locations with a press that counts.
    #[serde(rename = "places")]
    pub locations: u32,
}

/// Result of comparing skins.
#[derive(Debug, Clone, Serialize)]
pub struct Comparison {
    /// The skins; the first is the baseline.
    pub skins: Vec<Skin>,
    /// All differences, most severe first.
    pub differences: Vec<Difference>,
    /// Name of the limits file.
    pub limits: Option<String>,
    /// Limit of the pass rate, mm.
    pub within_mm: f64,
    /// Statistical settings, including the pairing that was used. Of a sequential comparison those of its last look.
    pub settings: Settings,
    /// Looks of a sequential comparison; everything else then uses the presses of the last look.
    pub sequential: Option<SequentialComparison>,
    /// One row per metric.
    pub table: Vec<Row>,
    /// All locations.
    pub locations: Vec<Location>,
    /// For each skin but the first: causes of its difference; `None` with too few shared locations.
    pub causes: Vec<Option<Causes>>,
    /// Outline of the first skin.
    #[serde(skip)]
    pub outline: Option<SkinOutline>,
}

impl Comparison {
    /// Blocking differences that were not overridden; with any of them the tables are empty.
    pub fn blocking(&self) -> impl Iterator<Item = &Difference> {
        let all = self.differences.iter();
        all.filter(|d| d.severity == Severity::Blocking && !d.overridden)
    }

    /// The RMSE row.
    #[must_use]
    pub fn headline(&self) -> Option<&Row> {
        self.table.first()
    }

    /// Which certainly locates fewer presses, skin `subject` or the first, with the row of the located rate. The errors of that skin are
    /// those of its easier presses.
    #[must_use]
    pub fn fewer_located(&self, subject: usize) -> Option<(usize, &Row)> {
        let row = self
            .table
            .iter()
            .find(|r| r.metric == Metric::LocatedRate)?;
        let all = &row.against_first;
        let difference = all.iter().find(|a| a.subject == subject)?.difference()?;
        if difference.high.is_some_and(|high| high < 0.0) {
            Some((subject, row))
        } else if difference.low.is_some_and(|low| low > 0.0) {
            Some((0, row))
        } else {
            None
        }
    }

    /// True if the interval of the difference in RMSE of skin `subject` and the first does not hold 0.
    fn is_rmse_different(&self, subject: usize) -> bool {
        let all = self.headline().map(|row| &row.against_first);
        let of = all.and_then(|all| all.iter().find(|a| a.subject == subject));
        let difference = of.and_then(BaselineComparison::difference);
        difference.is_some_and(|d| {
            d.high.is_some_and(|high| high < 0.0) || d.low.is_some_and(|low| low > 0.0)
        })
    }

    /// Verdict on the RMSE of skin `subject` against the first.
    #[must_use]
    pub fn verdict(&self, subject: usize) -> Option<Verdict> {
        let row = self.headline()?;
        row.against_first
            .iter()
            .find(|a| a.subject == subject)?
            .verdict
    }
}

/// For each skin but the first, if its settings differ from the first's: the first skin with the settings of that skin, and
/// that skin with the settings of the first.
pub type Reanalyses = Vec<Option<[Subject; 2]>>;

/// Checks comparability and compares. With a blocking difference, table, locations and causes are empty.
#[must_use]
pub fn compare(
    subjects: &[Subject],
    reanalyses: &Reanalyses,
    options: &ComparisonOptions,
) -> Comparison {
    let mut settings = options.settings;
    let differences = differences(subjects, &options.overrides);
    if differences
        .iter()
        .any(|d| d.key == "locations" && d.overridden)
    {
        settings.pairing = Pairing::Independent;
    }
    let is_blocked = differences
        .iter()
        .any(|d| d.severity == Severity::Blocking && !d.overridden);
    let looked = match (options.sequential, subjects) {
        (Some(spending), [a, b]) if !is_blocked => {
            let margin = options.margins.iter().find(|(m, _)| *m == Metric::Rmse);
            let pair = [a.clone(), b.clone()];
            Some(look(&pair, margin.map(|m| m.1), spending, &settings))
        }
        _ => None,
    };
    let (sequential, chosen) = match looked {
        Some((sequential, chosen, own)) => {
            settings = own;
            (Some(sequential), Some(chosen))
        }
        None => (None, None),
    };
    let subjects = chosen.as_ref().map_or(subjects, |c| c.as_slice());
    let locations = Locations::of(subjects);
    let own_within = subjects.first().and_then(|s| s.sessions.first());
    let within_mm = options
        .within_mm
        .or(own_within.map(|s| s.analysis.settings.within_mm))
        .unwrap_or_default();
    let skin = |s: &Subject| {
        let attempts: Vec<_> = locations.attempts(s).collect();
        let counting = || attempts.iter().filter(|p| p.error().is_some());
        let own: std::collections::BTreeSet<u32> = counting().map(|p| p.location).collect();
        Skin {
            letter: s.letter,
            name: s.name.clone(),
            sessions: s.sessions.iter().map(|s| s.facts.clone()).collect(),
            attempted: attempts.len() as u32,
            counted: counting().count() as u32,
            locations: own.len() as u32,
        }
    };
    let mut result = Comparison {
        skins: subjects.iter().map(skin).collect(),
        differences,
        limits: options.limits.clone(),
        within_mm,
        settings,
        sequential,
        table: Vec::new(),
        locations: Vec::new(),
        causes: Vec::new(),
        outline: subjects.first().and_then(Subject::outline).copied(),
    };
    if result.blocking().next().is_some() {
        return result;
    }
    result.table = table(subjects, &locations, within_mm, &options.margins, &settings);
    if result
        .sequential
        .as_ref()
        .is_some_and(SequentialComparison::awaits_sessions)
    {
        // No press was looked at.
        for row in &mut result.table {
            let missing = row.values.iter_mut().map(|v| &mut v.missing);
            let errors = row.against_first.iter_mut().map(|c| &mut c.error);
            missing
                .chain(errors)
                .for_each(|reason| *reason = Some(NoResult::OneSession));
        }
    }
    // Marks on the map are at the ordinary level.
    let ordinary = Settings {
        pairing: settings.pairing,
        ..options.settings
    };
    result.locations = compare_locations(subjects, &locations, &ordinary);
    let others = subjects.iter().skip(1).enumerate();
    result.causes = others
        .map(|(i, other)| {
            let reanalysis = reanalyses.get(i).and_then(Option::as_ref);
            let reanalysis = reanalysis.map(|pair| match &result.sequential {
                Some(s) => first_repetitions(pair, s.looks.last().map_or(0, |l| l.repetitions)),
                None => pair.clone(),
            });
            let reanalysis = reanalysis.as_ref();
            let reanalysis = reanalysis.map(|[first, second]| Reanalysis { first, second });
            let mut found = causes(&subjects[0], other, reanalysis, RESAMPLES, settings.seed)?;
            // What may be no change has no cause. The interval of the RMSE is the wider one.
            if !result.is_rmse_different(i + 1) {
                found.carried_by = None;
            }
            Some(found)
        })
        .collect();
    result
}

/// Bootstrap draws for the intervals of the causes.
const RESAMPLES: u32 = 400;
