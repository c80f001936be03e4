//! Failures during a run: attempts by cause, failures in a row, lost camera bytes.

use serde::Serialize;
use skinrig_model::{CameraId, HostTime, PlannedPress, PressFaultKind, PressOutcome, PressVerdict};
use skinrig_recorder::{AttemptRow, RecorderError, SessionReader};

/// Number of latest presses named for a cause.
const NAMED: usize = 4;

/// An attempt that ended.
#[derive(Debug, Clone, Copy)]
pub(super) struct EndedAttempt<'a> {
    pub began: Option<HostTime>,
    pub planned: &'a PlannedPress,
    pub outcome: &'a PressOutcome,
    /// True if a later attempt at the same press is valid.
    pub is_made_good: bool,
}

/// The attempts that ended, oldest first, without missed presses.
pub(super) fn ended(presses: &[(PlannedPress, Vec<AttemptRow>)]) -> Vec<EndedAttempt<'_>> {
    let is_valid = |a: &AttemptRow| {
        let verdict = a.outcome.as_ref().map(|o| &o.verdict);
        matches!(verdict, Some(PressVerdict::Valid))
    };
    let of_press = |(planned, attempts)| {
        let attempts: &Vec<AttemptRow> = attempts;
        let good = attempts.iter().rposition(is_valid);
        attempts.iter().enumerate().filter_map(move |(i, a)| {
            Some(EndedAttempt {
                began: a.intent,
                planned,
                outcome: a.outcome.as_ref()?,
                is_made_good: good.is_some_and(|good| good > i),
            })
        })
    };
    let mut all: Vec<EndedAttempt<'_>> = presses
        .iter()
        .map(|(planned, attempts)| (planned, attempts))
        .flat_map(of_press)
        .filter(|a| !matches!(a.outcome.verdict, PressVerdict::Missed(_)))
        .collect();
    // By start, which every attempt has: a further leg repeats presses, and a failed attempt may have no other time.
    all.sort_by_key(|a| a.began);
    all
}

/// Invalid attempts of one cause.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Failure {
    /// Kinds of their faults.
    pub kinds: Vec<PressFaultKind>,
    /// Reason of the latest one, in words.
    pub reason: String,
    /// Number of attempts.
    pub attempts: usize,
    /// How many of them a later attempt has made good.
    pub made_good: usize,
    /// The latest presses, as numbers in the plan.
    pub presses: Vec<u32>,
}

/// Invalid attempts by cause, most frequent first.
pub(super) fn failures(ended: &[EndedAttempt<'_>]) -> Vec<Failure> {
    let mut all: Vec<Failure> = Vec::new();
    for attempt in ended {
        let PressVerdict::Invalid(reason) = &attempt.outcome.verdict else {
            continue;
        };
        let kinds = reason.kinds();
        let index = all.iter().position(|f| f.kinds == kinds);
        let index = index.unwrap_or_else(|| {
            all.push(Failure {
                kinds,
                reason: String::new(),
                attempts: 0,
                made_good: 0,
                presses: Vec::new(),
            });
            all.len() - 1
        });
        let failure = &mut all[index];
        failure.reason = reason.to_string();
        failure.attempts += 1;
        failure.made_good += usize::from(attempt.is_made_good);
        let press = attempt.planned.id.number();
        failure.presses.retain(|p| *p != press);
        failure.presses.push(press);
        if failure.presses.len() > NAMED {
            failure.presses.remove(0);
        }
    }
    all.sort_by_key(|f| std::cmp::Reverse(f.attempts));
    all
}

/// Number of invalid attempts since the last other one.
pub(super) fn failures_in_a_row(ended: &[EndedAttempt<'_>]) -> usize {
    let newest = ended.iter().rev();
    newest
        .take_while(|a| matches!(a.outcome.verdict, PressVerdict::Invalid(_)))
        .count()
}

/// Lost bytes of a camera, in the session file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(super) struct CameraLoss {
    /// Bytes.
    pub bytes: u64,
    /// Number of gaps in the stream.
    pub gaps: usize,
    /// Length of all gaps on the camera's clock, µs; `None` if an end is unknown.
    pub lost_us: Option<u64>,
}

/// Losses of both cameras.
///
/// # Errors
/// If the file is damaged.
pub(super) fn losses(reader: &SessionReader) -> Result<[CameraLoss; 2], RecorderError> {
    let of = |camera| {
        let losses = reader.losses(camera)?;
        let length = |loss: &skinrig_recorder::Loss| {
            let (from, to) = (loss.time.from_us?, loss.time.to_us?);
            Some(to.saturating_sub(from))
        };
        Ok(CameraLoss {
            bytes: losses.iter().map(|l| l.bytes).sum(),
            gaps: losses.len(),
            lost_us: losses.iter().map(length).sum(),
        })
    };
    let [one, two] = CameraId::ALL;
    Ok([of(one)?, of(two)?])
}
