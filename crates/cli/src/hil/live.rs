//! What a terminal shows while a suite runs, and the night kept after every check.

use std::path::PathBuf;

use skinrig_hil::Onlooker;
use skinrig_nightly::Night;
use skinrig_protocol::suite::Check;

use super::folder;

/// Shows the night as it grows, and writes it down.
pub struct Live {
    folder: PathBuf,
    total: usize,
    told: usize,
    /// The first fault in writing the night down.
    pub unwritten: Option<String>,
}

impl Live {
    /// For a suite of so many checks.
    #[must_use]
    pub const fn new(folder: PathBuf, total: usize) -> Self {
        Self {
            folder,
            total,
            told: 0,
            unwritten: None,
        }
    }
}

impl Onlooker for Live {
    fn begins(&mut self, _night: &Night, check: &Check, attempt: usize) {
        if attempt > 1 {
            errln!("{}: again, attempt {attempt}", check.title);
        }
    }

    fn made(&mut self, night: &Night) {
        if let Err(e) = folder::write_json(&self.folder, night) {
            self.unwritten.get_or_insert_with(|| e.to_string());
        }
        for check in night.checks.iter().skip(self.told) {
            self.told += 1;
            let took_s: f64 = check.attempts.iter().map(|a| a.took_s).sum();
            errln!(
                "{:>2}/{}  {:<12}  {:<30}{took_s:7.1} s",
                self.told,
                self.total,
                check.verdict.name(),
                check.title
            );
        }
    }
}
