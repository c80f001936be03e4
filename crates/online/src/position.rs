//! The position of a touch at every instant: the events of its window so far, through the estimator and locator of the analysis.

use serde::Serialize;
use skinrig_analysis::Analysis;
use skinrig_analysis::background::Background;
use skinrig_analysis::estimators::{PressEstimator, Thinning};
use skinrig_analysis::hot_pixels::HotPixelMask;
use skinrig_analysis::locator::{CameraFeatures, FittedLocator, Location, LocatorModelError};
use skinrig_analysis::press_events::PackedEvent;
use skinrig_analysis::result::{HotPixels, LocationOutcome, Region};
use skinrig_analysis::segment::Window;
use skinrig_model::{
    AnalysisSettings, CameraId, CdEvent, SENSOR_HEIGHT, SENSOR_WIDTH, SkinOutline, TouchDepth,
};

use crate::direction::Agreement;
use crate::history::History;
use crate::rise::{Count, Excess, RECENT_US, Rise};

/// Events of a window in each camera: 32 MiB.
const MOST: usize = 1 << 22;

/// Level of the region of a complete press.
const LAST: f64 = 0.99;

/// A position so far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position {
    /// As the analysis states it.
    pub outcome: LocationOutcome,
    /// Position with its flag, and the region that the locator states for a complete press; `None` without one.
    pub location: Option<Location>,
    /// 95 % region that holds at every instant of the touch; `None` if the calibration presses do not determine it.
    pub region: Option<Region>,
    /// Events of the window so far, in each camera.
    pub events: [u32; 2],
    /// Clustered events in the weaker camera.
    pub clustered: u32,
    /// Depth that the touch has reached; `None` if the calibration presses do not determine it.
    pub depth: Option<TouchDepth>,
    /// Events of each camera, until the tip rested or turned back.
    pub(crate) rising: [Count; 2],
    /// False if a window began before the events that are kept, or holds too many: some did not count.
    pub complete: bool,
}

/// A position as other programs read it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PositionRow {
    /// mm.
    pub at_mm: [f64; 2],
    /// 95 % region that holds at every instant of the touch; `None` if the calibration presses do not determine it.
    pub region: Option<Region>,
    /// Depth that the touch has reached; `None` if the calibration presses do not determine it.
    pub depth: Option<TouchDepth>,
}

impl Position {
    /// The row; `None` without a position.
    #[must_use]
    pub fn row(&self) -> Option<PositionRow> {
        let location = self.location?;
        Some(PositionRow {
            at_mm: location.at,
            region: self.region,
            depth: self.depth,
        })
    }
}

/// Window of a touch in one camera.
#[derive(Debug, Clone)]
struct CameraWindow {
    rows: (u16, u16),
    hot: HotPixelMask,
    thinning: Thinning,
    estimator: PressEstimator,
    /// The newest events, to which a window can reach back.
    history: History,
    from_us: Option<u64>,
    /// Of the idle time before the window.
    background: Background,
    /// Events since the start of the window.
    events: Vec<PackedEvent>,
    /// Number of the first events that are in order.
    in_order: usize,
    complete: bool,
}

impl CameraWindow {
    fn new(settings: &AnalysisSettings, hot: &HotPixels, camera: CameraId) -> Self {
        let rows = settings.crop_v[camera.index()];
        Self {
            rows,
            hot: HotPixelMask::new(hot),
            thinning: Thinning::new(settings.thinning, camera, settings.seed),
            estimator: PressEstimator::new(settings, rows),
            history: History::new(),
            from_us: None,
            background: Background::default(),
            events: Vec::with_capacity(MOST),
            in_order: 0,
            complete: true,
        }
    }

    fn counts(&self, e: &CdEvent) -> bool {
        let on_sensor = e.x < SENSOR_WIDTH && e.y < SENSOR_HEIGHT;
        on_sensor
            && (self.rows.0..=self.rows.1).contains(&e.y)
            && !self.hot.holds(e)
            && self.thinning.keeps(e)
    }

