//! Statistics of the events of a session.

use skinrig_analysis::event_statistics::{
    EventStatistics, EventStatisticsCollector, PressStatistics, PressStatisticsCollector,
};
use skinrig_analysis::{Analysis, EventSource, EventSourceError};
use skinrig_model::CameraId;

use crate::SessionEvents;

/// Statistics of both cameras; those around presses need an analysis, which gives the clocks of the cameras.
///
/// # Errors
/// [`EventSourceError`] when the events cannot be read.
pub fn event_statistics(
    events: &SessionEvents,
    analysis: Option<&Analysis>,
) -> Result<[EventStatistics; 2], EventSourceError> {
    let of = |camera| of_camera(events, camera, analysis);
    let (one, two) = rayon::join(|| of(CameraId::One), || of(CameraId::Two));
    Ok([one?, two?])
}

/// Statistics of both cameras around the presses of an analysis, and no other.
///
/// # Errors
/// [`EventSourceError`] when the events cannot be read.
pub fn press_statistics(
    events: &SessionEvents,
    analysis: &Analysis,
) -> Result<[PressStatistics; 2], EventSourceError> {
    let of = |camera| -> Result<PressStatistics, EventSourceError> {
        let mut collector = PressStatisticsCollector::new(&presses(camera, analysis));
        events.for_each_slice(camera, &mut |slice| collector.push(slice))?;
        Ok(collector.finish())
    };
    let (one, two) = rayon::join(|| of(CameraId::One), || of(CameraId::Two));
    Ok([one?, two?])
}

fn of_camera(
    events: &SessionEvents,
    camera: CameraId,
    analysis: Option<&Analysis>,
) -> Result<EventStatistics, EventSourceError> {
    let presses = analysis.map_or_else(Vec::new, |a| presses(camera, a));
    let mut collector = EventStatisticsCollector::new(&presses);
    events.for_each_slice(camera, &mut |slice| collector.push(slice))?;
    Ok(collector.finish(camera))
}

/// Contact and lift of each press on the clock of the camera, us; empty if the clock is not known.
fn presses(camera: CameraId, analysis: &Analysis) -> Vec<(f64, f64)> {
    let Some(clock) = analysis.clocks[camera.index()] else {
        return Vec::new();
    };
    let timings = analysis.presses.iter().filter_map(|p| p.timing);
    let times =
        timings.map(|t| [t.contact, t.retract].map(|at| clock.camera_us(at.as_secs_f64() * 1e6)));
    times
        .map(|[contact_us, lift_us]| (contact_us, lift_us))
        .collect()
}
