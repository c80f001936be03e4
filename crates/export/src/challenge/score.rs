//! Scores a table of estimates against the answers, with the metrics and intervals of an analysis.

use std::collections::BTreeSet;
use std::fs::File;
use std::path::Path;

use serde::Serialize;
use skinrig_analysis::metrics::{Exclusions, metrics, share_over_locations};
use skinrig_analysis::result::{Estimate, LocationOutcome, Metrics, PressResult};
use skinrig_analysis::sets::ScoreSet;
use skinrig_model::{LocationId, Point2, PressId, PressRole, RepetitionId, Verdict};

use super::DESCRIPTION;
use super::answers::{Answer, Answers, ChallengeSelection};
use super::error::ChallengeError;
use super::estimates::{Estimates, Position};
use super::make::Description;

/// No session has more presses.
const MOST_PRESSES: u32 = 10_000_000;

/// How good a table of estimates is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judgement {
    /// Presses to locate.
    pub presses: u32,
    /// Errors of the located presses, with intervals over locations.
    pub metrics: Metrics,
    /// Share of the located presses within their stated 95 % regions; `None` for a table without regions.
    pub coverage: Option<Estimate>,
    /// The selection behind the challenge.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub selection: Option<ChallengeSelection>,
}

/// Scores the table `table` for the challenge in `folder`.
///
/// # Errors
/// [`ChallengeError`] for a folder or answers that are not those of a challenge, and for a refused table.
pub fn score(folder: &Path, table: &Path, answers: &Path) -> Result<Judgement, ChallengeError> {
    let description = Description::read(folder)?;
    let answers = Answers::read(answers, &description.answers_sha256)?;
    let refused = |error| ChallengeError::Table {
        path: table.to_owned(),
        error,
    };
    let file = File::open(table).map_err(crate::ExportError::file(table))?;
    let numbers: BTreeSet<u32> = answers.presses.iter().map(|a| a.press).collect();
    let scored: Vec<u32> = numbers.iter().copied().collect();
    let given = 1..=presses(folder, &description, &numbers)?;
    let calibrating: Vec<u32> = given.filter(|press| !numbers.contains(press)).collect();
    let estimates =
        Estimates::read(file, &scored, &calibrating, &answers.outline).map_err(refused)?;
    Ok(judge(&answers, &estimates))
}

/// Number of presses of a challenge, whose description must agree with the answers: both were made from one list.
fn presses(
    folder: &Path,
    description: &Description,
    answers: &BTreeSet<u32>,
) -> Result<u32, ChallengeError> {
    let Description {
        calibrating,
        scored,
        ..
    } = *description;
    let total = calibrating.checked_add(scored);
    let last = answers.last().copied();
    let agrees = |total: &u32| {
        answers.len() == scored as usize && *total <= MOST_PRESSES && last <= Some(*total)
    };
    total.filter(agrees).ok_or_else(|| ChallengeError::NotAChallenge {
        path: folder.join(DESCRIPTION),
        expected: "the numbers of presses that the answers have",
        found: format!(
            "{calibrating} calibrating and {scored} scored for {} answers, the last of press {}",
            answers.len(),
            last.unwrap_or_default()
        ),
    })
}

/// Scores estimates.
pub(super) fn judge(answers: &Answers, estimates: &Estimates) -> Judgement {
    let found = |answer: &Answer| estimates.presses.get(&answer.press).copied().flatten();
    let rows: Vec<PressResult> = answers.presses.iter().map(|a| row(a, found(a))).collect();
    let set = ScoreSet::from_presses(&rows, &[]);
    let (resamples, seed) = (answers.bootstrap_resamples, answers.seed);
    let inside: Vec<(u32, bool)> = answers
        .presses
        .iter()
        .filter_map(|answer| {
            let Position { at, region } = found(answer)?;
            let error = [at[0] - answer.x_mm, at[1] - answer.y_mm];
            Some((answer.location, region?.reach(error) <= 1.0))
        })
        .collect();
    Judgement {
        presses: answers.presses.len() as u32,
        metrics: metrics(
            &set,
            Exclusions::Applied,
            &answers.outline,
            answers.within_mm,
            resamples,
            seed,
        ),
        coverage: estimates
            .has_regions
            .then(|| share_over_locations(&inside, resamples, seed)),
        selection: answers.selection.clone(),
    }
}

/// A press as the metrics of an analysis take it.
fn row(answer: &Answer, found: Option<Position>) -> PressResult {
    let truth = Point2::new(answer.x_mm, answer.y_mm);
    PressResult {
        press: PressId::from_index(answer.press),
        role: PressRole::Score,
        repetition: RepetitionId::from_index(0),
        location: LocationId::from_index(answer.location),
        planned: truth,
        depth_mm: answer.depth_mm,
        truth: Some(truth),
        verdict: Verdict::Valid,
        cause: None,
        timing: None,
        views: [None; 2],
        location_outcome: found.map_or(LocationOutcome::Missing, |p| LocationOutcome::Located {
            at: Point2::new(p.at[0], p.at[1]),
            sine: 1.0,
        }),
        region: found.and_then(|p| p.region),
        extrapolated: false,
    }
}
