//! Learns a skin: how its touches begin and fade, the threshold, and how positions settle, each from the calibration presses.

use skinrig_analysis::{Analysis, EventSource};
use skinrig_model::CameraId;

use crate::detector::Felt;
use crate::interleave::interleave;
use crate::learn::learn;
use crate::settling::{Course, Settling};
use crate::skin_model::SkinModel;
use crate::stream::{Estimate, StreamSettings, TouchStream};
use crate::threshold::{IdleStatistic, ThresholdError};
use crate::training::{MARGIN_US, Training};

/// Host time between two positions of a calibration press, µs.
const EVERY_US: i64 = 5_000;

impl SkinModel {
    /// Learns from the calibration presses of an analysis, whose events are `source`, for at most this many false alarms per second
    /// (above 0).
    ///
    /// # Errors
    /// [`ThresholdError`]: too few calibration presses or too little idle time, no common time, or unreadable events.
    pub fn learn(
        analysis: &Analysis,
        source: &dyn EventSource,
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
            longest_window_us: training.longest_window_us(&analysis.settings),
            idle_s: idle.seconds(),
            clocks_at_us: training.middle_us(),
            touches,
        };
        skin.settling = settling(&skin, &training, source)?;
        Ok(skin)
    }
}

/// A course under way.
#[derive(Default)]
struct Courses {
    /// Onset, host µs, and course.
    ended: Vec<(i64, Course)>,
    open: Option<(i64, Course)>,
}

impl Courses {
    fn add(&mut self, estimate: Estimate) {
        match estimate {
            Estimate::Felt(d) => {
                self.ended.extend(self.open.take());
                self.open = (d.felt == Felt::Onset).then(|| (d.host_us, Course::new()));
            }
            Estimate::Position { position, .. } => {
                if let (Some((_, course)), Some(at)) = (&mut self.open, position.location) {
                    course.push((position.clustered, at.at));
                }
            }
        }
    }
}

/// Feels and locates the calibration presses as they will be later; `None` if they are too few for regions.
///
/// # Errors
/// [`ThresholdError`] if the events cannot be read or the cameras have no common time.
fn settling(
    skin: &SkinModel,
    training: &Training,
    source: &dyn EventSource,
) -> Result<Option<Settling>, ThresholdError> {
    let settings = StreamSettings {
        every_us: EVERY_US,
        from_us: 0,
    };
    let mut stream = TouchStream::new(skin, settings)?;
    let mut courses = Courses::default();
    let end_us = (training.end_us() + 10.0 * MARGIN_US) as i64;
    interleave(source, &training.clocks, |camera, events, next_us| {
        let mut add = |estimate| courses.add(estimate);
        for camera in CameraId::ALL {
            let reached = Some(next_us[camera.index()]);
            let promised = stream.push(camera, &[], reached, &mut add);
            debug_assert!(promised.is_ok(), "no events, so none that are too many");
        }
        stream.push(camera, events, None, &mut add).is_ok() && stream.detector().now_us() < end_us
    })?;
    stream.finish(|estimate| courses.add(estimate));
    courses.ended.extend(courses.open);
    let felt = courses.ended;
    let of_press = |contact_us: f64, release_us: f64| {
        let during = contact_us - MARGIN_US..release_us;
        felt.iter()
            .find(|(onset_us, _)| during.contains(&(*onset_us as f64)))
    };
    let presses = training.presses.iter();
    let own: Vec<Course> = presses
        .filter_map(|p| Some(of_press(p.contact_us, p.release_us)?.1.clone()))
        .collect();
    Ok(Settling::learn(&own))
}
