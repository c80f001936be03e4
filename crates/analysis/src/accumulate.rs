//! Owns the single pass over a camera's events: rates, pixel counts of each press, and a few close-ups.
//!
//! Memory holds one pixel grid per open window and, for estimators that need single events, the events of the open windows,
//! up to [`MAX_CACHED_EVENTS`]. Events may be out of order by up to [`SLACK_US`]; later ones are counted as late and
//! reported, never dropped silently.

use skinrig_model::{
    AnalysisSettings, CameraId, CdEvent, CentroidRule, Estimator, Polarity, PressId, SENSOR_HEIGHT,
    SENSOR_WIDTH,
};

use crate::activity::ActivityGrid;
use crate::dbscan::Dbscan;
use crate::error::AnalysisError;
use crate::estimators::{ColumnEstimate, PressEstimator, Thinning};
use crate::event_cache::EventCache;
use crate::grid::PixelGrid;
use crate::hot_pixels::{HotPixelMask, PixelCounts};
use crate::indentation::{PhaseCollector, PhasePlan, PressPhases};
use crate::input::EventSource;
use crate::press_event_collector::{PressEventCollector, RetentionPlan};
use crate::press_events::PackedEvent;
use crate::press_view::{EventCounts, press_view};
use crate::rates::{CameraRates, drawn_bin_us};
use crate::result::{Activity, OffSensor, PicturePixel, PressPicture, PressView, RateZoom};
use crate::segment::Window;
use crate::width::width_u;

/// Largest delay of an event relative to the newest one for which its window is still open, µs.
pub(crate) const SLACK_US: u64 = 10_000;

/// Maximum number of events held for an estimator over all open windows of a camera: 512 MiB.
const MAX_CACHED_EVENTS: usize = 1 << 26;

/// Events processed together, so that they stay in the fastest caches.
const SLICE: usize = 1024;

/// Plan of a rate close-up around one press.
#[derive(Debug, Clone)]
pub(crate) struct ZoomPlan {
    pub press: PressId,
    pub start_us: u64,
    pub bins: usize,
    /// Time of the first bin relative to contact, s, and of the release relative to contact, s.
    pub start_s: f64,
    pub release_s: f64,
}

/// Placeholder for events that have not arrived.
const NO_EVENT: CdEvent = CdEvent {
    t_us: 0,
    x: 0,
    y: 0,
    polarity: Polarity::Off,
};

/// Outputs to collect in a pass.
#[derive(Default)]
pub(crate) struct PassRequest<'a> {
    /// Windows, sorted by start.
    pub windows: &'a [Window],
    /// Rows of the plan that get an image, with their press.
    pub pictured: &'a [(usize, PressId)],
    /// Close-ups of the rate, sorted by start.
    pub zooms: Vec<ZoomPlan>,
    /// Presses whose events are kept, sorted by start.
    pub kept: Vec<RetentionPlan>,
    /// Presses whose phases are counted, sorted by start.
    pub phases: Vec<PhasePlan>,
    /// Histogram to fill, if this pass fills it; the pass then also counts the activity.
    pub rates: Option<CameraRates>,
    /// Cache for the events of the crop, for a second pass.
    pub cache: Option<EventCache>,
    /// Counts per pixel to fill, to find the hot ones.
    pub pixels: Option<PixelCounts>,
    /// Pixels whose events do not count in windows, pictures, close-ups and kept presses.
    pub hot: HotPixelMask,
}

/// Collects all outputs of one camera.
pub(crate) struct Accumulator<'a> {
    camera: CameraId,
    settings: &'a AnalysisSettings,
    crop: (u16, u16),
    rates: Option<CameraRates>,
    windows: &'a [Window],
    pictured: &'a [(usize, PressId)],
    next: usize,
    open: Vec<OpenWindow>,
    spare: Vec<OpenWindow>,
    /// No window opens or closes before this camera time.
    quiet_until_us: u64,
    newest_us: u64,
    late: u64,
    repeated: u64,
    off_sensor: OffSensor,
    thinning: Thinning,
    dbscan: Dbscan,
    /// Set for estimators other than clusters of single pixels; windows then hold their events.
    estimator: Option<PressEstimator>,
    most_kept: usize,
    zooms: Vec<(ZoomPlan, Vec<u32>, Vec<u32>)>,
    zoom_next: usize,
    event_collector: PressEventCollector,
    phase_collector: PhaseCollector,
    activity: Option<ActivityGrid>,
    cache: Option<EventCache>,
    pixels: Option<PixelCounts>,
    hot: HotPixelMask,
    /// Buffer for the events of a slice that are in the crop.
    inside: Vec<CdEvent>,
    bin_us: u64,
    views: Vec<(usize, PressView)>,
    pictures: Vec<PressPicture>,
    error: Option<AnalysisError>,
}

