//! Owns the whole analysis: from a session's values and events to one [`Analysis`].

use skinrig_model::CameraId;

use crate::audit::Streams;
use crate::calibrate::SessionCalibration;
use crate::camera_clocks::{CameraClock, CameraClocks};
use crate::camera_pass::{CameraResult, camera_pass};
use crate::closeups::Closeups;
use crate::error::AnalysisError;
use crate::indentation;
use crate::input::{EventSource, SessionInput};
use crate::judging_settings::{judging_input, take_findings};
use crate::locate_presses::{
    CalibrationOrigin, LocatedPresses, locate_presses, locate_recalibrated,
};
use crate::locator::{EarlierCalibration, Effort, FittedLocator, LocatorModelError};
use crate::metrics::{Exclusions, metrics, penalised};
use crate::press_event_collector::RetentionPlan;
use crate::press_events::{RetainedPress, RetainedPresses, Retention};
use crate::press_spans::spans;
use crate::result::{
    ANALYSIS_VERSION, Alignment, AlignmentStatus, AlignmentViolation, Analysis, ClockFit, ClockMap,
    ContactTiming, DepthResult, MapName, Metrics, PenalisedRmse, PressResult, RatesEvidence,
    Warning, WarningCause,
};
use crate::session_base::time_base;
use crate::sets::ScoreSet;
use crate::{
    audit, bit_rates, caveats, changes, check, cmre, coverage, latency, legs, reduction, verdict,
};

/// Analyses a session. The first pass over a camera's events finds event rates and, where its clock is known before, hot pixels; the
/// last one fills the press windows. Both cameras run in parallel. Later passes use cached events of the crop. Each reads
/// them again if a camera has more than 2^25, or if some were too late for their windows. Settings that see presses otherwise than the
/// recording's, or that give a fault, cost a second analysis (`judging_settings`).
///
/// The result is bit-identical for the same input on the same machine. Memory does not grow with the number of events,
/// except for cached events (8 bytes each, at most 256 MiB per camera). It holds rate histograms (4 bytes per 10 ms, and
/// per `rate_bin_ms` if that differs), the table of presses, and one pixel grid per open window.
///
/// # Errors
/// When the input contradicts itself, a setting is out of range, or the events cannot be read. Problems with single presses
/// or one camera become verdicts and warnings instead.
pub fn analyze(input: &SessionInput, source: &dyn EventSource) -> Result<Analysis, AnalysisError> {
    analyze_with_events(input, source, Retention::Scored).map(|(analysis, _)| analysis)
}

/// Like [`analyze`], and also returns the events around the presses selected by `retention`. The studies of the analysis
/// itself use scored presses only.
///
/// # Errors
/// See [`analyze`].
pub fn analyze_with_events(
    input: &SessionInput,
    source: &dyn EventSource,
    keep: Retention,
) -> Result<(Analysis, RetainedPresses), AnalysisError> {
    analyze_by(input, source, keep, CalibrationOrigin::Session)
}

/// Like [`analyze_with_events`], by the calibration of an earlier session, corrected by the calibration presses of this one.
///
/// # Errors
/// [`AnalysisError::Recalibration`] if the earlier calibration does not fit; else see [`analyze`].
pub fn analyze_recalibrated(
    input: &SessionInput,
    source: &dyn EventSource,
    keep: Retention,
    earlier: &EarlierCalibration,
) -> Result<(Analysis, RetainedPresses), AnalysisError> {
    analyze_by(input, source, keep, CalibrationOrigin::Earlier(earlier))
}