    fn push(&mut self, event: &CdEvent) {
        if !self.counts(event) {
            return;
        }
        if let Some(from_us) = self.from_us {
            add(&mut self.events, &mut self.complete, event, from_us);
        }
        self.history.push(*event);
    }

    fn open(&mut self, Opening { idle_us, from_us }: Opening) {
        (self.from_us, self.in_order) = (Some(from_us), 0);
        let forgotten_us = self.history.forgotten_us();
        self.complete = forgotten_us.is_none_or(|forgotten| forgotten < idle_us.min(from_us));
        let idle_us = forgotten_us.map_or(idle_us, |f| idle_us.max(f + 1));
        self.background = Background {
            events: self.history.count(&(idle_us..from_us)) as u64,
            idle_us: from_us.saturating_sub(idle_us),
        };
        self.events.clear();
        for event in self.history.from(from_us) {
            add(&mut self.events, &mut self.complete, event, from_us);
        }
    }

    fn close(&mut self) {
        self.from_us = None;
        self.events.clear();
    }

    /// What the events until `until_us` give.
    fn seen(&mut self, settings: &AnalysisSettings, camera: CameraId, until_us: u64) -> Seen {
        let Some(from_us) = self.from_us else {
            return Seen::default();
        };
        put_in_order(&mut self.events, self.in_order);
        self.in_order = self.events.len();
        let before = |us: u64| self.events.partition_point(|e| u64::from(e.t_us()) < us);
        let end = until_us.saturating_sub(from_us);
        let (count, earlier) = (before(end), before(end.saturating_sub(RECENT_US)));
        let excess = |events: usize, us: u64| events as f64 - self.background.events_in(us);
        let recent_us = end.min(RECENT_US);
        let threshold = self.background.core_threshold(settings, camera, end);
        let estimate = self.estimator.estimate(&self.events[..count], 0, threshold);
        Seen {
            features: CameraFeatures::from(&estimate),
            events: count as u32,
            count: Count {
                all: count as f64,
                beyond: excess(count, end),
            },
            recent: excess(count - earlier, recent_us),
            idle: self.background.events_in(recent_us),
            agreement: Agreement::of(&self.events[..earlier], &self.events[earlier..count]),
        }
    }
}

/// Adds an event to those of a window that begins at `from_us`, if it is one of them and there is room.
fn add(events: &mut Vec<PackedEvent>, complete: &mut bool, event: &CdEvent, from_us: u64) {
    if event.t_us < from_us {
        return;
    }
    match PackedEvent::pack(event, from_us) {
        Some(packed) if events.len() < MOST => events.push(packed),
        _ => *complete = false,
    }
}

/// Sorts events whose first `ordered` are in order, at the cost of those that are not and of what they belong before.
fn put_in_order(events: &mut [PackedEvent], ordered: usize) {
    let Some(least) = events[ordered..].iter().min() else {
        return;
    };
    let from = events[..ordered].partition_point(|e| e <= least);
    events[from..].sort_unstable();
}

/// What a camera has seen of a touch.
#[derive(Default)]
struct Seen {
    features: CameraFeatures,
    events: u32,
    count: Count,
    /// Recent events beyond the idle rate,
    recent: f64,
    /// and those that are expected of an idle skin.
    idle: f64,
    /// Of the recent events with those before.
    agreement: Agreement,
}

/// Where a window begins in one camera, µs of camera time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Opening {
    /// Start of the idle time before the window, which tells the background; `from_us` if there is none.
    pub idle_us: u64,
    /// Start of the window.
    pub from_us: u64,
}

impl From<Window> for Opening {
    fn from(window: Window) -> Self {
        Self {
            idle_us: window.idle_start_us,
            from_us: window.start_us,
        }
    }
}

/// Locates touches in the events of both cameras. With the window of a press it gives, at the end of that window, the bits of
/// the analysis.
#[derive(Debug, Clone)]
pub struct PositionEstimator {
    settings: AnalysisSettings,
    cameras: [CameraWindow; 2],
    rise: Rise,
    locator: FittedLocator,
    outline: SkinOutline,
}

