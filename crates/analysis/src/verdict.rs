//! Decides which presses count: the verdict on each press, from its journal entry, its data and the rules in the settings.
//!
//! Every planned press gets exactly one verdict:
//! - *missed*: never attempted, from the journal;
//! - *invalid*: not executed as planned (journal), or undecidable from the data: lost bytes in the window, a camera without
//!   a clock or with none near the press, no measured times or position;
//! - *excluded*: executed and recorded, but excluded by a named rule. A press that the cameras did not see, or whose rays do
//!   not meet on the skin, is a failure of the skin: excluded from the error metrics, but still in the denominator of the
//!   located rate;
//! - *valid*: everything else.
//!
//! Only the journal and the data decide on sync presses; no rule excludes them.

use skinrig_model::{
    AnalysisSettings, CameraId, MissedReason, PressOutcome, PressRole, PressVerdict, Verdict,
};

use crate::check;
use crate::exclusion::Exclusion;
use crate::result::{
    CommonExclusion, Estimate, LocationOutcome, PressCounts, PressResult, PressView, Warning,
    WarningCause,
};
use crate::rule::Rule;
use crate::tie::UntimedPress;

/// A verdict and its cause.
#[derive(Debug, Clone, PartialEq)]
pub struct Judgement {
    /// The verdict.
    pub verdict: Verdict,
    /// Why the press does not count; `None` if valid.
    pub cause: Option<Exclusion>,
}

impl Judgement {
    const VALID: Self = Self {
        verdict: Verdict::Valid,
        cause: None,
    };

    const fn invalid(cause: Exclusion) -> Self {
        Self {
            verdict: Verdict::Invalid,
            cause: Some(cause),
        }
    }

    const fn excluded(cause: Exclusion) -> Self {
        Self {
            verdict: Verdict::Excluded,
            cause: Some(cause),
        }
    }

    /// Excluded by hand or by a selection, unless the press is missed or invalid anyway.
    #[must_use]
    pub(crate) fn or_left_out(self, why: Exclusion) -> Self {
        match self.verdict {
            Verdict::Missed | Verdict::Invalid => self,
            Verdict::Valid | Verdict::Excluded => Self::excluded(why),
        }
    }

    /// Invalid because a camera's clock is unknown at the press, unless it is missed or invalid anyway.
    #[must_use]
    pub(crate) fn or_untimed(self, camera: CameraId, nearest: UntimedPress) -> Self {
        match self.verdict {
            Verdict::Missed | Verdict::Invalid => self,
            Verdict::Valid | Verdict::Excluded => {
                Self::invalid(Exclusion::NotTimed { camera, nearest })
            }
        }
    }

    /// Verdict of the journal.
    fn from_journal(verdict: PressVerdict) -> Self {
        Self {
            verdict: verdict.kind(),
            cause: Exclusion::of_journal(verdict),
        }
    }
}

/// Verdict before any location is known.
#[must_use]
pub fn from_data(
    role: PressRole,
    outcome: Option<&PressOutcome>,
    has_clock: [bool; 2],
    data_lost: [bool; 2],
    views: &[Option<PressView>; 2],
    settings: &AnalysisSettings,
) -> Judgement {
    let Some(outcome) = outcome else {
        return Judgement::from_journal(PressVerdict::Missed(MissedReason::NeverAttempted));
    };
    if outcome.verdict != PressVerdict::Valid {
        return Judgement::from_journal(outcome.verdict.clone());
    }
    if outcome.timing.is_none() {
        return Judgement::invalid(Exclusion::NoTimes);
    }
    if outcome.measured_at.is_none_or(|p| !check::is_place(&p)) {
        return Judgement::invalid(Exclusion::NoPosition);
    }
    for camera in CameraId::ALL {
        if !has_clock[camera.index()] {
            return Judgement::invalid(Exclusion::NoClock { camera });
        }
        if data_lost[camera.index()] {
            return Judgement::invalid(Exclusion::DataLost { camera });
        }
    }
    if role == PressRole::Sync {
        return Judgement::VALID;
    }
    for camera in CameraId::ALL {
        let view = views[camera.index()];
        let Some(view) = view.filter(|v| v.centroid_u.is_some()) else {
            return Judgement::excluded(Exclusion::NoCluster { camera });
        };
        if let Some(judgement) = too_few_cluster_events(&view, settings.min_cluster_events, camera)
        {
            return judgement;
        }
        if let Some(idle) = idle_events(&view).filter(|idle| {
            f64::from(view.events)
                < idle.expected + settings.min_response_sigma * idle.standard_error
        }) && settings.min_response_sigma > 0.0
        {
            return Judgement::excluded(Exclusion::NoResponse {
                camera,
                found: view.events,
                expected: idle.expected,
                standard_error: idle.standard_error,
            });
        }
    }
    Judgement::VALID
}

