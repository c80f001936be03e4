//! Statistics of the events of a session.

use skinrig_analysis::event_statistics::{EventStatistics, EventStatisticsCollector};
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

fn of_camera(
    events: &SessionEvents,
    camera: CameraId,
    analysis: Option<&Analysis>,
) -> Result<EventStatistics, EventSourceError> {
    let clock = analysis.and_then(|a| a.clocks[camera.index()]);
    let timings = analysis
        .iter()
        .flat_map(|a| &a.presses)
        .filter_map(|p| p.timing);
    let presses: Vec<(f64, f64)> = match clock {
        Some(clock) => timings
            .map(|t| [t.contact, t.retract].map(|at| clock.camera_us(at.as_secs_f64() * 1e6)))
            .map(|[contact_us, lift_us]| (contact_us, lift_us))
            .collect(),
        None => Vec::new(),
    };
    let mut collector = EventStatisticsCollector::new(&presses);
    events.for_each_slice(camera, &mut |slice| collector.push(slice))?;
    Ok(collector.finish(camera))
}
