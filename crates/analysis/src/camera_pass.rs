//! Second pass over the events of one camera: hot pixels, press windows, close-ups and counts.

use skinrig_model::CameraId;

use crate::accumulate::{Accumulator, PassOutput, PassRequest, SLACK_US, pass};
use crate::bursts::{PressBurst, press_bursts};
use crate::camera_clocks::CameraClock;
use crate::ceiling::ceiling;
use crate::closeups::{Closeups, keep_plans, zoom_plans};
use crate::error::AnalysisError;
use crate::event_cache::EventCache;
use crate::hot_pixels::{HotPixelMask, PixelCounts};
use crate::indentation::{PressPhases, phase_plans};
use crate::input::{EventSource, SessionInput};
use crate::locate_presses::CameraObservations;
use crate::onsets::{Onset, onsets};
use crate::press_event_collector::RetentionPlan;
use crate::press_spans::{spans, timings};
use crate::rates::CameraRates;
use crate::result::{
    Activity, ClockFit, HotPixels, OffSensor, PressPicture, PressView, RateSeries, RateZoom,
    Warning, WarningCause,
};
use crate::segment::{Window, windows};
use crate::stream::{Silences, contacts_s};
use crate::tie::UntimedPress;

/// Windows that overlap by less than this only touch, because their ends are rounded, µs.
const OVERLAP_US: u64 = 100;

/// Results of a camera.
pub(crate) struct CameraResult {
    pub clock: Option<ClockFit>,
    pub rates: RateSeries,
    /// One entry per row of the plan.
    pub views: Vec<Option<PressView>>,
    pub data_lost: Vec<bool>,
    pub untimed: Vec<Option<UntimedPress>>,
    pub silences: Silences,
    /// Contacts detected in the counts, s on the host clock, if the presses come from a schedule.
    pub contacts_s: Vec<f64>,
    /// First event, s on the host clock; with the contacts.
    pub begun_s: Option<f64>,
    pub onsets: Vec<Onset>,
    /// One entry per row of the plan.
    pub bursts: Vec<Option<PressBurst>>,
    pub pictures: Vec<PressPicture>,
    pub zooms: Vec<RateZoom>,
    pub kept: Vec<RetentionPlan>,
    pub phases: Vec<PressPhases>,
    pub activity: Option<Activity>,
    pub off_sensor: OffSensor,
    pub hot_pixels: HotPixels,
    pub warnings: Vec<Warning>,
}

impl CameraResult {
    pub(crate) fn observations(&self) -> CameraObservations<'_> {
        CameraObservations {
            has_clock: self.clock.is_some(),
            views: &self.views,
            data_lost: &self.data_lost,
            untimed: &self.untimed,
        }
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

/// Fills the press windows of a camera; without a clock, only what its first pass found remains.
pub(crate) fn camera_pass(
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
        let quiet = pixels.quiet(|window| input.planned[list[window].row].id);
        warnings.extend(quiet.into_iter().map(WarningCause::QuietPart));
        let faults = pixels.readout_faults();
        warnings.extend(faults.into_iter().map(WarningCause::Readout));
        hot_pixels = pixels.hot(settings);
        // Where only hot pixels fire, the camera is silent.
        let any_hot = !hot_pixels.pixels.is_empty();
        let wanted = PassRequest {
            rates: any_hot.then(|| CameraRates::new(settings)),
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
    warnings.extend(pass_warnings(&hot_pixels, &list, &collected));
    let off_sensor = collected.off_sensor;
    if off_sensor.share() > OffSensor::MAX_SHARE {
        let OffSensor { events, of } = off_sensor;
        return Err(AnalysisError::OffSensor { camera, events, of });
    }
    if off_sensor.share() > OffSensor::WARNING_SHARE {
        let OffSensor { events, of } = off_sensor;
        warnings.push(WarningCause::EventsOffSensor { events, of });
    }
    let of_window = |window: usize| input.planned[list[window].row].id;
    let fixed = collected.rates.as_ref().map(CameraRates::fixed);
    let ceiling = fixed.and_then(|rates| ceiling(rates, &list, of_window));
    warnings.extend(ceiling.map(WarningCause::Readout));
    let found = stream(input, collected.rates.as_ref(), clock.as_ref());
    let lost = [&input.gaps[k][..], &found.silences.spans()].concat();
    let series = collected
        .rates
        .map(|r| r.drawn().series(clock.as_ref()))
        .unwrap_or_default();
    Ok(CameraResult {
        clock,
        rates: series,
        views: by_row(input.planned.len(), collected.views),
        data_lost: lost_rows(input.planned.len(), &list, &lost),
        silences: found.silences,
        contacts_s: found.contacts_s,
        begun_s: found.begun_s,
        onsets: found.onsets,
        bursts: found.bursts,
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

/// Warnings about the windows and events of a pass.
fn pass_warnings(
    hot_pixels: &HotPixels,
    list: &[Window],
    collected: &PassOutput,
) -> Vec<WarningCause> {
    let mut warnings = Vec::new();
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
        .map(|rates| rates.drawn().beyond())
        .filter(|b| *b > 0)
    {
        warnings.push(WarningCause::EventsDaysAway { events });
    }
    warnings
}

/// Results from the counts of a camera alone.
#[derive(Default)]
struct Stream {
    silences: Silences,
    /// See [`CameraResult`].
    contacts_s: Vec<f64>,
    begun_s: Option<f64>,
    onsets: Vec<Onset>,
    bursts: Vec<Option<PressBurst>>,
}

fn stream(input: &SessionInput, rates: Option<&CameraRates>, clock: Option<&ClockFit>) -> Stream {
    let (Some(rates), Some(clock)) = (rates.map(CameraRates::fixed), clock) else {
        return Stream::default();
    };
    let counted = Stream {
        onsets: onsets(input, rates, clock),
        bursts: press_bursts(input, rates, clock),
        ..Stream::default()
    };
    let pressed = spans(input);
    let (Some(first), Some(last)) = (pressed.first(), pressed.last()) else {
        return counted;
    };
    let ends = (
        clock.camera_us(first.contact_us),
        clock.camera_us(last.release_us),
    );
    let silences = Silences::new(rates, &counted.bursts, ends);
    // The clock of a camera is that of one leg.
    if !input.legs.is_empty() {
        return Stream {
            silences,
            ..counted
        };
    }
    let listed = pressed.iter();
    let listed = listed.map(|s| (s.contact_us * 1e-6, s.release_us * 1e-6));
    let begun = rates.counts().iter().position(|count| *count > 0);
    let begun_us = begun.map(|bin| (rates.start_us() + bin as u64 * rates.bin_us()) as f64);
    Stream {
        silences,
        contacts_s: contacts_s(rates, clock, &listed.collect::<Vec<_>>()),
        begun_s: begun_us.map(|us| clock.host_us_of_camera(us) * 1e-6),
        ..counted
    }
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