/// A window that is collecting events.
struct OpenWindow {
    window: Window,
    grid: PixelGrid,
    on_events: u32,
    idle_events: u64,
    /// ON events per pixel, only for a press with an image.
    on: Option<PixelGrid>,
    /// For estimators that need single events; time since the start of the window.
    events: Vec<PackedEvent>,
}

/// Outputs of [`Accumulator::finish`].
#[derive(Default)]
pub(crate) struct PassOutput {
    pub rates: Option<CameraRates>,
    /// (row of the plan, view).
    pub views: Vec<(usize, PressView)>,
    pub pictures: Vec<PressPicture>,
    pub zooms: Vec<RateZoom>,
    /// Complete views only.
    pub kept: Vec<RetentionPlan>,
    pub phases: Vec<PressPhases>,
    pub activity: Option<Activity>,
    /// All events of the crop, for a second pass; `None` if the cache overflowed or an event was late.
    pub cache: Option<EventCache>,
    /// Counts per pixel, if they were requested.
    pub pixels: Option<PixelCounts>,
    /// Events more than [`SLACK_US`] late.
    pub late: u64,
    /// Events that equal the one before: pixel, time and polarity.
    pub repeated: u64,
    /// Ignored events outside the sensor; all zero for a pass over cached events.
    pub off_sensor: OffSensor,
}

impl<'a> Accumulator<'a> {
    /// Collects the outputs in `request`.
    pub(crate) fn new(
        camera: CameraId,
        settings: &'a AnalysisSettings,
        request: PassRequest<'a>,
    ) -> Self {
        let PassRequest {
            windows,
            pictured,
            zooms,
            kept,
            phases,
            rates,
            cache,
            pixels,
            hot,
        } = request;
        let zooms = zooms
            .into_iter()
            .map(|plan| {
                let bins = plan.bins;
                (plan, vec![0; bins], vec![0; bins])
            })
            .collect();
        Self {
            camera,
            settings,
            crop: settings.crop_v[camera.index()],
            activity: rates.is_some().then(ActivityGrid::new),
            cache,
            pixels,
            hot,
            inside: vec![NO_EVENT; SLICE],
            rates,
            windows,
            pictured,
            next: 0,
            open: Vec::new(),
            spare: Vec::new(),
            quiet_until_us: 0,
            newest_us: 0,
            late: 0,
            repeated: 0,
            off_sensor: OffSensor::default(),
            thinning: Thinning::new(settings.thinning, camera, settings.seed),
            dbscan: Dbscan::new(settings.eps_px, settings.min_samples),
            estimator: (settings.estimator != Estimator::Dbscan || settings.bin_px > 1)
                .then(|| PressEstimator::new(settings, settings.crop_v[camera.index()])),
            most_kept: MAX_CACHED_EVENTS,
            zooms,
            zoom_next: 0,
            event_collector: PressEventCollector::new(kept),
            phase_collector: PhaseCollector::new(phases, settings.crop_v[camera.index()]),
            bin_us: drawn_bin_us(settings),
            views: Vec::new(),
            pictures: Vec::new(),
            error: None,
        }
    }

