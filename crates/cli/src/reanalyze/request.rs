//! One analysis of a re-analysis: its request, whether its results are there already, and its answer. Processes exchange
//! both as JSON.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use skinrig_analysis::ANALYSIS_VERSION;
use skinrig_analysis::result::Estimate;
use skinrig_recorder::{SessionReader, writer_of};
use skinrig_report::{Summary, Variant};

use crate::analyses;
use crate::analysis_request::AnalysisRequest;
use crate::exit::{Exit, Failure};
use crate::results;
use crate::selection::SelectedPresses;

/// Name of the hidden command that carries out one request.
pub(super) const REQUEST_COMMAND: &str = "analyze-request";

/// End of one request.
pub(super) type Answered = Result<(), Refusal>;

/// One analysis to make.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Request {
    /// The session file, absolute.
    pub session: PathBuf,
    /// Name of the variant.
    pub name: String,
    /// What it changes, as `analysis.key=value`.
    pub overrides: Vec<String>,
    /// The selection that names the session.
    pub selected: Option<SelectedPresses>,
    /// Version of the analysis that has to make it.
    pub analysis_version: u32,
}

/// Outcome of a request.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Answer {
    /// Why there are no results.
    pub error: Option<Refusal>,
}

/// Why a session could not be analysed.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Refusal {
    /// Exit code of `skinrig analyze`.
    pub exit: u8,
    /// As `skinrig analyze` prints it.
    pub message: String,
}

impl From<Failure> for Refusal {
    fn from(failure: Failure) -> Self {
        Self {
            exit: failure.exit.code(),
            message: failure.message,
        }
    }
}

impl Refusal {
    /// A fault of the machine or of a program on it.
    pub(crate) fn machine(message: impl std::fmt::Display) -> Self {
        Failure::internal(message).into()
    }

    /// True unless the session or the settings are wrong.
    pub(crate) fn is_fault(&self) -> bool {
        self.exit != Exit::Input.code()
    }
}

/// Results of a request that are beside its session.
pub(crate) struct Stored {
    pub summary: Summary,
    /// True if a seal proves that the session is still the one that was analysed.
    pub is_sealed: bool,
}

impl Request {
    fn choices(&self) -> AnalysisRequest<'_> {
        AnalysisRequest {
            overrides: &self.overrides,
            name: Some(&self.name),
            selection: self.selected.as_ref(),
            ..AnalysisRequest::default()
        }
    }

    /// The results beside the session, if they have these settings, this content of the session, and this version of the analysis.
    pub(crate) fn stored(&self) -> Option<Stored> {
        let reader = SessionReader::open(&self.session).ok()?;
        let id = reader.session_id().ok()?;
        let seal = reader.seal().ok()?.map(|seal| seal.content_sha256());
        let summary = analyses::summary(&self.session, &id, Some(&self.name)).ok()?;
        let is_same = summary.content_sha256 == seal
            && summary.analysis_version == ANALYSIS_VERSION
            && self.is_of(summary.variant.as_ref()?)
            && self.has_report(&summary);
        is_same.then_some(Stored {
            summary,
            is_sealed: seal.is_some(),
        })
    }

    /// True if the report is there and of these results: it is written last, and an older one may still be in its place.
    fn has_report(&self, summary: &Summary) -> bool {
        let page = std::fs::read_to_string(analyses::report_path(&self.session, Some(&self.name)));
        page.is_ok_and(|page| page.contains(&summary.results_hash))
    }

    /// Scored RMSE of the official results, if this version of the analysis made them from this content and they are valid.
    pub(crate) fn official_rmse_mm(&self) -> Option<Estimate> {
        let reader = SessionReader::open(&self.session).ok()?;
        let id = reader.session_id().ok()?;
        let seal = reader.seal().ok()?.map(|seal| seal.content_sha256());
        let summary = analyses::summary(&self.session, &id, None).ok()?;
        let is_comparable = summary.valid
            && summary.analysis_version == ANALYSIS_VERSION
            && summary.content_sha256 == seal;
        is_comparable.then_some(summary.rmse_mm)
    }

    /// True if the results have other settings, or are of another version or content.
    pub(crate) fn replaces(&self) -> bool {
        analyses::results_path(&self.session, Some(&self.name)).is_file()
    }

    fn is_of(&self, variant: &Variant) -> bool {
        let selection = |s: &SelectedPresses| s.name.sha256.clone();
        variant.changed == self.overrides
            && !variant.reference_code
            && variant.calibration_from.is_none()
            && variant.selection.as_ref().map(|s| s.sha256.clone())
                == self.selected.as_ref().map(selection)
    }

    /// Analyses the session and writes results and report beside it, unless they are there.
    pub(crate) fn answer(&self) -> Answer {
        let error = self.carry_out().err().map(Refusal::from);
        Answer { error }
    }

    fn carry_out(&self) -> Result<(), Failure> {
        let shown = self.session.display();
        if self.analysis_version != ANALYSIS_VERSION {
            return Err(Failure::internal(format!(
                "expected version {} of the analysis, found {ANALYSIS_VERSION}\n  next: install the same skinrig on every computer",
                self.analysis_version
            )));
        }
        if let Some(writer) = writer_of(&self.session) {
            return Err(Failure::input(format!(
                "{shown}: expected a session that has ended, found one that {writer} is recording\n  next: repeat the command afterwards"
            )));
        }
        if self.stored().is_some_and(|stored| stored.is_sealed) {
            return Ok(());
        }
        let own = analyses::results_path(&self.session, Some(&self.name));
        results::check_writable(&own)?;
        let found = results::analyze_session(&self.session, self.choices())?;
        // New results never stand beside an older report, even if this program is killed between the two.
        let report = analyses::report_path(&self.session, Some(&self.name));
        if let Err(e) = std::fs::remove_file(&report)
            && e.kind() != std::io::ErrorKind::NotFound
        {
            return Err(Failure::internal(format!(
                "{}: cannot replace: {e}\n  next: make the folder writable, then repeat the command",
                report.display()
            )));
        }
        results::write_results(&found, None, None)?;
        Ok(())
    }
}
