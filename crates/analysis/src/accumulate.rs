//! One pass over a camera's events: rates, the pixel counts of each press, and a few close-ups.
//!
//! Memory holds one pixel grid per window that is open at a time; for an estimator that needs the events themselves also
//! those of the open windows, up to [`MOST_KEPT`]. Events may be out of order by up to
//! [`SLACK_US`]; later ones are counted as late and reported, never silently dropped.

use skinrig_model::{
    AnalysisSettings, CameraId, CdEvent, CentroidRule, Estimator, Polarity, PressId, SENSOR_HEIGHT,
    SENSOR_WIDTH,
};

use crate::activity::ActivityGrid;
use crate::dbscan::Dbscan;
use crate::error::AnalysisError;
use crate::estimators::{PressEstimator, Sighting, Thinning};
use crate::grid::PixelGrid;
use crate::held::Held;
use crate::input::EventSource;
use crate::keeper::{KeepPlan, Keeper};
use crate::kept::KeptEvent;
use crate::rates::RateHistogram;
use crate::result::{Activity, OffSensor, PicturePixel, PressPicture, PressView, RateZoom};
use crate::segment::Window;
use crate::width::width_u;

/// How far an event may lie before the newest one seen and still find its window open, µs.
pub(crate) const SLACK_US: u64 = 10_000;

/// Most events of the open windows of a camera that are kept for an estimator: 512 MiB.
const MOST_KEPT: usize = 1 << 26;

/// Events that are handled together, so that they stay in the processor's nearest caches.
const SLICE: usize = 1024;

/// A close-up of the rate around one press.
#[derive(Debug, Clone)]
pub(crate) struct ZoomPlan {
    pub press: PressId,
    pub start_us: u64,
    pub bins: usize,
    /// Time of the first bin after the contact, s, and the release after the contact, s.
    pub start_s: f64,
    pub release_s: f64,
}

/// Takes the place of events that are still to come.
const NO_EVENT: CdEvent = CdEvent {
    t_us: 0,
    x: 0,
    y: 0,
    polarity: Polarity::Off,
};

/// What a pass is to collect.
#[derive(Default)]
pub struct Wanted<'a> {
    /// Windows, sorted by start.
    pub windows: &'a [Window],
    /// Rows of the plan whose picture is wanted, with the press.
    pub pictured: &'a [(usize, PressId)],
    /// Close-ups of the rate, sorted by start.
    pub zooms: Vec<ZoomPlan>,
    /// Presses whose events are kept, sorted by start.
    pub kept: Vec<KeepPlan>,
    /// The histogram to fill, when this pass is to fill it; it then counts the activity, too.
    pub rates: Option<RateHistogram>,
    /// Where to hold the events of the crop for another pass.
    pub held: Option<Held>,
}

/// What one camera gives.
pub(crate) struct Accumulator<'a> {
    camera: CameraId,
    settings: &'a AnalysisSettings,
    crop: (u16, u16),
    rates: Option<RateHistogram>,
    windows: &'a [Window],
    pictured: &'a [(usize, PressId)],
    next: usize,
    open: Vec<Open>,
    spare: Vec<Open>,
    /// Nothing happens before this camera time: no window opens or closes.
    quiet_until_us: u64,
    newest_us: u64,
    late: u64,
    off_sensor: OffSensor,
    thinning: Thinning,
    dbscan: Dbscan,
    /// An estimator other than clusters of single pixels, and the windows keep their events for it.
    estimator: Option<PressEstimator>,
    most_kept: usize,
    zooms: Vec<(ZoomPlan, Vec<u32>, Vec<u32>)>,
    zoom_next: usize,
    keeper: Keeper,
    activity: Option<ActivityGrid>,
    held: Option<Held>,
    /// Room for the events of a slice that lie in the crop.
    inside: Vec<CdEvent>,
    bin_us: u64,
    views: Vec<(usize, PressView)>,
    pictures: Vec<PressPicture>,
    error: Option<AnalysisError>,
}

/// A window that is collecting events.
struct Open {
    window: Window,
    grid: PixelGrid,
    on_events: u32,
    idle_events: u64,
    /// ON events per pixel, only for a pictured press.
    on: Option<PixelGrid>,
    /// For an estimator that needs them; time after the start of the window.
    events: Vec<KeptEvent>,
}

