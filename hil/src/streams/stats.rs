//! Statistics of one camera's stream, and detection of a stalled camera.

use skinrig_model::{CameraId, DeviceRole, HostDuration, HostTime, RawChunk};

use crate::bench::Problem;
use crate::device_evidence;

/// Time without progress of the camera clock that counts as a stall. Every format repeats its time
/// base every few milliseconds.
const STALLED_AFTER: HostDuration = HostDuration::from_millis(2_000);

/// Counts of a camera's stream since counting started.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct StreamStats {
    /// Received bytes.
    pub bytes: u64,
    /// Bytes known to be lost.
    pub lost_bytes: u64,
    /// Number of losses.
    pub losses: u64,
    /// Camera time at the first and at the last counted data, µs.
    pub span_us: Option<(u64, u64)>,
    /// Notes of the driver about the stream.
    pub notes: Vec<String>,
}

impl StreamStats {
    /// Length of the stream on the camera's clock, s; `None` if the clock did not advance.
    #[must_use]
    pub(crate) fn span_s(&self) -> Option<f64> {
        let (from, to) = self.span_us?;
        (to > from).then(|| (to - from) as f64 * 1e-6)
    }
}

/// One streaming camera.
#[derive(Default)]
pub(super) struct CameraStream {
    pub stats: StreamStats,
    /// Why the camera stopped streaming.
    pub problem: Option<Problem>,
    /// Latest camera time, µs.
    latest_us: Option<u64>,
    /// Host time at which the camera time last advanced.
    pub advanced_at: HostTime,
}

impl CameraStream {
    /// Starts counting.
    pub(crate) fn start_counting(&mut self) {
        self.stats = StreamStats {
            span_us: self.latest_us.map(|us| (us, us)),
            ..StreamStats::default()
        };
    }

    /// Updates the camera time from a chunk received at `now`, and adds the chunk to the counts if `counts`.
    pub(crate) fn add_chunk(&mut self, chunk: &RawChunk, now: HostTime, counts: bool) {
        if let Some(us) = chunk.facts.last_us {
            if self.latest_us != Some(us) {
                self.advanced_at = now;
            }
            self.latest_us = Some(us);
            if counts {
                let first = chunk.facts.first_us.unwrap_or(us);
                self.stats.span_us.get_or_insert((first, first)).1 = us;
            }
        }
        if counts {
            self.stats.bytes += chunk.bytes.len() as u64;
            self.stats.lost_bytes += chunk.lost_before;
            self.stats.losses += u64::from(chunk.lost_before > 0);
        }
    }

    /// Evidence of a stall if the camera time has not advanced for too long. `timing_slack` extends
    /// the limit for emulated devices.
    pub(crate) fn check_stall(
        &self,
        camera: CameraId,
        now: HostTime,
        timing_slack: HostDuration,
    ) -> Option<Problem> {
        if now - self.advanced_at <= STALLED_AFTER + timing_slack {
            return None;
        }
        let what = match self.latest_us {
            Some(us) => format!(
                "{camera}: expected its clock to advance, found it stopped at {:.6} s",
                us as f64 * 1e-6
            ),
            None => format!("{camera}: expected a stream, found nothing"),
        };
        Some(device_evidence::silent(DeviceRole::of_camera(camera), what))
    }
}
