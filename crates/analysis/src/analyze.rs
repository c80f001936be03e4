//! Owns the whole analysis: from a session's values and events to one [`Analysis`].

use skinrig_model::CameraId;

use crate::accumulate::{Accumulator, PassOutput, PassRequest, SLACK_US, pass, rate_bin_us};
use crate::audit::Streams;
use crate::calibrate::SessionCalibration;
use crate::camera_clocks::{CameraClock, CameraClocks};
use crate::closeups::{Closeups, keep_plans, zoom_plans};
use crate::error::AnalysisError;
use crate::event_cache::EventCache;
use crate::hot_pixels::{HotPixelMask, PixelCounts};
use crate::indentation::{self, PressPhases, phase_plans};
use crate::input::{EventSource, SessionInput};
use crate::locate_presses::{
    CalibrationOrigin, CameraObservations, LocatedPresses, locate_presses, locate_recalibrated,
};
use crate::locator::{EarlierCalibration, Effort, FittedLocator, LocatorModelError};
use crate::metrics::{Exclusions, metrics, penalised};
use crate::onsets::{Onset, onsets};
use crate::press_event_collector::RetentionPlan;
use crate::press_events::{RetainedPress, RetainedPresses, Retention};
use crate::press_spans::{spans, timings};
use crate::rates::RateHistogram;
use crate::result::{
    ANALYSIS_VERSION, Activity, Alignment, AlignmentStatus, AlignmentViolation, Analysis, ClockFit,
    ClockMap, ContactTiming, DepthResult, HotPixels, MapName, OffSensor, PressPicture, PressResult,
    PressView, RateSeries, RateZoom, RatesEvidence, Warning, WarningCause,
};
use crate::segment::{Window, windows};
use crate::session_base::time_base;
use crate::sets::ScoreSet;
use crate::stream::{Silences, contacts_s};
use crate::tie::UntimedPress;
use crate::{audit, bit_rates, caveats, check, cmre, coverage, latency, legs, reduction, verdict};

/// Windows that overlap by less than this only touch, because their ends are rounded, µs.
const OVERLAP_US: u64 = 100;

/// Analyses a session. The first pass over a camera's events finds event rates and, where its clock is known before, hot pixels; the
/// last one fills the press windows. Both cameras run in parallel. Later passes use cached events of the crop. Each reads
/// them again if a camera has more than 2^25, or if some were too late for their windows.
///
/// The result is bit-identical for the same input on the same machine. Memory does not grow with the number of events,
/// except for cached events (8 bytes each, at most 256 MiB per camera). It holds the rate histogram (4 bytes per
/// `rate_bin_ms`), the table of presses, and one pixel grid per open window.
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
    let [one, two] = std::thread::scope(|scope| {
        let plan = &plan;
        let second =
            scope.spawn(move || camera_pass(input, source, CameraId::Two, plan, reading_two));
        let first = camera_pass(input, source, CameraId::One, plan, reading_one);
        let second = match second.join() {
            Ok(result) => result,
            Err(panic) => std::panic::resume_unwind(panic),
        };
        [first, second]
    });
    let cameras = [one?, two?];
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
    let measure = |set: &ScoreSet, exclusions| {
        metrics(
            set,
            exclusions,
            &input.rig.outline,
            input.settings.within_mm,
            input.settings.bootstrap_resamples,
            input.settings.seed,
        )
    };
    let scored = measure(&scores, Exclusions::Applied);
    let scored_without_exclusions = if scores.excludes_estimates() {
        measure(&scores, Exclusions::Ignored)
    } else {
        scored
    };
    let penalised = penalised(
        &scores,
        input.settings.failure_penalty_mm,
        input.settings.bootstrap_resamples,
        input.settings.seed,
    );
    let depths = scores.depths_mm();
    let mut depths = if depths.len() > 1 { depths } else { Vec::new() };
    let unreached = input.unreached_depths_mm();
    depths.retain(|depth_mm| !unreached.contains(depth_mm));
    let depths = depths.into_iter().map(|depth_mm| DepthResult {
        depth_mm,
        rmse_mm: measure(&scores.at_depth(depth_mm), Exclusions::Applied).rmse_mm,
    });
    let depths = depths.collect();
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
        silences: [&mut one, &mut two].map(|c| std::mem::take(&mut c.silences)),
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
    Ok((analysis, kept))
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
    Ok(())
}