/// The rule that excludes a press with fewer than `least` clustered events in `camera`.
#[must_use]
pub(crate) fn too_few_cluster_events(
    view: &PressView,
    least: u32,
    camera: CameraId,
) -> Option<Judgement> {
    (view.cluster_events < least).then(|| {
        Judgement::excluded(Exclusion::FewClusterEvents {
            camera,
            found: view.cluster_events,
            least,
        })
    })
}

/// Expected events of a camera in the press window without a press.
struct IdleEvents {
    expected: f64,
    standard_error: f64,
}

/// Prediction from the idle time before the press, with Poisson noise in both: over a window `w` and an idle time `i` the
/// difference of the counts scatters by `sqrt(expected (1 + w / i))`. `None` without idle time.
fn idle_events(view: &PressView) -> Option<IdleEvents> {
    if !(view.idle_s > 0.0 && view.rate_per_s > 0.0) {
        return None;
    }
    let window_s = f64::from(view.events) / view.rate_per_s;
    let expected = view.idle_rate_per_s * window_s;
    let standard_error = (expected * (1.0 + window_s / view.idle_s)).sqrt();
    Some(IdleEvents {
        expected,
        standard_error,
    })
}

/// The rule that excludes a valid press because of where its rays meet, if any.
#[must_use]
pub(crate) fn location_rule(
    outcome: &LocationOutcome,
    settings: &AnalysisSettings,
) -> Option<Judgement> {
    let cause = match *outcome {
        LocationOutcome::Missing => Exclusion::NoView,
        LocationOutcome::Parallel { .. } => Exclusion::ParallelRays,
        LocationOutcome::Behind { .. } => Exclusion::BehindCamera,
        LocationOutcome::Located { sine, .. } | LocationOutcome::Outside { sine, .. }
            if sine.abs() < settings.min_ray_sine =>
        {
            Exclusion::NearlyParallelRays {
                sine: sine.abs(),
                least: settings.min_ray_sine,
            }
        }
        LocationOutcome::Outside { .. } if settings.exclude_outside => Exclusion::OutsideOutline,
        LocationOutcome::Located { .. } | LocationOutcome::Outside { .. } => return None,
    };
    Some(Judgement::excluded(cause))
}

/// True for a press that was executed as planned, whether or not the cameras saw it: valid, or excluded by a rule on the
/// data. Exclusions by the journal or by hand say nothing about the skin.
#[must_use]
pub(crate) fn is_done_as_planned(press: &PressResult) -> bool {
    press.verdict == Verdict::Valid || press.rule().is_some_and(|rule| rule.is_on_data())
}

/// Writes a verdict into a row.
pub fn put(row: &mut PressResult, judgement: Judgement) {
    row.verdict = judgement.verdict;
    row.cause = judgement.cause;
}

