//! Nights of a catalogue as the input of the trends.

use std::collections::BTreeMap;

use skinrig_model::Limit;
use skinrig_nightly::trend::{
    Acceptance, Filter, History, NightSummary, NoSuchNights, Point, SuiteNights,
};
use skinrig_nightly::{Verdict, Versions};

use crate::catalogue::Catalogue;
use crate::error::CatalogueError;
use crate::value::{Bound, Value};

/// A suite on a bench, as the catalogue has it.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Bench {
    rig: String,
    rig_kind: String,
    suite: String,
    /// `None` in a file, which is of one computer.
    computer: Option<String>,
}

impl Bench {
    /// What its nights say of it.
    fn name(&self) -> [&str; 3] {
        [&self.rig, &self.rig_kind, &self.suite]
    }
}

/// Nights of a suite on a bench.
#[derive(Debug, Clone, PartialEq)]
pub struct CatalogueNights {
    /// The nights. Their folders are paths where this computer has them, otherwise what the catalogue calls them.
    pub history: History,
    /// Number of nights that an earlier version registered, without what the trends need. They are left out.
    pub outdated: usize,
}

const SUITES: &str = "SELECT rig, rig_kind, suite, folder, started_at FROM night";

const NIGHTS: &str = "SELECT sha256, night_id, started_at, suite_sha256, rig_sha256, software, analysis, skin, verdict, folder, golden,
        firmware_json
    FROM night WHERE rig = $1 AND rig_kind = $2 AND suite = $3";

const VALUES: &str = "SELECT v.sha256, v.check_name, v.subject, v.metric, v.unit, v.value, v.low, v.high, v.n, v.at_least, v.at_most,
        v.margin, v.verdict, v.part_verdict, v.attempts
    FROM night_value v JOIN night n ON n.sha256 = v.sha256
    WHERE n.rig = $1 AND n.rig_kind = $2 AND n.suite = $3";

const ACCEPTANCES: &str =
    "SELECT series, night_id, reason, accepted_by, accepted_at, store FROM night_acceptance
    WHERE rig = $1 ORDER BY store, position";

impl Catalogue {
    /// The suites whose nights it has, by bench; the one with the newest night first. Benches of the same name on several computers are
    /// told apart by the names of these.
    ///
    /// # Errors
    /// If the catalogue cannot be read.
    pub fn suites(&mut self) -> Result<Vec<SuiteNights>, CatalogueError> {
        Ok(self
            .benches()?
            .into_iter()
            .map(|(suite, _)| suite)
            .collect())
    }

    /// The suites, each with its key in the catalogue.
    fn benches(&mut self) -> Result<Vec<(SuiteNights, Bench)>, CatalogueError> {
        let mut found: BTreeMap<Bench, (usize, String)> = BTreeMap::new();
        for row in self.rows(SUITES, &[])? {
            let folder = text(&row[3], "folder")?;
            let bench = Bench {
                rig: text(&row[0], "rig")?,
                rig_kind: text(&row[1], "rig_kind")?,
                suite: text(&row[2], "suite")?,
                computer: self.computer_of(&folder).map(str::to_owned),
            };
            let (nights, newest) = found.entry(bench).or_default();
            *nights += 1;
            *newest = text(&row[4], "started_at")?.max(std::mem::take(newest));
        }
        let is_named_twice = |bench: &Bench| {
            let alike = found.keys().filter(|other| other.name() == bench.name());
            alike.count() > 1
        };
        let suite = |(bench, (nights, newest)): (&Bench, &(usize, String))| {
            let computer = bench.computer.as_ref().filter(|_| is_named_twice(bench));
            let suite = SuiteNights {
                rig: match computer {
                    Some(computer) => format!("{} of {computer}", bench.rig),
                    None => bench.rig.clone(),
                },
                rig_kind: bench.rig_kind.clone(),
                suite: bench.suite.clone(),
                nights: *nights,
                newest: newest.clone(),
            };
            (suite, bench.clone())
        };
        let mut suites: Vec<(SuiteNights, Bench)> = found.iter().map(suite).collect();
        suites.sort_by(|(a, a_key), (b, b_key)| (&b.newest, a_key).cmp(&(&a.newest, b_key)));
        Ok(suites)
    }

