//! Owns the settings by which the audit judges a recording: what an analysis makes of it with unusual settings is no fault of it, and
//! hides none.

use skinrig_model::AnalysisSettings;

use crate::input::SessionInput;
use crate::result::{Analysis, Fault, Finding, WarningCause};

/// The session of another analysis, whose findings count. How presses are seen, by windows and clusters, is that of the recording for a
/// variant of its analysis. For the recording's own settings it is the usual one, if the audit finds a fault: what they see of a press
/// may cause it. `None`: the analysis is judged by what it found.
pub(crate) fn judging_input(input: &SessionInput, analysis: &Analysis) -> Option<SessionInput> {
    let usual = AnalysisSettings::default();
    let seen = match &input.recorded_settings {
        Some(recorded) => recorded,
        None if analysis.findings.iter().any(|f| f.invalidates) => &usual,
        None => return None,
    };
    let settings = as_seen_by(&input.settings, seen);
    (settings != input.settings).then(|| SessionInput {
        settings: AnalysisSettings {
            study_presses: 0,
            ..settings
        },
        recorded_settings: None,
        ..input.clone()
    })
}

/// Takes the findings of that analysis, unless this one sees what that one only fails to see: a variant may correct windows and clusters
/// that suit no press.
pub(crate) fn take_findings(analysis: &mut Analysis, judged: Vec<Finding>) {
    let faults = |findings: &[Finding]| -> Vec<Fault> {
        let faulty = findings.iter().filter(|finding| finding.invalidates);
        faulty.map(|finding| finding.fault).collect()
    };
    let (own, others) = (faults(&analysis.findings), faults(&judged));
    if corrects(&own, &others) {
        return;
    }
    analysis.findings = judged;
    if let Some(fault) = own.first().filter(|_| others.is_empty()) {
        let cause = WarningCause::UnsuitableSettings { fault: *fault };
        analysis.warnings.insert(0, cause.into());
    }
}

/// True if an analysis with the faults `own` sees what one with the faults `others` only fails to see.
fn corrects(own: &[Fault], others: &[Fault]) -> bool {
    let sees_nothing = |fault: &Fault| {
        matches!(
            fault,
            Fault::Unknown | Fault::NotTouched | Fault::CameraBlind
        )
    };
    own.is_empty() && !others.is_empty() && others.iter().all(sees_nothing)
}

/// The settings, seeing presses as `by` does; what counts, calibration, hot pixels, crop and limits stay.
fn as_seen_by(settings: &AnalysisSettings, by: &AnalysisSettings) -> AnalysisSettings {
    AnalysisSettings {
        window_before_ms: by.window_before_ms,
        window_after_ms: by.window_after_ms,
        window_after_contact_ms: by.window_after_contact_ms,
        window_after_depth_ms: by.window_after_depth_ms,
        window_anchor: by.window_anchor,
        eps_px: by.eps_px,
        min_samples: by.min_samples,
        background_margin: by.background_margin,
        centroid: by.centroid,
        estimator: by.estimator,
        precision: by.precision,
        forget_ms: by.forget_ms,
        thinning: by.thinning,
        bin_px: by.bin_px,
        cluster_threshold: by.cluster_threshold,
        min_cluster_events: by.min_cluster_events,
        min_response_sigma: by.min_response_sigma,
        ..settings.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_seen_rebuts_only_what_is_not_seen() {
        use Fault::{CameraBlind, UnitOfPositions, Unknown};
        assert!(corrects(&[], &[Unknown]));
        assert!(corrects(&[], &[CameraBlind, Unknown]));
        // A definite fault stays, whatever other windows see.
        assert!(!corrects(&[], &[Unknown, UnitOfPositions]));
        assert!(!corrects(&[Unknown], &[Unknown]));
        assert!(!corrects(&[], &[]));
    }
}
