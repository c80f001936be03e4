//! Owns the settings by which the audit judges a recording: what an analysis makes of it with unusual settings is no fault of it, and
//! hides none.

use skinrig_model::AnalysisSettings;

use crate::input::SessionInput;
use crate::result::{Analysis, Finding, WarningCause};

/// Settings for another analysis, whose findings count.
pub(crate) struct JudgingSettings(AnalysisSettings);

impl JudgingSettings {
    /// A variant is judged by the settings of the recording. The recording's own settings count as they are, unless the audit then
    /// finds a fault: what they see of a press may cause it, so it must be found with the defaults too. `None`: the analysis is judged by
    /// what it found.
    pub(crate) fn of(input: &SessionInput, analysis: &Analysis) -> Option<Self> {
        let own = &input.settings;
        let judging = match &input.recorded_settings {
            Some(recorded) => recorded.clone(),
            None if analysis.findings.iter().any(|f| f.invalidates) => as_usually_seen(own),
            None => return None,
        };
        let judging = AnalysisSettings {
            exclude_press_numbers: own.exclude_press_numbers.clone(),
            exclude_presses: own.exclude_presses.clone(),
            selected_out: own.selected_out.clone(),
            study_presses: 0,
            ..judging
        };
        (observing(&judging) != observing(own)).then_some(Self(judging))
    }

    /// The session with these settings, as if it had been recorded with them.
    pub(crate) fn input(&self, input: &SessionInput) -> SessionInput {
        SessionInput {
            settings: self.0.clone(),
            recorded_settings: None,
            ..input.clone()
        }
    }

    /// Takes the findings of that analysis; `None`: it failed, and the analysis keeps its own.
    pub(crate) fn apply(&self, analysis: &mut Analysis, judged: Option<Vec<Finding>>) {
        let Some(judged) = judged else { return };
        let is_sound = judged.iter().all(|finding| !finding.invalidates);
        let own = std::mem::replace(&mut analysis.findings, judged);
        let faulty = own.iter().find(|finding| finding.invalidates);
        if let Some(Finding { fault, .. }) = faulty.filter(|_| is_sound) {
            let cause = WarningCause::UnsuitableSettings { fault: *fault };
            analysis.warnings.insert(0, cause.into());
        }
    }
}

/// The settings, with the defaults for what is seen of a press; hot pixels, crop, calibration and limits stay.
fn as_usually_seen(settings: &AnalysisSettings) -> AnalysisSettings {
    let usual = AnalysisSettings::default();
    AnalysisSettings {
        window_before_ms: usual.window_before_ms,
        window_after_ms: usual.window_after_ms,
        window_after_contact_ms: usual.window_after_contact_ms,
        window_after_depth_ms: usual.window_after_depth_ms,
        window_anchor: usual.window_anchor,
        eps_px: usual.eps_px,
        min_samples: usual.min_samples,
        background_margin: usual.background_margin,
        centroid: usual.centroid,
        estimator: usual.estimator,
        precision: usual.precision,
        forget_ms: usual.forget_ms,
        thinning: usual.thinning,
        bin_px: usual.bin_px,
        cluster_threshold: usual.cluster_threshold,
        min_cluster_events: usual.min_cluster_events,
        min_response_sigma: usual.min_response_sigma,
        ..settings.clone()
    }
}

/// The settings without those that change neither what an analysis sees in a recording nor where it locates it.
fn observing(settings: &AnalysisSettings) -> AnalysisSettings {
    let usual = AnalysisSettings::default();
    AnalysisSettings {
        remount: usual.remount,
        failure_penalty_mm: usual.failure_penalty_mm,
        within_mm: usual.within_mm,
        bits_per_event: usual.bits_per_event,
        study_presses: usual.study_presses,
        reduction: usual.reduction,
        latency: usual.latency,
        cmre: usual.cmre,
        bootstrap_resamples: usual.bootstrap_resamples,
        seed: usual.seed,
        rate_bin_ms: usual.rate_bin_ms,
        exclude_outside: usual.exclude_outside,
        ..settings.clone()
    }
}
