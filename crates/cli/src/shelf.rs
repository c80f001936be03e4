//! The sessions of a folder with their results: from its catalogue where that is current, else from the files. Both give the same.

use std::collections::BTreeMap;
use std::path::Path;

use skinrig_analysis::result::Estimate;
use skinrig_catalogue::{
    Access, Address, Catalogue, CatalogueError, ListedAnalysis, ListedSession, Listing,
};
use skinrig_recorder::{SessionSummary, list_with};
use skinrig_report::Variant;

use crate::analyses::{SummaryError, summary};
use crate::exit::Failure;

/// Most names of missing files in a note.
const NAMES: usize = 3;

/// The sessions of a folder.
pub(crate) struct Shelf {
    /// As [`skinrig_recorder::list`] gives them.
    pub sessions: Vec<SessionSummary>,
    /// Problems of the catalogue, with the next step.
    pub notes: Vec<String>,
    known: BTreeMap<String, ListedSession>,
}

/// Results of an analysis.
pub(crate) struct ShelfResult {
    pub is_valid: bool,
    pub rmse_mm: Estimate,
    /// Share of the attempted scored presses that were located.
    pub located_rate: Option<f64>,
    pub variant: Option<Variant>,
    /// Values overridden when the session was recorded.
    pub overrides: Vec<String>,
}

impl Shelf {
    /// Lists a folder.
    ///
    /// # Errors
    /// [`Failure::input`] when the folder cannot be read.
    pub(crate) fn read(folder: &Path) -> Result<Self, Failure> {
        let (listing, notes) = from_catalogue(folder);
        let known = listing.sessions;
        let state = |path: &Path| {
            let name = path.file_name()?.to_str()?;
            known.get(name).map(|listed| listed.state.clone())
        };
        let sessions = list_with(folder, state).map_err(Failure::session)?;
        Ok(Self {
            sessions,
            notes,
            known,
        })
    }

    /// Lists a folder for a command, and prints the notes.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub(crate) fn told(folder: &Path) -> Result<Self, Failure> {
        let shelf = Self::read(folder)?;
        for note in &shelf.notes {
            errln!("note: {note}");
        }
        Ok(shelf)
    }

    /// All analyses of a session, the official one first; `None` if only their files have them.
    pub(crate) fn analyses(&self, session: &Path) -> Option<Vec<&ListedAnalysis>> {
        let listed = self.known.get(session.file_name()?.to_str()?)?;
        let mut all: Vec<&ListedAnalysis> = listed.analyses.as_ref()?.iter().collect();
        all.retain(|a| {
            a.variant
                .as_ref()
                .is_none_or(|name| crate::analyses::parse(name).is_ok())
        });
        all.sort_by(|a, b| a.variant.cmp(&b.variant));
        Some(all)
    }

    /// Results of the analysis `name` (`None`: the official one) of a session.
    ///
    /// # Errors
    /// Why there are none that can be used.
    pub(crate) fn result(
        &self,
        session: &Path,
        session_id: &str,
        name: Option<&str>,
    ) -> Result<ShelfResult, SummaryError> {
        let name_of = session.file_name().and_then(|n| n.to_str());
        let listed = name_of.and_then(|name| self.known.get(name));
        match (name, self.analyses(session), listed) {
            (None, Some(all), Some(listed)) => {
                let official = all.into_iter().find(|a| a.variant.is_none());
                let official = official.ok_or(SummaryError::NotAnalysed)?;
                Ok(ShelfResult {
                    is_valid: official.is_valid,
                    rmse_mm: estimate(official),
                    located_rate: official.located_rate,
                    variant: None,
                    overrides: listed.overrides.clone(),
                })
            }
            _ => {
                let found = summary(session, session_id, name)?;
                Ok(ShelfResult {
                    is_valid: found.valid,
                    rmse_mm: found.rmse_mm,
                    located_rate: found.located_rate.value,
                    variant: found.variant,
                    overrides: found.overrides,
                })
            }
        }
    }
}

/// RMSE of a listed analysis.
pub(crate) fn estimate(of: &ListedAnalysis) -> Estimate {
    let found = of.rmse_mm;
    Estimate {
        value: found.value,
        low: found.low,
        high: found.high,
        n: found.n,
    }
}

/// Current entries of a folder's embedded catalogue, and its problems. A missing catalogue is no problem.
fn from_catalogue(folder: &Path) -> (Listing, Vec<String>) {
    let address = Address::of_folder(folder);
    let place = address.to_string();
    let listed = Catalogue::open(address, Access::Read, crate::catalogue::automatic::WAIT)
        .and_then(|mut catalogue| {
            let listed = catalogue.list(folder)?;
            // Failing to close does not affect the entries read.
            let _ = catalogue.close();
            Ok(listed)
        });
    match listed {
        Ok(listing) => {
            let notes = gone(&listing.gone, folder);
            (listing, notes.into_iter().collect())
        }
        Err(CatalogueError::Missing { .. }) => (Listing::default(), Vec::new()),
        Err(e) => {
            let next = match &e {
                CatalogueError::Sql { .. } | CatalogueError::Io { .. } => {
                    format!(
                        "\n  next: delete {place}, then `skinrig catalogue rebuild {}`",
                        folder.display()
                    )
                }
                _ => String::new(),
            };
            let note = format!(
                "the sessions were read from their files, not from the catalogue: {e}{next}"
            );
            (Listing::default(), vec![note])
        }
    }
}

/// A note on files that were deleted or renamed.
fn gone(names: &[String], folder: &Path) -> Option<String> {
    let (first, rest) = names.split_at(names.len().min(NAMES));
    let more = match rest.len() {
        0 => String::new(),
        n => format!(" and {n} more"),
    };
    (!names.is_empty()).then(|| {
        format!(
            "{0}: the catalogue has {1}{more}, which are no longer in the folder\n  next: `skinrig catalogue register {0}` forgets them",
            folder.display(),
            first.join(", ")
        )
    })
}