/// How many events a press has in one camera.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tally {
    /// In its window.
    pub events: u32,
    /// Of them ON.
    pub on: u32,
    /// In the idle time before it.
    pub idle: u64,
    /// See [`PressView::width_u`].
    pub width_u: Option<f64>,
}

/// What one camera saw of a press.
pub(crate) fn press_view(window: &Window, tally: Tally, sighting: &Sighting) -> PressView {
    let per_s = |n: f64, s: f64| if s > 0.0 { n / s } else { 0.0 };
    PressView {
        events: tally.events,
        on_events: tally.on,
        clusters: sighting.clusters,
        cluster_events: sighting.events,
        centroid_u: sighting.column,
        centroid_v: sighting.row,
        rate_per_s: per_s(f64::from(tally.events), window.length_s()),
        idle_rate_per_s: per_s(tally.idle as f64, window.idle_s()),
        idle_s: window.idle_s(),
        spread_u: sighting.spread_u,
        width_u: tally.width_u,
    }
}

/// What [`Accumulator::finish`] gives.
pub struct Accumulated {
    pub rates: Option<RateHistogram>,
    /// (row of the plan, view).
    pub views: Vec<(usize, PressView)>,
    pub pictures: Vec<PressPicture>,
    pub zooms: Vec<RateZoom>,
    /// Whole views only.
    pub kept: Vec<KeepPlan>,
    pub activity: Option<Activity>,
    /// The events of the crop, all that another pass needs; `None` unless all of them could be held and none was late.
    pub held: Option<Held>,
    /// Events that came more than [`SLACK_US`] after newer ones.
    pub late: u64,
    /// Events outside the sensor, left out; all zero for a pass over held events.
    pub off_sensor: OffSensor,
}