impl PositionEstimator {
    /// With the settings and the locator of an analysis.
    ///
    /// # Errors
    /// [`LocatorModelError`] if its locator cannot be rebuilt.
    pub fn of(analysis: &Analysis) -> Result<Self, LocatorModelError> {
        let locator = FittedLocator::of(analysis)?;
        Ok(Self::with(
            &analysis.settings,
            &analysis.hot_pixels,
            locator,
            analysis.rig.outline,
        ))
    }

    pub(crate) fn with(
        settings: &AnalysisSettings,
        hot: &[HotPixels; 2],
        locator: FittedLocator,
        outline: SkinOutline,
    ) -> Self {
        Self {
            settings: settings.clone(),
            cameras: CameraId::ALL
                .map(|camera| CameraWindow::new(settings, &hot[camera.index()], camera)),
            rise: Rise::default(),
            locator,
            outline,
        }
    }

    /// Adds the next events of a camera.
    pub fn push(&mut self, camera: CameraId, events: &[CdEvent]) {
        let window = &mut self.cameras[camera.index()];
        events.iter().for_each(|event| window.push(event));
    }

    /// Opens a window; its events and those of its idle time may have been pushed already.
    pub fn open(&mut self, openings: [Opening; 2]) {
        self.rise = Rise::default();
        for (window, opening) in self.cameras.iter_mut().zip(openings) {
            window.open(opening);
        }
    }

    /// Closes the window.
    pub fn close(&mut self) {
        self.cameras.iter_mut().for_each(CameraWindow::close);
    }

    /// The 99 % region that the locator states for a complete press at this position.
    pub(crate) fn last_region(&self, position: &Position) -> Option<Region> {
        self.locator.at_level(position.location?.region?, LAST)
    }

    /// The position by the events before these times of the cameras, µs; without the region that holds at every instant.
    #[must_use]
    pub fn position(&mut self, until_us: [u64; 2]) -> Position {
        let settings = &self.settings;
        let seen = CameraId::ALL.map(|camera| {
            let k = camera.index();
            self.cameras[k].seen(settings, camera, until_us[k])
        });
        let [one, two] = &seen;
        self.rise.add(Excess {
            counts: [one.count, two.count],
            recent: one.recent + two.recent,
            idle: one.idle + two.idle,
            reversal: one.agreement.and(two.agreement).reversal(),
        });
        let (outcome, location) = self
            .locator
            .outcome(&self.outline, [one.features, two.features]);
        Position {
            outcome,
            location,
            region: None,
            events: [one.events, two.events],
            clustered: one.features.cluster_events.min(two.features.cluster_events),
            depth: None,
            rising: self.rise.counts(),
            complete: self.cameras.iter().all(|c| c.complete),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn events_that_come_late_are_put_in_order(times in prop::collection::vec(0_u64..40, 0..60), cuts in prop::collection::vec(0_usize..60, 0..5)) {
            let packed = |t_us: &u64| {
                let event = CdEvent { t_us: *t_us, x: 1, y: 200, polarity: skinrig_model::Polarity::On };
                PackedEvent::pack(&event, 0).unwrap()
            };
            let arrived: Vec<PackedEvent> = times.iter().map(packed).collect();
            let (mut events, mut ordered) = (Vec::new(), 0);
            let mut cuts: Vec<usize> = cuts.into_iter().map(|c| c.min(arrived.len())).collect();
            cuts.extend([0, arrived.len()]);
            cuts.sort_unstable();
            for part in cuts.windows(2) {
                events.extend_from_slice(&arrived[part[0]..part[1]]);
                put_in_order(&mut events, ordered);
                ordered = events.len();
                let mut all = arrived[..part[1]].to_vec();
                all.sort_unstable();
                prop_assert_eq!(&events, &all);
            }
        }
    }
}
