//! What counts: the verdict on each press, from its journal entry, its data and the rules in the settings.
//!
//! Every planned press gets exactly one verdict:
//! - *missed*: never attempted, from the journal;
//! - *invalid*: what happened is not what was planned (journal), or the data cannot say: bytes lost in the window,
//!   a camera without clock, no measured times or position;
//! - *excluded*: done and recorded, but left out by a rule that names itself. A press that the cameras did not
//!   see, or whose rays do not meet on the skin, is a failure of the skin: excluded from the error metrics, and
//!   still in the denominator of the located rate;
//! - *valid*: everything else.
//!
//! Sync presses are judged by the journal and their data only; no rule excludes them.

use skinrig_model::{AnalysisSettings, CameraId, PressOutcome, PressRole, PressVerdict};

use crate::result::{LocationOutcome, PressCounts, PressResult, PressView};

/// The verdict before any location is known.
#[must_use]
pub fn from_data(
    role: PressRole,
    outcome: Option<&PressOutcome>,
    has_clock: [bool; 2],
    data_lost: [bool; 2],
    views: &[Option<PressView>; 2],
    settings: &AnalysisSettings,
) -> PressVerdict {
    let Some(outcome) = outcome else {
        return PressVerdict::Missed("never attempted".to_owned());
    };
    if outcome.verdict != PressVerdict::Valid {
        return outcome.verdict.clone();
    }
    let invalid = |reason: &str| PressVerdict::Invalid(reason.to_owned());
    if outcome.timing.is_none() {
        return invalid("no measured times");
    }
    if outcome
        .measured_at
        .is_none_or(|p| !p.x_mm.is_finite() || !p.y_mm.is_finite())
    {
        return invalid("no measured position");
    }
    for camera in CameraId::ALL {
        if !has_clock[camera.index()] {
            return PressVerdict::Invalid(format!("no clock alignment ({camera})"));
        }
        if data_lost[camera.index()] {
            return PressVerdict::Invalid(format!("data lost in window ({camera})"));
        }
    }
    if role == PressRole::Sync {
        return PressVerdict::Valid;
    }
    for camera in CameraId::ALL {
        let view = views[camera.index()];
        let Some(view) = view.filter(|v| v.centroid_u.is_some()) else {
            return PressVerdict::Excluded(format!("no cluster ({camera})"));
        };
        if view.cluster_events < settings.min_cluster_events {
            return PressVerdict::Excluded(format!(
                "too few cluster events: {} < {} ({camera})",
                view.cluster_events, settings.min_cluster_events
            ));
        }
        if let Some(idle) = idle_events(&view).filter(|idle| {
            f64::from(view.events)
                < idle.expected + settings.min_response_sigma * idle.standard_error
        }) && settings.min_response_sigma > 0.0
        {
            return PressVerdict::Excluded(format!(
                "no response: {} events, {:.0} ± {:.0} expected at the idle rate ({camera})",
                view.events, idle.expected, idle.standard_error
            ));
        }
    }
    PressVerdict::Valid
}

/// What a camera would have sent in the press window without a press.
struct IdleEvents {
    expected: f64,
    standard_error: f64,
}

/// The prediction from the idle time before the press, with Poisson noise in both: over a window `w` and an idle
/// time `i` the difference of the counts scatters by `sqrt(expected (1 + w / i))`. `None` without idle time.
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

/// The rule that leaves a valid press out because of where its rays meet, if any.
#[must_use]
pub fn location_rule(outcome: &LocationOutcome, settings: &AnalysisSettings) -> Option<String> {
    match *outcome {
        LocationOutcome::Missing => Some("no view".to_owned()),
        LocationOutcome::Parallel { .. } => Some("parallel rays".to_owned()),
        LocationOutcome::Behind { .. } => Some("behind camera".to_owned()),
        LocationOutcome::Located { sine, .. } | LocationOutcome::Outside { sine, .. }
            if sine.abs() < settings.min_ray_sine =>
        {
            Some(format!(
                "nearly parallel rays: sine {:.4} < {}",
                sine.abs(),
                settings.min_ray_sine
            ))
        }
        LocationOutcome::Outside { .. } if settings.exclude_outside => {
            Some("outside the skin outline".to_owned())
        }
        LocationOutcome::Located { .. } | LocationOutcome::Outside { .. } => None,
    }
}

/// Writes a verdict into a row.
pub fn put(row: &mut PressResult, verdict: &PressVerdict) {
    row.verdict = verdict.name().to_owned();
    row.reason = verdict.reason().map(str::to_owned);
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
        match press.verdict.as_str() {
            "valid" => counts.valid += 1,
            "missed" => counts.missed += 1,
            "invalid" => counts.invalid += 1,
            _ => counts.excluded += 1,
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
            rule(LocationOutcome::Located { at, sine: -0.0499 }, &settings).as_deref(),
            Some("nearly parallel rays: sine 0.0499 < 0.05")
        );
        let outside = LocationOutcome::Outside { at, sine: 0.5 };
        assert_eq!(
            rule(outside, &settings).as_deref(),
            Some("outside the skin outline")
        );
        settings.exclude_outside = false;
        assert_eq!(rule(outside, &settings), None);
        assert_eq!(
            rule(LocationOutcome::Behind { sine: 0.5 }, &settings).as_deref(),
            Some("behind camera")
        );
        assert_eq!(
            rule(LocationOutcome::Parallel { sine: 0.0 }, &settings).as_deref(),
            Some("parallel rays")
        );
    }

    #[test]
    fn a_cluster_of_just_enough_events_is_enough() {
        let settings = AnalysisSettings::default();
        let outcome = PressOutcome {
            attempt: skinrig_model::AttemptId {
                press: skinrig_model::PressId(0),
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
        assert_eq!(judge(PressRole::Score, 33, 33), PressVerdict::Valid);
        assert_eq!(
            judge(PressRole::Score, 33, 32),
            PressVerdict::Excluded(
                "no response: 32 events, 10 ± 4 expected at the idle rate (camera 2)".to_owned()
            )
        );
        assert_eq!(
            judge(PressRole::Calibrate, 33, 19),
            PressVerdict::Excluded("too few cluster events: 19 < 20 (camera 2)".to_owned())
        );
        assert_eq!(judge(PressRole::Sync, 0, 0), PressVerdict::Valid);
    }
}
