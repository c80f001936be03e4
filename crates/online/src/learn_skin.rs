//! Learns a skin: how its touches begin and fade, the threshold, and how positions settle, each from the calibration presses.

use skinrig_analysis::{Analysis, EventSource};
use skinrig_model::CameraId;

use crate::depth::{DepthCourse, DepthModel, Instant};
use crate::detector::Felt;
use crate::interleave::interleave;
use crate::learn::learn;
use crate::position::Position;
use crate::settling::{Course, Settling};
use crate::skin_model::SkinModel;
use crate::stream::{Estimate, StreamSettings, TouchStream};
use crate::threshold::{IdleStatistic, ThresholdError};
use crate::tip::{TipCourse, TipCourses};
use crate::training::{MARGIN_US, Training, TrainingPress};

/// Host time between two positions of a calibration press, µs.
const EVERY_US: i64 = 5_000;

impl SkinModel {
    /// Learns from the calibration presses of an analysis, whose events are `source` and whose depths are `tips` (empty if they were not
    /// measured), for at most this many false alarms per second (above 0).
    ///
    /// # Errors
    /// [`ThresholdError`]: too few calibration presses or too little idle time, no common time, or unreadable events.
    pub fn learn(
        analysis: &Analysis,
        source: &dyn EventSource,
        tips: &TipCourses,
        false_alarms_per_s: f64,
    ) -> Result<Self, ThresholdError> {
        let training = Training::of(analysis)?;
        let touches = learn(&training, source)?;
        let idle = IdleStatistic::measure(&touches, &training, source, |_, _| true)?;
        let mut skin = Self {
            settings: analysis.settings.clone(),
            outline: analysis.rig.outline,
            geometry: analysis.geometry,
            locator: analysis.locator.clone(),
            hot_pixels: analysis.hot_pixels.clone(),
            clocks: *training.clocks(),
            threshold: idle.threshold(false_alarms_per_s),
            settling: None,
            depths: None,
            longest_window_us: training.longest_window_us(&analysis.settings),
            idle_s: idle.seconds(),
            clocks_at_us: training.middle_us(),
            touches,
        };
        let felt = feel(&skin, &training, source)?;
        let own: Vec<_> = training
            .presses
            .iter()
            .filter_map(|p| Some((p, felt.during(p)?)))
            .collect();
        let settling: Vec<Course> = own.iter().map(|(_, touch)| course(touch)).collect();
        skin.settling = Settling::learn(&settling);
        let depths = own
            .iter()
            .filter_map(|(press, touch)| Some(depth_course(press, touch, tips.get(&press.press)?)));
        skin.depths = DepthModel::learn(depths.collect());
        Ok(skin)
    }
}

/// Positions of a touch, with their host times, µs.
type Touch = Vec<(i64, Position)>;

/// Touches with their onsets, host µs.
#[derive(Default)]
struct Touches {
    ended: Vec<(i64, Touch)>,
    open: Option<(i64, Touch)>,
}

impl Touches {
    fn add(&mut self, estimate: Estimate) {
        match estimate {
            Estimate::Felt(d) => {
                self.ended.extend(self.open.take());
                self.open = (d.felt == Felt::Onset).then(|| (d.host_us, Touch::new()));
            }
            Estimate::Position { host_us, position } => {
                if let Some((_, touch)) = &mut self.open {
                    touch.push((host_us, position));
                }
            }
        }
    }

    /// The touch that began during a press.
    fn during(&self, press: &TrainingPress) -> Option<&Touch> {
        let during = press.contact_us - MARGIN_US..press.release_us;
        let all = self.ended.iter().chain(&self.open);
        let mut own = all.filter(|(onset_us, _)| during.contains(&(*onset_us as f64)));
        own.next().map(|(_, touch)| touch)
    }
}

fn course(touch: &Touch) -> Course {
    let located = |(_, p): &(i64, Position)| Some((p.clustered, p.location?.at));
    touch.iter().filter_map(located).collect()
}

fn depth_course(press: &TrainingPress, touch: &Touch, tip: &TipCourse) -> DepthCourse {
    let instant = |(host_us, position): &(i64, Position)| {
        let located = position.location.filter(|_| position.complete)?;
        let instant = Instant {
            counts: position.rising,
            depth_mm: tip.reached_mm(*host_us as f64)?,
        };
        Some((instant, located.at))
    };
    DepthCourse {
        location: press.location,
        at: press.at,
        instants: touch.iter().filter_map(instant).collect(),
    }
}

/// Feels and locates the calibration presses as they will be later.
///
/// # Errors
/// [`ThresholdError`] if the events cannot be read or the cameras have no common time.
fn feel(
    skin: &SkinModel,
    training: &Training,
    source: &dyn EventSource,
) -> Result<Touches, ThresholdError> {
    let settings = StreamSettings {
        every_us: EVERY_US,
        from_us: 0,
    };
    let mut stream = TouchStream::new(skin, settings)?;
    let mut touches = Touches::default();
    let end_us = (training.end_us() + 10.0 * MARGIN_US) as i64;
    interleave(source, &training.clocks, |camera, events, next_us| {
        let mut add = |estimate| touches.add(estimate);
        for camera in CameraId::ALL {
            let reached = Some(next_us[camera.index()]);
            let promised = stream.push(camera, &[], reached, &mut add);
            debug_assert!(promised.is_ok(), "no events, so none that are too many");
        }
        stream.push(camera, events, None, &mut add).is_ok() && stream.detector().now_us() < end_us
    })?;
    stream.finish(|estimate| touches.add(estimate));
    Ok(touches)
}