/// Results of one camera.
struct CameraResult {
    clock: Option<ClockFit>,
    rates: RateSeries,
    /// One entry per row of the plan.
    views: Vec<Option<PressView>>,
    data_lost: Vec<bool>,
    untimed: Vec<Option<UntimedPress>>,
    silences: Silences,
    /// Contacts detected in the counts, s on the host clock, if the presses come from a schedule.
    contacts_s: Vec<f64>,
    onsets: Vec<Onset>,
    pictures: Vec<PressPicture>,
    zooms: Vec<RateZoom>,
    kept: Vec<RetentionPlan>,
    phases: Vec<PressPhases>,
    activity: Option<Activity>,
    off_sensor: OffSensor,
    hot_pixels: HotPixels,
    warnings: Vec<Warning>,
}

impl CameraResult {
    fn observations(&self) -> CameraObservations<'_> {
        CameraObservations {
            has_clock: self.clock.is_some(),
            views: &self.views,
            data_lost: &self.data_lost,
            untimed: &self.untimed,
        }
    }
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

/// Events of a camera, from the cache of the first pass if it holds them.
struct Events<'a> {
    source: &'a dyn EventSource,
    camera: CameraId,
    cache: Option<&'a EventCache>,
}

impl Events<'_> {
    fn pass(&self, mut accumulator: Accumulator<'_>) -> Result<PassOutput, AnalysisError> {
        match self.cache {
            Some(cache) => {
                accumulator.take_cached(cache);
                accumulator.finish()
            }
            None => pass(self.source, self.camera, accumulator),
        }
    }

    fn count(&self, mut pixels: PixelCounts) -> Result<PixelCounts, AnalysisError> {
        let camera = self.camera;
        match self.cache {
            Some(cache) => cache.for_each_slice(|events| pixels.add(events)),
            None => self
                .source
                .for_each_slice(camera, &mut |events| pixels.add(events))
                .map_err(|source| AnalysisError::Events { camera, source })?,
        }
        Ok(pixels)
    }
}

