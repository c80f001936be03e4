//! Law: all data of such a session exist, and the journal is consistent.

use std::collections::BTreeSet;

use skinrig_model::{CameraId, PressRole, PressVerdict};

use super::finding::finding;
use super::observed_press::is_number;
use crate::input::SessionInput;
use crate::result::{
    Analysis, ClockMethod, Evidence, Fault, Finding, Law, SeenMarks, WarningCause,
};

/// Largest share of planned but never attempted presses in a complete session.
const MAX_MISSED: f64 = 0.1;
/// Largest share of attempted presses without a measured time or position.
const MAX_WITHOUT_TRUTH: f64 = 0.2;
/// Largest share of events that come after later ones; a camera sends none.
const MAX_LATE: f64 = 0.01;
/// Smallest share of sent marks that a clock fit can use if the trigger line works.
const MIN_MARKS: f64 = 0.5;

pub(super) fn findings(input: &SessionInput, analysis: &Analysis) -> Vec<Finding> {
    let mut found = Vec::new();
    found.extend(contradiction(input));
    found.extend(events(analysis));
    found.extend(
        CameraId::ALL
            .into_iter()
            .filter_map(|camera| disorder(analysis, camera)),
    );
    found.extend(truth(input));
    found.extend(missed(input));
    found.extend(triggers(input, analysis));
    found
}

/// Impossible times: out of order, before the session, or overlapping presses.
fn contradiction(input: &SessionInput) -> Option<Finding> {
    let mut spans = Vec::new();
    let (mut disordered, mut negative) = (0u32, 0u32);
    for outcome in input.outcomes.iter().flatten() {
        let Some(t) = outcome.timing else { continue };
        let moments = [
            t.approach, t.contact, t.at_depth, t.retract, t.release, t.clear,
        ];
        negative += u32::from(t.approach.0 < 0);
        disordered += u32::from(moments.windows(2).any(|w| w[0] > w[1]) || t.contact == t.release);
        spans.push((t.contact, t.release));
    }
    spans.sort_unstable();
    let overlapping = spans.windows(2).filter(|w| w[1].0 < w[0].1 || w[0] == w[1]);
    let overlapping = overlapping.count();
    let distinct: BTreeSet<u32> = input.planned.iter().map(|p| p.id.index()).collect();
    let doubled = input.planned.len() - distinct.len();
    if disordered == 0 && negative == 0 && overlapping == 0 && doubled == 0 {
        return None;
    }
    let evidence = Evidence::JournalContradictory {
        presses: spans.len(),
        disordered,
        negative,
        overlapping,
        doubled,
    };
    Some(finding(
        Law::Complete,
        Fault::JournalContradictory,
        None,
        evidence,
    ))
}

fn events(analysis: &Analysis) -> Vec<Finding> {
    let counted = |camera: CameraId| {
        let series = &analysis.rates[camera.index()].mean_per_s;
        series.iter().any(|rate| *rate > 0.0)
    };
    let elsewhere = |camera: CameraId| {
        let activity = analysis.activity.iter().find(|a| a.camera == camera);
        activity.map_or(0, |a| a.counts.iter().sum::<u64>())
    };
    let silent: Vec<CameraId> = CameraId::ALL.into_iter().filter(|c| !counted(*c)).collect();
    if silent.len() == 2 && silent.iter().all(|c| elsewhere(*c) == 0) {
        let evidence = Evidence::NoEventsOfEither;
        return vec![finding(Law::Complete, Fault::NoEvents, None, evidence)];
    }
    let named = silent.into_iter().map(|camera| {
        let (first, last) = analysis.settings.crop_v[camera.index()];
        match elsewhere(camera) {
            0 => finding(
                Law::Complete,
                Fault::NoEvents,
                Some(camera),
                Evidence::NoEvents { camera },
            ),
            others => finding(
                Law::Complete,
                Fault::CameraBlind,
                Some(camera),
                Evidence::NoEventsInCrop {
                    camera,
                    first_row: first,
                    last_row: last,
                    elsewhere: others,
                },
            ),
        }
    });
    named.collect()
}