/// A warning if the headline depends on the exclusions: the RMSE of all located presses is outside the 95 % interval of the
/// RMSE of those that count (or differs at all, without an interval), or nothing counts. `rmse`: with and without
/// exclusions.
#[must_use]
pub(crate) fn exclusion_warning(presses: &[PressResult], rmse: [&Estimate; 2]) -> Option<Warning> {
    let [with, without] = rmse;
    let all = without.value?;
    let beyond_interval = match (with.value, with.low, with.high) {
        (Some(_), Some(low), Some(high)) if all < low || all > high => true,
        (Some(value), None, _) | (Some(value), _, None) if all != value => false,
        (None, ..) => false,
        _ => return None,
    };
    let mut causes: Vec<(Rule, &Exclusion)> = presses
        .iter()
        .filter(|p| p.role == PressRole::Score && p.error_mm().is_some())
        .filter_map(|p| p.cause.as_ref().map(|cause| (cause.rule(), cause)))
        .collect();
    causes.sort_by(|a, b| a.0.cmp(&b.0));
    let most_common = causes
        .chunk_by(|a, b| a.0 == b.0)
        .max_by_key(|group| group.len())
        .map(|group| CommonExclusion {
            presses: group.len(),
            example: group[0].1.clone(),
        });
    let cause = WarningCause::ExclusionsMatter {
        excluded: without.n.saturating_sub(with.n),
        located: without.n,
        most_common,
        rmse_of_all_mm: all,
        rmse_mm: with.value,
        beyond_interval,
    };
    Some(cause.into())
}

/// A warning if no press gives a number: no scored one, or none at all of a plan that only calibrates.
#[must_use]
pub(crate) fn nothing_counts(presses: &[PressResult]) -> Option<Warning> {
    let of = |role: PressRole| {
        let presses = presses.iter().filter(move |p| p.role == role);
        presses.map(|p| p.verdict).collect::<Vec<_>>()
    };
    let scored = of(PressRole::Score);
    let all = if scored.is_empty() {
        of(PressRole::Calibrate)
    } else {
        scored
    };
    let number = |verdict| all.iter().filter(|v| **v == verdict).count() as u32;
    (number(Verdict::Valid) == 0).then(|| {
        let cause = WarningCause::NothingCounts {
            planned: all.len() as u32,
            missed: number(Verdict::Missed),
            invalid: number(Verdict::Invalid),
            excluded: number(Verdict::Excluded),
        };
        cause.into()
    })
}

