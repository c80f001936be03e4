//! Sequential comparison: after each repetition of both skins, whether the RMSE decides, with alpha spent over the looks.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;
use skinrig_analysis::result::PressResult;
use skinrig_model::{PressRole, RepetitionId, Verdict as PressVerdict};

use crate::locations::Locations;
use crate::metrics::Metric;
use crate::no_result::NoResult;
use crate::subject::{Session, Subject, sample};
use skinrig_statistics::{
    AlphaSpending, ComparisonTarget, Interval, Outlook, Sample, Settings, Verdict, compare,
};

/// One look at the data: the first repetitions of both skins, as many of each.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Look {
    /// Repetitions of each skin.
    pub repetitions: u32,
    /// Presses of A and B that count.
    pub presses: [u32; 2],
    /// Alpha spent at this look: the interval has the level 1 - alpha. 0 for a look that the sessions do not allow yet; its
    /// share passes to the first that they do.
    pub alpha: f64,
    /// Alpha spent up to this look.
    pub spent: f64,
    /// B - A in mm; valid together with all other looks.
    pub difference_mm: Option<Interval>,
    /// Verdict on B; `None` if the skins cannot be compared yet.
    pub verdict: Option<Verdict>,
    /// Reason why they cannot be compared.
    pub refused: Option<NoResult>,
}

/// All looks up to the first that decides.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SequentialComparison {
    /// How alpha is spent.
    pub spending: AlphaSpending,
    /// Alpha over all looks.
    pub alpha: f64,
    /// The looks; the last one decides if any does.
    pub looks: Vec<Look>,
    /// Complete repetitions of A and B.
    pub complete: [u32; 2],
    /// Repetitions of A and B with scored presses that were never made.
    pub incomplete: [u32; 2],
    /// Expected effect of further repetitions.
    pub outlook: Outlook,
}

impl SequentialComparison {
    /// True if each look so far was at one session of a skin that has several.
    pub(crate) fn awaits_sessions(&self) -> bool {
        let refused = |look: &Look| look.refused == Some(NoResult::OneSession);
        !self.looks.is_empty() && self.looks.iter().all(refused)
    }

    /// The look that decided.
    #[must_use]
    pub fn decision(&self) -> Option<&Look> {
        let last = self.looks.last();
        last.filter(|_| self.outlook == Outlook::Decided)
    }
}

/// Takes looks until one decides or the data end. Also returns both skins with only the presses of the last look, and the
/// settings of that look: results computed with them from these presses stay valid at any stopping time.
pub(crate) fn look(
    subjects: &[Subject; 2],
    margin: Option<f64>,
    spending: AlphaSpending,
    settings: &Settings,
) -> (SequentialComparison, [Subject; 2], Settings) {
    let repetitions = subjects.each_ref().map(Repetitions::of);
    let complete = repetitions.each_ref().map(|r| r.complete.len() as u32);
    let question = ComparisonTarget {
        better: Metric::Rmse.better(),
        margin,
    };
    let last = complete[0].min(complete[1]);
    let mut looks = Vec::new();
    let (mut outlook, mut spent, mut passed_on) = (Outlook::Unknown, 0.0, 0.0);
    let mut used = (
        first_repetitions(subjects, 0),
        spending.settings(settings, 1).unwrap_or(*settings),
    );
    for number in 1..=last {
        let Some(mut own) = spending.settings(settings, number) else {
            outlook = Outlook::Spent;
            break;
        };
        own.alpha += passed_on;
        if repetitions.iter().any(|r| !r.shows_sessions(number)) {
            looks.push(Look {
                repetitions: number,
                presses: [0; 2],
                alpha: 0.0,
                spent,
                difference_mm: None,
                verdict: None,
                refused: Some(NoResult::OneSession),
            });
            passed_on = own.alpha;
            continue;
        }
        spent += own.alpha;
        passed_on = 0.0;
        let chosen = first_repetitions(subjects, number);
        let locations = Locations::of(&chosen);
        let samples = chosen.each_ref().map(|s| {
            sample(s, &s.by_session(), |s| {
                let presses = locations.attempts(s);
                Sample::rms(presses.filter_map(|p| Some((p.location, p.error_mm()?))))
            })
        });
        let found = match samples {
            [Ok(a), Ok(b)] => compare(&a, &b, &question, &own).map_err(NoResult::from),
            [Err(fault), _] | [_, Err(fault)] => Err(NoResult::from(fault)),
        };
        if let Ok(found) = &found {
            outlook = spending.outlook(found, number, settings);
        } else if number == spending.most() {
            outlook = Outlook::Spent;
        }
        let counted = chosen.each_ref().map(|s| {
            let presses = locations.attempts(s);
            presses.filter(|p| p.error().is_some()).count() as u32
        });
        looks.push(Look {
            repetitions: number,
            presses: counted,
            alpha: own.alpha,
            spent,
            difference_mm: found.as_ref().ok().map(|c| c.difference),
            verdict: found.as_ref().ok().map(|c| c.verdict),
            refused: found.err(),
        });
        used = (chosen, own);
        if outlook == Outlook::Decided {
            break;
        }
    }
    let result = SequentialComparison {
        spending,
        alpha: settings.alpha,
        looks,
        complete,
        incomplete: repetitions.each_ref().map(|r| r.incomplete),
        outlook,
    };
    (result, used.0, used.1)
}