fn analyze_by(
    input: &SessionInput,
    source: &dyn EventSource,
    keep: Retention,
    origin: CalibrationOrigin<'_>,
) -> Result<(Analysis, RetainedPresses), AnalysisError> {
    check::input(input)?;
    let plan = Closeups::choose(input, keep);
    let base = time_base(input);
    let legs = legs::clocks(input, base.as_ref());
    let pressed = spans(input).into_iter().map(|s| s.contact_us);
    let nominal = legs::nominal_only(&input.legs, &legs, pressed);
    let CameraClocks {
        cameras: [reading_one, reading_two],
        evidence,
        violations,
    } = CameraClocks::new(input, source, base.as_ref())?;
    let cameras = both_cameras(input, source, &plan, [reading_one, reading_two])?;
    let mut warnings: Vec<Warning> = Vec::new();
    let observations = [cameras[0].observations(), cameras[1].observations()];
    let (located, recalibration) = match origin {
        CalibrationOrigin::Session => {
            let located = locate_presses(input, observations, Effort::Full, &mut warnings);
            (located, None)
        }
        CalibrationOrigin::Earlier(earlier) => {
            let (located, about) =
                locate_recalibrated(input, observations, earlier, &mut warnings)?;
            (located, Some(about))
        }
    };
    let LocatedPresses {
        presses,
        calibrated:
            SessionCalibration {
                geometry,
                calibration,
                threshold,
            },
        locator,
    } = located;
    let indentation = indentation::estimate(
        input,
        &presses,
        &geometry,
        [&cameras[0].phases, &cameras[1].phases],
    );
    let scores = ScoreSet::from_presses(&presses, &input.outcomes);
    let Scores {
        scored,
        scored_without_exclusions,
        penalised,
        depths,
    } = Scores::of(input, &scores);
    let both = [&scored.rmse_mm, &scored_without_exclusions.rmse_mm];
    warnings.extend(verdict::exclusion_warning(&presses, both));
    warnings.extend(verdict::nothing_counts(&presses));
    if scores.presses().is_empty() {
        warnings.push(WarningCause::NoScoredPress.into());
    }
    let scheduled = input.outcomes.iter().flatten().any(|o| o.scheduled);
    if scheduled {
        warnings.push(WarningCause::Scheduled.into());
    }
    let [mut one, mut two] = cameras;
    let streams = Streams {
        onsets: [&mut one, &mut two].map(|c| std::mem::take(&mut c.onsets)),
        bursts: [&mut one, &mut two].map(|c| std::mem::take(&mut c.bursts)),
        silences: [&mut one, &mut two].map(|c| std::mem::take(&mut c.silences)),
        begun_s: [one.begun_s, two.begun_s],
        contacts_s: [&mut one, &mut two].map(|c| std::mem::take(&mut c.contacts_s)),
    };
    let kept = paired(
        &presses,
        &plan,
        [std::mem::take(&mut one.kept), std::mem::take(&mut two.kept)],
    );
    let both_clocks = one.clock.is_some() && two.clock.is_some();
    if both_clocks && kept.left_out > 0 {
        let left_out = WarningCause::StudyPressesLeftOut {
            left_out: kept.left_out,
            chosen: plan.kept.len(),
            used: kept.presses.len(),
        };
        warnings.push(left_out.into());
    }
    let counts = verdict::count(&presses);
    let mut alignment = base.map_or_else(
        || uncertified([one.clock, two.clock]),
        |base| base.alignment,
    );
    alignment.warnings.extend(nominal);
    let mut analysis = Analysis {
        version: ANALYSIS_VERSION,
        settings: input.settings.clone(),
        rig: input.rig,
        geometry,
        counts,
        alignment: with_rates_evidence(alignment, evidence, violations),
        clocks: [one.clock, two.clock],
        legs,
        contact_timing: contact_timing(input, scheduled),
        calibration,
        recalibration,
        locator: locator.map(|l| l.result),
        indentation,
        scored,
        scored_without_exclusions,
        depths,
        penalised,
        threshold,
        coverage: None,
        cmre: None,
        bit_rates: None,
        reduction: None,
        latency: None,
        reference: None,
        findings: Vec::new(),
        activity: [one.activity, two.activity].into_iter().flatten().collect(),
        off_sensor: [one.off_sensor, two.off_sensor],
        hot_pixels: [one.hot_pixels, two.hot_pixels],
        rates: [one.rates, two.rates],
        presses,
        warnings: [one.warnings, two.warnings, warnings].concat(),
        pictures: [one.pictures, two.pictures].concat(),
        zooms: [one.zooms, two.zooms].concat(),
        campaign: None,
        felt: None,
        motion: None,
    };
    evaluate(&mut analysis, input, &streams, &kept)?;
    let judging = judging_input(input, &analysis);
    // If that analysis fails, the findings of this one stand.
    if let Some(Ok((judged, _))) =
        judging.map(|input| analyze_by(&input, source, Retention::Scored, origin))
    {
        take_findings(&mut analysis, judged.findings);
    }
    Ok((analysis, kept))
}

/// [`camera_pass`] of both cameras, in parallel if the pool of this process has several threads: a worker of a cluster has one.
fn both_cameras(
    input: &SessionInput,
    source: &dyn EventSource,
    plan: &Closeups,
    [one, two]: [CameraClock; 2],
) -> Result<[CameraResult; 2], AnalysisError> {
    let (first, second) = rayon::join(
        || camera_pass(input, source, CameraId::One, plan, one),
        || camera_pass(input, source, CameraId::Two, plan, two),
    );
    Ok([first?, second?])
}

/// Errors of the scored presses.
struct Scores {
    scored: Metrics,
    /// As if no estimate were excluded.
    scored_without_exclusions: Metrics,
    penalised: PenalisedRmse,
    /// Empty unless the plan has several depths.
    depths: Vec<DepthResult>,
}