    /// Processes the next events of the stream.
    pub(crate) fn take(&mut self, events: &[CdEvent]) {
        for slice in events.chunks(SLICE) {
            if self.error.is_some() {
                return;
            }
            // Branch-free scan of all events; only slices with a violation are searched.
            let (mut on_sensor, mut in_order) = (true, true);
            let (mut last, mut repeated) = (NO_EVENT, 0);
            for e in slice {
                on_sensor &= is_on_sensor(e);
                in_order &= last.t_us <= e.t_us;
                repeated += u64::from(last == *e);
                last = *e;
            }
            self.repeated += repeated;
            self.off_sensor.of += slice.len() as u64;
            if !on_sensor {
                let on: Vec<CdEvent> = slice.iter().filter(|e| is_on_sensor(e)).copied().collect();
                self.off_sensor.events += (slice.len() - on.len()) as u64;
                on.chunks(1).for_each(|event| self.take_in_order(event));
                continue;
            }
            if in_order {
                self.take_in_order(slice);
            } else {
                slice.chunks(1).for_each(|event| self.take_in_order(event));
            }
        }
    }

    /// Processes at most [`SLICE`] events in time order (the first may precede events already processed): the events of a
    /// window or close-up are then contiguous.
    fn take_in_order(&mut self, events: &[CdEvent]) {
        let newest_us = self.newest_us;
        self.late += events.partition_point(|e| e.t_us.saturating_add(SLACK_US) < newest_us) as u64;
        if let Some(activity) = &mut self.activity {
            events.iter().for_each(|e| activity.add(e));
        }
        let (low, high) = self.crop;
        let mut inside = std::mem::take(&mut self.inside);
        let room = &mut inside[..SLICE];
        // Store every event, advance only for those in the crop: no branch to mispredict.
        let mut count = 0;
        for event in events {
            // The index never exceeds the buffer, which has the length of the longest slice; the mask proves it to the
            // compiler. As a slice of one, an event is copied whole instead of field by field.
            let at = count % SLICE;
            room[at..=at].copy_from_slice(std::slice::from_ref(event));
            count += usize::from((low <= event.y) & (event.y <= high));
        }
        if let Some(pixels) = &mut self.pixels {
            pixels.add(&inside[..count]);
        }
        self.cache.take_if(|cache| !cache.add(&inside[..count]));
        self.take_inside(&inside[..count]);
        self.inside = inside;
        if let Some(last) = events.last() {
            self.newest_us = self.newest_us.max(last.t_us);
        }
    }

    /// Processes all events that another pass has cached.
    pub(crate) fn take_cached(&mut self, cache: &EventCache) {
        if cache.in_order() {
            // The caching pass has already checked them.
            cache.for_each_slice(|events| self.take_inside(events));
        } else {
            cache.for_each_slice(|events| self.take(events));
        }
    }

    /// Processes events of the crop in time order; those of hot pixels do not count.
    fn take_inside(&mut self, events: &[CdEvent]) {
        if self.hot.is_empty() {
            return self.take_counted(events);
        }
        let counted = events.iter().filter(|e| !self.hot.holds(e)).copied();
        let counted: Vec<CdEvent> = counted.collect();
        self.take_counted(&counted);
    }

    /// Processes events that count, in time order.
    fn take_counted(&mut self, events: &[CdEvent]) {
        if let Some(rates) = &mut self.rates {
            rates.add_in_order(events);
        }
        let mut rest = events;
        while let Some(first) = rest.first()
            && self.error.is_none()
        {
            self.newest_us = self.newest_us.max(first.t_us);
            if self.newest_us >= self.quiet_until_us {
                self.advance();
            }
            let (quiet, later) = rest.split_at(first_from(rest, self.quiet_until_us).max(1));
            self.count(quiet);
            rest = later;
        }
        if let Some(last) = events.last() {
            self.newest_us = self.newest_us.max(last.t_us);
        }
    }

    /// Counts events of the crop, in time order, for every output.
    fn count(&mut self, events: &[CdEvent]) {
        self.event_collector.take(events);
        self.count_in_zooms(events);
        if self.thinning.keeps_all() {
            self.phase_collector.take(events);
            self.count_in_windows(events);
        } else {
            let kept = events.iter().filter(|e| self.thinning.keeps(e)).copied();
            let kept: Vec<CdEvent> = kept.collect();
            self.phase_collector.take(&kept);
            self.count_in_windows(&kept);
        }
    }