fn camera_pass(
    input: &SessionInput,
    source: &dyn EventSource,
    camera: CameraId,
    plan: &Closeups,
    reading: CameraClock,
) -> Result<CameraResult, AnalysisError> {
    let settings = &input.settings;
    let k = camera.index();
    let CameraClock {
        clock,
        rates,
        activity,
        cache,
        pixels,
        untimed,
        off_sensor,
        mut warnings,
    } = reading;
    let list = clock.map_or_else(Vec::new, |c| {
        windows(timings(input), &input.earlier, &c, settings)
    });
    let events = Events {
        source,
        camera,
        cache: cache.as_ref(),
    };
    let mut hot_pixels = HotPixels::default();
    let mut collected = PassOutput::default();
    // Without a clock, the events contain nothing more.
    if let Some(clock) = clock {
        let pixels = match pixels {
            Some(pixels) => pixels,
            None => events.count(PixelCounts::new(settings.crop_v[k], &list))?,
        };
        hot_pixels = pixels.hot(settings);
        // Where only hot pixels fire, the camera is silent.
        let any_hot = !hot_pixels.pixels.is_empty();
        let wanted = PassRequest {
            rates: any_hot.then(|| RateHistogram::new(rate_bin_us(settings))),
            windows: &list,
            pictured: &plan.pictures,
            zooms: zoom_plans(input, plan, &clock),
            kept: keep_plans(input, plan, &list, &clock),
            phases: phase_plans(input, &list, &clock),
            hot: HotPixelMask::new(&hot_pixels),
            ..PassRequest::default()
        };
        collected = events.pass(Accumulator::new(camera, settings, wanted))?;
    }
    collected = PassOutput {
        rates: collected.rates.take().or(rates),
        activity,
        off_sensor,
        ..collected
    };
    if !hot_pixels.pixels.is_empty() {
        warnings.push(WarningCause::HotPixels {
            pixels: hot_pixels.pixels.len() as u32,
            of: hot_pixels.of,
            highest_per_s: hot_pixels.highest_per_s,
            idle_share: hot_pixels.idle_share,
        });
    }
    if list
        .windows(2)
        .any(|w| w[1].start_us + OVERLAP_US < w[0].end_us)
    {
        warnings.push(WarningCause::WindowsOverlap);
    }
    if collected.late > 0 {
        warnings.push(WarningCause::EventsOutOfOrder {
            events: collected.late,
            limit_ms: SLACK_US / 1000,
        });
    }
    if let Some(events) = collected
        .rates
        .as_ref()
        .map(RateHistogram::beyond)
        .filter(|b| *b > 0)
    {
        warnings.push(WarningCause::EventsDaysAway { events });
    }
    let off_sensor = collected.off_sensor;
    if off_sensor.share() > OffSensor::MAX_SHARE {
        let OffSensor { events, of } = off_sensor;
        return Err(AnalysisError::OffSensor { camera, events, of });
    }
    if off_sensor.share() > OffSensor::WARNING_SHARE {
        let OffSensor { events, of } = off_sensor;
        warnings.push(WarningCause::EventsOffSensor { events, of });
    }
    let (silences, contacts_s) = stream(input, &collected, clock.as_ref());
    let onsets = match (&collected.rates, &clock) {
        (Some(rates), Some(clock)) => onsets(input, rates, clock),
        _ => Vec::new(),
    };
    let lost = [&input.gaps[k][..], &silences.spans()].concat();
    let series = collected
        .rates
        .map(|r| r.series(clock.as_ref()))
        .unwrap_or_default();
    Ok(CameraResult {
        clock,
        rates: series,
        views: by_row(input.planned.len(), collected.views),
        data_lost: lost_rows(input.planned.len(), &list, &lost),
        silences,
        contacts_s,
        onsets,
        untimed,
        pictures: collected.pictures,
        zooms: collected.zooms,
        kept: collected.kept,
        phases: collected.phases,
        activity: collected.activity,
        off_sensor,
        hot_pixels,
        warnings: warnings
            .into_iter()
            .map(|cause| Warning::of_camera(camera, cause))
            .collect(),
    })
}

/// Results from the counts of a camera alone.
fn stream(
    input: &SessionInput,
    collected: &PassOutput,
    clock: Option<&ClockFit>,
) -> (Silences, Vec<f64>) {
    let (Some(rates), Some(clock)) = (&collected.rates, clock) else {
        return (Silences::default(), Vec::new());
    };
    let pressed = spans(input);
    let (Some(first), Some(last)) = (pressed.first(), pressed.last()) else {
        return (Silences::default(), Vec::new());
    };
    let ends = (
        clock.camera_us(first.contact_us),
        clock.camera_us(last.release_us),
    );
    let views = collected.views.iter().map(|(_, view)| *view);
    let silences = Silences::new(rates, views, ends);
    // The clock of a camera is that of one leg.
    let contacts_s = if input.legs.is_empty() {
        let listed = pressed.iter();
        let listed = listed.map(|s| (s.contact_us * 1e-6, s.release_us * 1e-6));
        contacts_s(rates, clock, &listed.collect::<Vec<_>>())
    } else {
        Vec::new()
    };
    (silences, contacts_s)
}

pub(crate) fn by_row(rows: usize, views: Vec<(usize, PressView)>) -> Vec<Option<PressView>> {
    let mut out = vec![None; rows];
    for (row, view) in views {
        out[row] = Some(view);
    }
    out
}

pub(crate) fn lost_rows(rows: usize, windows: &[Window], gaps: &[(u64, u64)]) -> Vec<bool> {
    let mut out = vec![false; rows];
    for window in windows.iter().filter(|w| w.overlaps(gaps)) {
        out[window.row] = true;
    }
    out
}