impl Scores {
    fn of(input: &SessionInput, set: &ScoreSet) -> Self {
        let settings = &input.settings;
        let (resamples, seed) = (settings.bootstrap_resamples, settings.seed);
        let measure = |set: &ScoreSet, exclusions| {
            metrics(
                set,
                exclusions,
                &input.rig.outline,
                settings.within_mm,
                resamples,
                seed,
            )
        };
        let scored = measure(set, Exclusions::Applied);
        let scored_without_exclusions = if set.excludes_estimates() {
            measure(set, Exclusions::Ignored)
        } else {
            scored
        };
        let mut depths = set.depths_mm();
        if depths.len() < 2 {
            depths.clear();
        }
        let unreached = input.unreached_depths_mm();
        depths.retain(|depth_mm| !unreached.contains(depth_mm));
        let depths = depths.into_iter().map(|depth_mm| DepthResult {
            depth_mm,
            rmse_mm: measure(&set.at_depth(depth_mm), Exclusions::Applied).rmse_mm,
        });
        Self {
            scored,
            scored_without_exclusions,
            penalised: penalised(set, settings.failure_penalty_mm, resamples, seed),
            depths: depths.collect(),
        }
    }
}

/// Alignment without trigger box reports: what can be stated.
fn uncertified(clocks: [Option<ClockFit>; 2]) -> Alignment {
    let names = [MapName::Camera1FromHost, MapName::Camera2FromHost];
    let maps = clocks.into_iter().zip(names);
    Alignment {
        maps: maps
            .filter_map(|(fit, name)| Some(ClockMap::of_line(name, &fit?)))
            .collect(),
        ..Alignment::default()
    }
}

/// Adds the evidence of an alignment by event rates.
fn with_rates_evidence(
    found: Alignment,
    rates: Option<RatesEvidence>,
    violations: Vec<AlignmentViolation>,
) -> Alignment {
    let status = if violations.is_empty() {
        found.status
    } else {
        AlignmentStatus::Invalid
    };
    Alignment {
        status,
        violations: [found.violations, violations].concat(),
        rates,
        ..found
    }
}

fn contact_timing(input: &SessionInput, scheduled: bool) -> ContactTiming {
    let half_widths = input.marks.iter().map(|m| m.uncertainty_ns as f64 * 1e-3);
    ContactTiming {
        scheduled,
        pose_interval_us: input.pose_interval_us.unwrap_or(0.0),
        mark_half_width_us: half_widths.fold(0.0, f64::max),
        crossing_se_us: input.crossing_se_us.unwrap_or(0.0),
    }
}

/// Computes everything that depends on the finished table of presses. The parts do not depend on each other.
fn evaluate(
    analysis: &mut Analysis,
    input: &SessionInput,
    streams: &Streams,
    kept: &RetainedPresses,
) -> Result<(), LocatorModelError> {
    let table = &*analysis;
    let locator = FittedLocator::of(table)?;
    let (findings, (coverage, cmre, bit_rates)) = rayon::join(
        || audit::audit(input, table, streams),
        || {
            (
                coverage::coverage(table),
                cmre::cmre(table),
                bit_rates::bit_rates(table),
            )
        },
    );
    analysis.findings = findings;
    analysis.coverage = coverage;
    analysis.cmre = cmre;
    analysis.bit_rates = bit_rates;
    analysis.reduction = reduction::study(analysis, &locator, kept);
    analysis.latency = latency::study(analysis, kept);
    analysis.warnings.extend(caveats::caveats(analysis));
    let changes = changes::changes(analysis, input, &streams.bursts);
    analysis.warnings.extend(changes);
    Ok(())
}

/// Views of both cameras per press; drops a press that one camera lacks.
fn paired(
    presses: &[PressResult],
    plan: &Closeups,
    [one, two]: [Vec<RetentionPlan>; 2],
) -> RetainedPresses {
    let mut one: Vec<RetentionPlan> = one;
    one.sort_by_key(|k| k.row);
    let mut others: Vec<RetentionPlan> = two;
    others.sort_by_key(|k| k.row);
    let mut others = others.into_iter().peekable();
    let presses: Vec<RetainedPress> = one
        .into_iter()
        .filter_map(|first| {
            while others.next_if(|k| k.row < first.row).is_some() {}
            let second = others.next_if(|k| k.row == first.row)?;
            Some(RetainedPress {
                row: first.row,
                press: presses[first.row].press,
                views: [first.view, second.view],
            })
        })
        .collect();
    RetainedPresses {
        left_out: (plan.kept.len() - presses.len()) as u32,
        presses,
    }
}