    fn count_in_zooms(&mut self, events: &[CdEvent]) {
        for (plan, ons, offs) in &mut self.zooms[self.zoom_next..] {
            let events = &events[first_from(events, plan.start_us)..];
            if events.is_empty() {
                break;
            }
            for event in events {
                let bin = ((event.t_us - plan.start_us) / self.bin_us) as usize;
                let on = event.polarity == Polarity::On;
                if let Some(count) = if on { &mut *ons } else { &mut *offs }.get_mut(bin) {
                    *count += 1;
                }
            }
        }
    }

    fn count_in_windows(&mut self, events: &[CdEvent]) {
        let mut kept: usize = self.open.iter().map(|o| o.events.len()).sum();
        for open in &mut self.open {
            let w = &open.window;
            let start = first_from(events, w.start_us);
            let idle = first_from(events, w.idle_start_us)..start;
            open.idle_events += idle.len() as u64;
            let events = &events[start..first_from(events, w.end_us).max(start)];
            let too_many = |most| AnalysisError::TooManyEvents {
                camera: self.camera,
                press: PressId::from_index(w.row as u32),
                most,
            };
            let mut fits = open.grid.add_all(events);
            if self.estimator.is_some() {
                kept += events.len();
                if kept > self.most_kept {
                    self.error = Some(too_many(self.most_kept));
                    return;
                }
                for event in events {
                    let packed = PackedEvent::pack(event, w.start_us);
                    fits &= packed.is_some();
                    open.events.extend(packed);
                }
            }
            if !fits {
                self.error = Some(too_many(u32::MAX as usize));
                return;
            }
            let on = events.iter().filter(|e| e.polarity == Polarity::On);
            if let Some(grid) = &mut open.on {
                on.clone().for_each(|e| {
                    grid.add(e.x, e.y);
                });
            }
            open.on_events += on.count() as u32;
        }
    }

    /// Opens windows that begin and closes those that have ended, by the newest time seen.
    fn advance(&mut self) {
        let now = self.newest_us;
        let mut i = 0;
        while i < self.open.len() {
            if self.open[i].window.end_us + SLACK_US <= now {
                let done = self.open.remove(i);
                self.close(done);
            } else {
                i += 1;
            }
        }
        while let Some(&window) = self.windows.get(self.next) {
            if window.idle_start_us > now.saturating_add(SLACK_US) {
                break;
            }
            self.next += 1;
            self.open_window(window);
        }
        while let Some((plan, ..)) = self.zooms.get(self.zoom_next) {
            if plan.start_us + plan.bins as u64 * self.bin_us + SLACK_US > now {
                break;
            }
            self.zoom_next += 1;
        }
        self.event_collector.advance(now.saturating_sub(SLACK_US));
        self.phase_collector.advance(now.saturating_sub(SLACK_US));
        let closes = self.open.iter().map(|o| o.window.end_us + SLACK_US);
        let opens = self
            .windows
            .get(self.next)
            .map(|w| w.idle_start_us.saturating_sub(SLACK_US));
        self.quiet_until_us = closes.chain(opens).min().unwrap_or(u64::MAX);
    }

    fn open_window(&mut self, window: Window) {
        let mut fresh = self.spare.pop().unwrap_or_else(|| OpenWindow {
            window,
            grid: PixelGrid::new(self.crop),
            on_events: 0,
            idle_events: 0,
            on: None,
            events: Vec::new(),
        });
        fresh.window = window;
        if self.pictured.iter().any(|(row, _)| *row == window.row) {
            fresh.on = Some(PixelGrid::new(self.crop));
        }
        self.open.push(fresh);
    }