/// Scored repetitions of a skin, in the order in which they were made: index of the session, repetition.
struct Repetitions {
    complete: Vec<(usize, RepetitionId)>,
    incomplete: u32,
}

impl Repetitions {
    /// False if the skin has several sessions but only one of them is among the first `number` repetitions, which do not tell how
    /// much sessions vary.
    fn shows_sessions(&self, number: u32) -> bool {
        let sessions = |repetitions: &[(usize, RepetitionId)]| -> usize {
            let all: BTreeSet<usize> = repetitions.iter().map(|r| r.0).collect();
            all.len()
        };
        let first = &self.complete[..self.complete.len().min(number as usize)];
        sessions(&self.complete) < 2 || sessions(first) > 1
    }

    fn of(subject: &Subject) -> Self {
        let mut order: Vec<usize> = (0..subject.sessions.len()).collect();
        order.sort_by_key(|i| &subject.sessions[*i].facts.started);
        let (mut complete, mut incomplete) = (Vec::new(), 0);
        for session in order {
            for (repetition, is_whole) in scored_repetitions(&subject.sessions[session]) {
                if is_whole {
                    complete.push((session, repetition));
                } else {
                    incomplete += 1;
                }
            }
        }
        Self {
            complete,
            incomplete,
        }
    }
}

/// Scored repetitions of a session, and whether all of their presses were made.
pub(crate) fn scored_repetitions(session: &Session) -> BTreeMap<RepetitionId, bool> {
    let presses = session.analysis.presses.iter();
    let mut whole = BTreeMap::new();
    for press in presses.filter(|p| p.role == PressRole::Score) {
        *whole.entry(press.repetition).or_insert(true) &= press.verdict != PressVerdict::Missed;
    }
    whole
}

/// Both skins without the scored presses beyond the first `number` complete repetitions.
pub(crate) fn first_repetitions(subjects: &[Subject; 2], number: u32) -> [Subject; 2] {
    subjects.each_ref().map(|subject| {
        let all = Repetitions::of(subject).complete;
        let first = &all[..all.len().min(number as usize)];
        let mut subject = subject.clone();
        for (i, session) in subject.sessions.iter_mut().enumerate() {
            let is_used =
                |p: &PressResult| p.role != PressRole::Score || first.contains(&(i, p.repetition));
            session.analysis.presses.retain(is_used);
        }
        subject
    })
}