impl<'a> Accumulator<'a> {
    /// Collects what is `wanted`.
    pub fn new(camera: CameraId, settings: &'a AnalysisSettings, wanted: Wanted<'a>) -> Self {
        let Wanted {
            windows,
            pictured,
            zooms,
            kept,
            rates,
            held,
        } = wanted;
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
            held,
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
            off_sensor: OffSensor::default(),
            thinning: Thinning::new(settings.thinning, camera, settings.seed),
            dbscan: Dbscan::new(settings.eps_px, settings.min_samples),
            estimator: (settings.estimator != Estimator::Dbscan || settings.bin_px > 1)
                .then(|| PressEstimator::new(settings, settings.crop_v[camera.index()])),
            most_kept: MOST_KEPT,
            zooms,
            zoom_next: 0,
            keeper: Keeper::new(kept),
            bin_us: rate_bin_us(settings),
            views: Vec::new(),
            pictures: Vec::new(),
            error: None,
        }
    }

    /// Takes the next events of the stream.
    pub fn take(&mut self, events: &[CdEvent]) {
        for slice in events.chunks(SLICE) {
            if self.error.is_some() {
                return;
            }
            // Looks at every event without a branch; only a bad slice is searched.
            let (mut on_sensor, mut in_order, mut last_us) = (true, true, 0);
            for e in slice {
                on_sensor &= is_on_sensor(e);
                in_order &= last_us <= e.t_us;
                last_us = e.t_us;
            }
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

    /// Takes at most [`SLICE`] events by time, though the first may lie before those taken so far: what a window or a close-up wants of
    /// them lies side by side.
    fn take_in_order(&mut self, events: &[CdEvent]) {
        let newest_us = self.newest_us;
        self.late += events.partition_point(|e| e.t_us.saturating_add(SLACK_US) < newest_us) as u64;
        if let Some(activity) = &mut self.activity {
            events.iter().for_each(|e| activity.add(e));
        }
        let (low, high) = self.crop;
        let mut inside = std::mem::take(&mut self.inside);
        let room = &mut inside[..SLICE];
        // Stores every event and steps on for those in the crop: no branch to mispredict.
        let mut count = 0;
        for event in events {
            // Never beyond the room, which is as long as the longest slice: the mask only tells so. As a slice of one an event is
            // copied whole, not field by field.
            let at = count % SLICE;
            room[at..=at].copy_from_slice(std::slice::from_ref(event));
            count += usize::from((low <= event.y) & (event.y <= high));
        }
        if let Some(rates) = &mut self.rates {
            rates.add_in_order(&inside[..count]);
        }
        self.held.take_if(|held| !held.add(&inside[..count]));
        self.take_inside(&inside[..count]);
        self.inside = inside;
        if let Some(last) = events.last() {
            self.newest_us = self.newest_us.max(last.t_us);
        }
    }

    /// Takes all the events that another pass has held.
    pub(crate) fn take_held(&mut self, held: &Held) {
        if held.in_order() {
            // They were looked at by the pass that held them.
            held.for_each_slice(|events| self.take_inside(events));
        } else {
            held.for_each_slice(|events| self.take(events));
        }
    }

    /// Takes events of the crop by time.
    fn take_inside(&mut self, events: &[CdEvent]) {
        let mut rest = events;
        while let Some(first) = rest.first()
            && self.error.is_none()
        {
            self.newest_us = self.newest_us.max(first.t_us);
            if self.newest_us >= self.quiet_until_us {
                self.move_on();
            }
            let (quiet, later) = rest.split_at(first_from(rest, self.quiet_until_us).max(1));
            self.count(quiet);
            rest = later;
        }
        if let Some(last) = events.last() {
            self.newest_us = self.newest_us.max(last.t_us);
        }
    }

    /// Counts events of the crop, by time, wherever they are wanted.
    fn count(&mut self, events: &[CdEvent]) {
        self.keeper.take(events);
        self.count_in_zooms(events);
        if self.thinning.keeps_all() {
            self.count_in_windows(events);
        } else {
            let kept = events.iter().filter(|e| self.thinning.keeps(e)).copied();
            let kept: Vec<CdEvent> = kept.collect();
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
                    let packed = KeptEvent::pack(event, w.start_us);
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

    /// Opens the windows that begin and closes those that are over, by the newest time seen.
    fn move_on(&mut self) {
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
        self.keeper.move_on(now.saturating_sub(SLACK_US));
        let closes = self.open.iter().map(|o| o.window.end_us + SLACK_US);
        let opens = self
            .windows
            .get(self.next)
            .map(|w| w.idle_start_us.saturating_sub(SLACK_US));
        self.quiet_until_us = closes.chain(opens).min().unwrap_or(u64::MAX);
    }

    fn open_window(&mut self, window: Window) {
        let mut fresh = self.spare.pop().unwrap_or_else(|| Open {
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

    fn close(&mut self, mut done: Open) {
        if self.estimator.is_none() || done.on.is_some() {
            self.dbscan.run(&done.grid);
        }
        let sighting = match &mut self.estimator {
            None => Sighting::of_clusters(&self.dbscan, self.settings.centroid, 1),
            Some(estimator) => {
                done.events.sort_unstable();
                estimator.sight(&done.events, 0)
            }
        };
        let tally = Tally {
            events: done.grid.events(),
            on: done.on_events,
            idle: done.idle_events,
            width_u: width_u(&done.grid, done.idle_events, &done.window),
        };
        let window = done.window;
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
            // Every event has a say where nothing is clustered.
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

    /// Ends the pass: what is open is closed, and windows that no event reached are empty.
    pub fn finish(mut self) -> Result<Accumulated, AnalysisError> {
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
        Ok(Accumulated {
            zooms: zooms.collect(),
            kept: self.keeper.finish(),
            activity: self.activity.map(|a| a.result(self.camera)),
            rates: self.rates,
            views: self.views,
            pictures: self.pictures,
            held: self.held.filter(|_| self.late == 0),
            late: self.late,
            off_sensor: self.off_sensor,
        })
    }
}

fn is_on_sensor(event: &CdEvent) -> bool {
    (event.x < SENSOR_WIDTH) & (event.y < SENSOR_HEIGHT)
}

/// The place of the first event, by time, from `time_us` on.
fn first_from(events: &[CdEvent], time_us: u64) -> usize {
    events.partition_point(|e| e.t_us < time_us)
}

/// Width of a rate bin in whole µs, at least 1.
pub(crate) fn rate_bin_us(settings: &AnalysisSettings) -> u64 {
    (settings.rate_bin_ms * 1e3).round().max(1.0) as u64
}
/// Everything that a camera's events say, in one pass over them.
pub(crate) fn pass(
    source: &dyn EventSource,
    camera: CameraId,
    mut accumulator: Accumulator<'_>,
) -> Result<Accumulated, AnalysisError> {
    source
        .for_each_slice(camera, &mut |events| accumulator.take(events))
        .map_err(|message| AnalysisError::Events { camera, message })?;
    accumulator.finish()
}

#[cfg(test)]
mod tests;