/// Events that came too late for their windows.
fn disorder(analysis: &Analysis, camera: CameraId) -> Option<Finding> {
    let own = analysis
        .warnings
        .iter()
        .filter(|w| w.camera == Some(camera));
    let (late, limit_ms) = own.into_iter().find_map(|w| match w.cause {
        WarningCause::EventsOutOfOrder { events, limit_ms } => Some((events, limit_ms)),
        _ => None,
    })?;
    let activity = analysis.activity.iter().find(|a| a.camera == camera)?;
    let events: u64 = activity.counts.iter().sum();
    (late as f64 > MAX_LATE * events as f64).then(|| {
        let evidence = Evidence::EventsOutOfOrder {
            camera,
            late,
            events,
            limit_ms,
        };
        let fault = Fault::EventsOutOfOrder;
        finding(Law::Complete, fault, Some(camera), evidence)
    })
}

fn truth(input: &SessionInput) -> Option<Finding> {
    let attempted = || {
        let outcomes = input.outcomes.iter().flatten();
        outcomes.filter(|o| o.verdict == PressVerdict::Valid)
    };
    let n = attempted().count();
    let without = |lacks: &dyn Fn(&skinrig_model::PressOutcome) -> bool| {
        attempted().filter(|o| lacks(o)).count()
    };
    let positions = without(&|o| !o.measured_at.is_some_and(is_number));
    let times = without(&|o| o.timing.is_none());
    let too_many = |count: usize| count as f64 > MAX_WITHOUT_TRUTH * n as f64;
    (too_many(positions) || too_many(times)).then(|| {
        let evidence = Evidence::NoTruth {
            presses: n,
            without_position: positions,
            without_times: times,
        };
        finding(Law::Complete, Fault::NoTruth, None, evidence)
    })
}

fn missed(input: &SessionInput) -> Option<Finding> {
    let rows = input.planned.iter().zip(&input.outcomes);
    let rows = rows.filter(|(p, _)| p.role != PressRole::Sync);
    let (mut planned, mut missed) = (0u32, 0u32);
    for (_, outcome) in rows {
        let verdict = outcome.as_ref().map(|o| &o.verdict);
        if verdict.is_some_and(PressVerdict::is_unneeded) {
            continue;
        }
        planned += 1;
        missed += u32::from(matches!(verdict, None | Some(PressVerdict::Missed(_))));
    }
    (planned == 0 || f64::from(missed) > MAX_MISSED * f64::from(planned)).then(|| {
        let evidence = if planned == 0 {
            Evidence::NoPlannedPress
        } else {
            Evidence::PressesMissed { planned, missed }
        };
        finding(Law::Complete, Fault::PressesMissing, None, evidence)
    })
}

/// Marks were sent, but hardly any arrived.
fn triggers(input: &SessionInput, analysis: &Analysis) -> Vec<Finding> {
    let Some(channel) = input.rig.trigger_channel else {
        return Vec::new();
    };
    let sent = input.marks.len();
    if sent == 0 {
        return Vec::new();
    }
    let lost = |camera: CameraId| {
        let clock = analysis.clocks[camera.index()];
        let used = clock.filter(|c| c.method != ClockMethod::EventRates);
        let used = used.map_or(0, |c| c.n);
        let edges = input.edges[camera.index()].iter();
        let edges = edges.filter(|e| e.channel == channel).count();
        (f64::from(used) < MIN_MARKS * sent as f64).then_some(SeenMarks {
            camera,
            edges,
            usable_marks: used,
        })
    };
    let seen: Vec<SeenMarks> = CameraId::ALL.into_iter().filter_map(lost).collect();
    let camera = match seen[..] {
        [] => return Vec::new(),
        [alone] => Some(alone.camera),
        _ => None,
    };
    let evidence = Evidence::MarksLost {
        sent,
        channel,
        seen,
    };
    vec![finding(Law::Complete, Fault::NoTriggers, camera, evidence)]
}