    fn close(&mut self, mut done: OpenWindow) {
        let window = done.window;
        let core_threshold = window.core_threshold(self.settings, self.camera, done.idle_events);
        if self.estimator.is_none() || done.on.is_some() {
            self.dbscan.set_min_samples(core_threshold);
            self.dbscan.run(&done.grid);
        }
        let sighting = match &mut self.estimator {
            None => ColumnEstimate::of_clusters(&self.dbscan, self.settings.centroid, 1),
            Some(estimator) => {
                done.events.sort_unstable();
                estimator.estimate(&done.events, 0, core_threshold)
            }
        };
        let tally = EventCounts {
            events: done.grid.events(),
            on: done.on_events,
            idle: done.idle_events,
            core_threshold: (self.settings.estimator == Estimator::Dbscan)
                .then_some(core_threshold),
            width_u: width_u(&done.grid, done.idle_events, &window),
        };
        self.views
            .push((window.row, press_view(&window, tally, &sighting)));
        if let Some(on) = done.on.take()
            && let Some((_, press)) = self.pictured.iter().find(|(row, _)| *row == window.row)
        {
            self.pictures.push(self.picture(*press, &done.grid, &on));
        }
        done.grid.clear();
        done.events.clear();
        done.on_events = 0;
        done.idle_events = 0;
        self.spare.push(done);
    }

    fn picture(&self, press: PressId, grid: &PixelGrid, on: &PixelGrid) -> PressPicture {
        let largest = self.dbscan.largest().map(|(label, _)| label);
        let clusters = self.settings.estimator == Estimator::Dbscan;
        let makes_centroid = |label: u32| match self.settings.centroid {
            // Without clusters, every event votes.
            _ if !clusters => true,
            CentroidRule::LargestCluster => Some(label) == largest,
            CentroidRule::AllClusters => label != crate::dbscan::NOISE,
        };
        let pixels = self.dbscan.labels().map(|(index, label)| PicturePixel {
            u: (index % PixelGrid::WIDTH as u32) as u16,
            v: (index / PixelGrid::WIDTH as u32) as u16 + grid.rows().0,
            on: on.count(index),
            off: grid.count(index) - on.count(index),
            clustered: makes_centroid(label),
        });
        PressPicture {
            press,
            camera: self.camera,
            rows: grid.rows(),
            pixels: pixels.collect(),
        }
    }

    /// Ends the pass: closes open windows; windows without events are empty.
    pub(crate) fn finish(mut self) -> Result<PassOutput, AnalysisError> {
        while !self.open.is_empty() {
            let done = self.open.remove(0);
            self.close(done);
        }
        for i in self.next..self.windows.len() {
            self.open_window(self.windows[i]);
            if let Some(done) = self.open.pop() {
                self.close(done);
            }
        }
        if let Some(error) = self.error {
            return Err(error);
        }
        let bin_s = self.bin_us as f64 * 1e-6;
        let per_s = |counts: &[u32]| {
            let rate = |c: &u32| (f64::from(*c) / bin_s) as f32;
            counts.iter().map(rate).collect::<Vec<f32>>()
        };
        let zooms = self.zooms.iter().map(|(plan, ons, offs)| RateZoom {
            press: plan.press,
            camera: self.camera,
            start_s: plan.start_s,
            bin_s,
            on_per_s: per_s(ons),
            off_per_s: per_s(offs),
            release_s: plan.release_s,
        });
        Ok(PassOutput {
            zooms: zooms.collect(),
            kept: self.event_collector.finish(),
            phases: self.phase_collector.finish(),
            activity: self.activity.map(|a| a.result(self.camera)),
            rates: self.rates,
            views: self.views,
            pictures: self.pictures,
            cache: self.cache.filter(|_| self.late == 0),
            pixels: self.pixels,
            late: self.late,
            repeated: self.repeated,
            off_sensor: self.off_sensor,
        })
    }
}

fn is_on_sensor(event: &CdEvent) -> bool {
    (event.x < SENSOR_WIDTH) & (event.y < SENSOR_HEIGHT)
}

/// Index of the first event, in time order, at or after `time_us`.
fn first_from(events: &[CdEvent], time_us: u64) -> usize {
    events.partition_point(|e| e.t_us < time_us)
}

/// Runs one pass over the events of a camera.
pub(crate) fn pass(
    source: &dyn EventSource,
    camera: CameraId,
    mut accumulator: Accumulator<'_>,
) -> Result<PassOutput, AnalysisError> {
    source
        .for_each_slice(camera, &mut |events| accumulator.take(events))
        .map_err(|source| AnalysisError::Events { camera, source })?;
    accumulator.finish()
}

#[cfg(test)]
mod tests;
