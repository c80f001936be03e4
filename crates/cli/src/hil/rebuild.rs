//! `skinrig hil trend --rebuild`: adds the nights of a folder to a history.

use std::path::{Path, PathBuf};

use chrono::{SecondsFormat, Utc};
use skinrig_hil::history::{self, AppendOutcome, HistoryError};
use skinrig_hil::night_folder;
use skinrig_nightly::Night;
use skinrig_nightly::trend::SuiteNights;

use crate::exit::Failure;

/// What became of the nights.
struct Rebuild {
    /// The suites that the history had before.
    before: Vec<SuiteNights>,
    /// Time at the start, RFC 3339, UTC.
    now: String,
    added: usize,
    /// Of these, nights that started before the newest one that the history had of their suite.
    earlier: usize,
    /// Of these, nights that start in the future.
    future: usize,
    known: usize,
    skipped: usize,
}

impl Rebuild {
    fn of(path: &Path) -> Result<Self, HistoryError> {
        let before = match history::suites(path) {
            Err(HistoryError::Missing { .. }) => Vec::new(),
            found => found?,
        };
        Ok(Self {
            before,
            now: Utc::now().to_rfc3339_opts(SecondsFormat::Secs, true),
            added: 0,
            earlier: 0,
            future: 0,
            known: 0,
            skipped: 0,
        })
    }

    fn count(&mut self, night: &Night, outcome: AppendOutcome) {
        if outcome == AppendOutcome::AlreadyPresent {
            self.known += 1;
            return;
        }
        let newest = self.before.iter().find(|suite| suite.has(night));
        self.added += 1;
        self.earlier += usize::from(newest.is_some_and(|suite| night.started < suite.newest));
        self.future += usize::from(night.started > self.now);
    }

    /// Prints the numbers, and which dates show that a clock was wrong.
    fn print(&self, path: &Path) {
        let Self {
            added,
            earlier,
            future,
            known,
            skipped,
            ..
        } = self;
        errln!("{added} nights added, {known} already present, {skipped} skipped");
        let next = format!(
            "next: if the clock of the computer was wrong, delete {} and rebuild it without their folders",
            path.display()
        );
        if *earlier > 0 {
            errln!(
                "warning: {earlier} of them started before nights that the history had already: they join the reference and are not \
                 judged as new\n  {next}"
            );
        }
        if *future > 0 {
            errln!("warning: of these, {future} dated in the future\n  {next}");
        }
    }
}

/// Adds the nights in the folders of `nights` to the history; returns how many could not be read.
///
/// # Errors
/// [`Failure::input`] if `nights` has no finished night, or the history cannot be written.
pub(super) fn rebuild(path: &Path, nights: &Path) -> Result<usize, Failure> {
    let cannot = |e| Failure::input(format!("--rebuild: {}: {e}", nights.display()));
    let entries = std::fs::read_dir(nights).map_err(cannot)?;
    let entries = entries.map(|e| e.map(|e| e.path()));
    let mut folders: Vec<PathBuf> = entries.collect::<Result<_, _>>().map_err(cannot)?;
    folders.sort();
    let (with_results, others): (Vec<PathBuf>, Vec<PathBuf>) = folders
        .into_iter()
        .partition(|folder| folder.join(night_folder::JSON).is_file());
    let night_files: Vec<PathBuf> = with_results
        .into_iter()
        .map(|folder| folder.join(night_folder::JSON))
        .collect();
    let mut all = Rebuild::of(path).map_err(Failure::input)?;
    for unfinished in others.iter().filter(|path| night_folder::is_named_so(path)) {
        errln!(
            "note: {} is of a night that ended without a {}",
            unfinished.display(),
            night_folder::JSON
        );
    }
    for json in &night_files {
        let home = json.parent().unwrap_or(nights);
        let added = history::read_night(json).and_then(|night| {
            let outcome = history::append(path, &night, home)?;
            Ok((night, outcome))
        });
        match added {
            Ok((night, outcome)) => all.count(&night, outcome),
            Err(
                e @ (HistoryError::InvalidNight { .. } | HistoryError::ConflictingNight { .. }),
            ) => {
                all.skipped += 1;
                errln!("warning: skipped {}: {e}", home.display());
            }
            Err(e) => return Err(Failure::input(e)),
        }
    }
    if night_files.is_empty() {
        return Err(Failure::input(format!(
            "--rebuild: {}: expected folders with a {}, found none",
            nights.display(),
            night_folder::JSON
        )));
    }
    all.print(path);
    if all.added + all.known == 0 {
        return Err(Failure::input(format!(
            "--rebuild: {}: expected finished nights, found none; see the warnings above",
            nights.display()
        )));
    }
    Ok(all.skipped)
}