    /// The nights of the first suite that `filter` selects, as a history of them has them.
    ///
    /// # Errors
    /// [`CatalogueError::NoNights`] if it selects none; if the catalogue cannot be read.
    pub fn nights(&mut self, filter: &Filter) -> Result<CatalogueNights, CatalogueError> {
        let (suites, benches): (Vec<_>, Vec<_>) = self.benches()?.into_iter().unzip();
        let none = |found: NoSuchNights| CatalogueError::NoNights {
            place: self.place.clone(),
            found,
        };
        let chosen = filter.choose(&suites).map_err(none)?;
        let (of, bench) = (&suites[chosen], &benches[chosen]);
        let key = [
            (&bench.rig).into(),
            (&bench.rig_kind).into(),
            (&bench.suite).into(),
        ];
        let mut nights = Vec::new();
        let mut outdated = 0;
        for row in self.rows(NIGHTS, &key)? {
            let folder = text(&row[9], "folder")?;
            if self.computer_of(&folder) != bench.computer.as_deref() {
                continue;
            }
            if row[3] == Value::Null {
                outdated += 1;
                continue;
            }
            nights.push((text(&row[0], "sha256")?, self.night(of, &row)?));
        }
        nights.sort_by(|(_, a), (_, b)| (&a.started, &a.id).cmp(&(&b.started, &b.id)));
        let at = nights.iter().zip(0..);
        let at: BTreeMap<String, usize> = at.map(|((key, _), at)| (key.clone(), at)).collect();
        let mut history = History {
            nights: nights.into_iter().map(|(_, night)| night).collect(),
            ..History::default()
        };
        let mut values = Vec::new();
        for row in self.rows(VALUES, &key)? {
            if let Some(&night) = at.get(&text(&row[0], "sha256")?) {
                values.push(value(night, &row)?);
            }
        }
        values.sort_by(|(a_name, a_unit, a), (b_name, b_unit, b)| {
            (a.night, a_name, a_unit).cmp(&(b.night, b_name, b_unit))
        });
        for (name, unit, point) in values {
            history.add(&name, &unit, point);
        }
        for row in self.rows(ACCEPTANCES, &key[..1])? {
            let store = text(&row[5], "store")?;
            if self.computer_of(&store) != bench.computer.as_deref() {
                continue;
            }
            let accepted = Acceptance {
                series: optional(&row[0]),
                night: text(&row[1], "night_id")?,
                reason: text(&row[2], "reason")?,
                by: text(&row[3], "accepted_by")?,
                at: text(&row[4], "accepted_at")?,
            };
            // Copies of a history lie in several folders.
            if !history.accepted.contains(&accepted) {
                history.accepted.push(accepted);
            }
        }
        Ok(CatalogueNights { history, outdated })
    }

    fn rows(
        &mut self,
        sql: &'static str,
        parameters: &[Bound],
    ) -> Result<Vec<Vec<Value>>, CatalogueError> {
        let found = self.runtime.block_on(self.db.fetch(sql, parameters));
        found
            .map(|found| found.rows)
            .map_err(|e| CatalogueError::sql(&self.place, "reading its nights", e))
    }

    /// A row of [`NIGHTS`].
    fn night(&self, of: &SuiteNights, row: &[Value]) -> Result<NightSummary, CatalogueError> {
        let folder = text(&row[9], "folder")?;
        let firmware = text(&row[11], "firmware_json")?;
        Ok(NightSummary {
            id: text(&row[1], "night_id")?,
            started: text(&row[2], "started_at")?,
            suite: of.suite.clone(),
            suite_sha256: text(&row[3], "suite_sha256")?,
            rig: of.rig.clone(),
            rig_kind: of.rig_kind.clone(),
            rig_sha256: text(&row[4], "rig_sha256")?,
            versions: Versions {
                software: text(&row[5], "software")?,
                analysis: number(&row[6], "analysis")?,
                firmware: serde_json::from_str(&firmware)
                    .map_err(|e| invalid("firmware_json", &e.to_string()))?,
                skin: optional(&row[7]),
            },
            verdict: verdict(&row[8], "verdict")?,
            folder: self
                .folder_of(&folder)
                .map_or(folder, |path| path.display().to_string()),
            golden: optional(&row[10]),
        })
    }
}

/// Name and unit of the series of a row of [`VALUES`], and the point.
fn value(night: usize, row: &[Value]) -> Result<(String, String, Point), CatalogueError> {
    let name = format!(
        "{}/{}/{}",
        text(&row[1], "check_name")?,
        text(&row[2], "subject")?,
        text(&row[3], "metric")?
    );
    let limit = real(&row[11]).map(|margin| Limit {
        at_least: real(&row[9]),
        at_most: real(&row[10]),
        margin,
    });
    let point = Point {
        night,
        value: real(&row[5]),
        interval: real(&row[6]).zip(real(&row[7])).map(<[f64; 2]>::from),
        n: match &row[8] {
            Value::Null => None,
            n => Some(number(n, "n")?),
        },
        limit,
        verdict: verdict(&row[12], "verdict")?,
        part: verdict(&row[13], "part_verdict")?,
        attempts: number(&row[14], "attempts")?,
    };
    Ok((name, text(&row[4], "unit")?, point))
}

/// A column that another program changed.
fn invalid(column: &'static str, found: &str) -> CatalogueError {
    CatalogueError::InvalidColumn {
        column,
        found: found.to_owned(),
    }
}

fn text(value: &Value, column: &'static str) -> Result<String, CatalogueError> {
    optional(value).ok_or_else(|| invalid(column, &format!("{value:?}")))
}

fn optional(value: &Value) -> Option<String> {
    value.as_text().map(str::to_owned)
}

fn real(value: &Value) -> Option<f64> {
    match value {
        Value::Real(value) => Some(*value),
        _ => None,
    }
}

fn number<T: TryFrom<i64>>(value: &Value, column: &'static str) -> Result<T, CatalogueError> {
    let number = value.as_integer().and_then(|n| T::try_from(n).ok());
    number.ok_or_else(|| invalid(column, &format!("{value:?}")))
}

fn verdict(value: &Value, column: &'static str) -> Result<Verdict, CatalogueError> {
    let name = text(value, column)?;
    let found = Verdict::ALL.into_iter().find(|v| v.name() == name);
    found.ok_or_else(|| invalid(column, &format!("`{}`", name.escape_debug())))
}