/// Counts the verdicts.
#[must_use]
pub fn count(presses: &[PressResult]) -> PressCounts {
    let mut counts = PressCounts::default();
    for press in presses {
        if press.role == PressRole::Sync {
            counts.sync += 1;
            continue;
        }
        counts.planned += 1;
        match press.verdict {
            Verdict::Valid => counts.valid += 1,
            Verdict::Missed => counts.missed += 1,
            Verdict::Invalid => counts.invalid += 1,
            Verdict::Excluded => counts.excluded += 1,
        }
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;
    use skinrig_model::Point2;

    #[test]
    fn location_rules_have_sharp_borders() {
        let mut settings = AnalysisSettings::default();
        let at = Point2::new(10.0, 2.0);
        let rule = |outcome: LocationOutcome, s: &AnalysisSettings| location_rule(&outcome, s);
        assert_eq!(
            rule(LocationOutcome::Located { at, sine: -0.05 }, &settings),
            None
        );
        assert_eq!(
            rule(LocationOutcome::Located { at, sine: -0.0499 }, &settings),
            Some(Judgement::excluded(Exclusion::NearlyParallelRays {
                sine: 0.0499,
                least: 0.05
            }))
        );
        let rule = |outcome: LocationOutcome, s: &AnalysisSettings| {
            rule(outcome, s)?.cause.map(|c| c.rule())
        };
        let outside = LocationOutcome::Outside { at, sine: 0.5 };
        assert_eq!(rule(outside, &settings), Some(Rule::OutsideOutline));
        settings.exclude_outside = false;
        assert_eq!(rule(outside, &settings), None);
        assert_eq!(
            rule(LocationOutcome::Behind { sine: 0.5 }, &settings),
            Some(Rule::BehindCamera)
        );
        assert_eq!(
            rule(LocationOutcome::Parallel { sine: 0.0 }, &settings),
            Some(Rule::ParallelRays)
        );
    }

    #[test]
    fn a_cluster_of_just_enough_events_is_enough() {
        let settings = AnalysisSettings::default();
        let outcome = PressOutcome {
            attempt: skinrig_model::AttemptId {
                press: skinrig_model::PressId::from_index(0),
                number: 1,
            },
            verdict: PressVerdict::Valid,
            timing: Some(skinrig_model::PressTiming {
                approach: skinrig_model::HostTime(0),
                contact: skinrig_model::HostTime(1),
                at_depth: skinrig_model::HostTime(2),
                retract: skinrig_model::HostTime(3),
                release: skinrig_model::HostTime(4),
                clear: skinrig_model::HostTime(5),
            }),
            measured_at: Some(Point2::new(10.0, 2.0)),
            measured_depth_mm: None,
            touched_mm: None,
            peak_force_n: None,
            scheduled: false,
        };
        // A window of 0.5 s after 0.5 s of idle time with 10 events.
        let view = |events: u32| {
            Some(PressView {
                events,
                on_events: 0,
                clusters: 1,
                cluster_events: events,
                centroid_u: Some(320.0),
                centroid_v: Some(270.0),
                rate_per_s: f64::from(events) / 0.5,
                idle_rate_per_s: 20.0,
                idle_s: 0.5,
                spread_u: None,
                spread_v: None,
                width_u: None,
                core_threshold: None,
            })
        };
        let judge = |role, first, second| {
            let views = [view(first), view(second)];
            from_data(
                role,
                Some(&outcome),
                [true; 2],
                [false; 2],
                &views,
                &settings,
            )
        };
        // 10 expected, standard error sqrt(20): the rule needs 32.4.
        assert_eq!(judge(PressRole::Score, 33, 33), Judgement::VALID);
        assert_eq!(
            judge(PressRole::Score, 33, 32),
            Judgement::excluded(Exclusion::NoResponse {
                camera: CameraId::Two,
                found: 32,
                expected: 10.0,
                standard_error: 20f64.sqrt(),
            })
        );
        assert_eq!(
            judge(PressRole::Calibrate, 33, 19),
            Judgement::excluded(Exclusion::FewClusterEvents {
                camera: CameraId::Two,
                found: 19,
                least: 20,
            })
        );
        assert_eq!(judge(PressRole::Sync, 0, 0), Judgement::VALID);
        let by_hand = judge(PressRole::Score, 33, 33).or_left_out(Exclusion::ByHand);
        assert_eq!(by_hand.cause, Some(Exclusion::ByHand));
        let lost = Judgement::invalid(Exclusion::DataLost {
            camera: CameraId::One,
        });
        assert_eq!(lost.clone().or_left_out(Exclusion::ByHand), lost);
    }

    #[test]
    fn exclusions_that_make_the_headline_are_called_out() {
        let estimate = |value: Option<f64>, n: u32, ends: Option<(f64, f64)>| Estimate {
            value,
            low: ends.map(|e| e.0),
            high: ends.map(|e| e.1),
            n,
        };
        let weight =
            |a: &Estimate, b: &Estimate| exclusion_warning(&[], [a, b]).map(|w| w.to_string());
        let with = estimate(Some(0.17), 90, Some((0.16, 0.18)));
        let all = |value| estimate(Some(value), 100, None);
        assert_eq!(weight(&with, &all(0.175)), None);
        assert_eq!(
            weight(&with, &all(5.43)).as_deref(),
            Some(
                "the RMSE depends on the exclusions: excluding 10 of 100 located presses changes it \
                 from 5.43 mm to 0.17 mm, more than its 95 % interval"
            )
        );
        let nothing = estimate(None, 0, None);
        assert!(weight(&nothing, &all(5.43)).is_some_and(|w| w.ends_with("to nothing")));
        assert_eq!(weight(&nothing, &nothing), None);
        assert_eq!(weight(&all(5.43), &all(5.43)), None);
    }
}
