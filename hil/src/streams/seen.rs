//! What one camera delivered while it streamed, and whether it still does.

use skinrig_model::{CameraId, DeviceRole, HostDuration, HostTime, RawChunk};

use crate::bench::Trouble;
use crate::trouble;

/// A camera whose time has not moved for so long sends no more: every format repeats its time base within milliseconds.
const STALLED_AFTER: HostDuration = HostDuration::from_millis(2_000);

/// What a camera delivered since what comes counts.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Seen {
    /// Bytes that came.
    pub bytes: u64,
    /// Bytes known to be lost.
    pub lost_bytes: u64,
    /// How often bytes were lost.
    pub losses: u64,
    /// The camera's time at the beginning and at the end, µs.
    pub span_us: Option<(u64, u64)>,
    /// What the camera has to say about its stream.
    pub notes: Vec<String>,
}

impl Seen {
    /// Length of the stream on the camera's own clock, s; `None` when its time did not move.
    #[must_use]
    pub fn span_s(&self) -> Option<f64> {
        let (from, to) = self.span_us?;
        (to > from).then(|| (to - from) as f64 * 1e-6)
    }
}

/// One camera while it streams.
#[derive(Default)]
pub(super) struct Live {
    pub seen: Seen,
    /// Why it streams no more.
    pub trouble: Option<Trouble>,
    /// Its last time, µs.
    reached: Option<u64>,
    /// When that was seen to move.
    pub moved_at: HostTime,
}

impl Live {
    /// From now on what comes counts.
    pub fn begin(&mut self) {
        self.seen = Seen {
            span_us: self.reached.map(|us| (us, us)),
            ..Seen::default()
        };
    }

    /// Takes note of a chunk that came at `now`, and counts it when it `counts`.
    pub fn see(&mut self, chunk: &RawChunk, now: HostTime, counts: bool) {
        if let Some(us) = chunk.facts.last_us {
            if self.reached != Some(us) {
                self.moved_at = now;
            }
            self.reached = Some(us);
            if counts {
                let first = chunk.facts.first_us.unwrap_or(us);
                self.seen.span_us.get_or_insert((first, first)).1 = us;
            }
        }
        if counts {
            self.seen.bytes += chunk.bytes.len() as u64;
            self.seen.lost_bytes += chunk.lost_before;
            self.seen.losses += u64::from(chunk.lost_before > 0);
        }
    }

    /// The trouble with a camera whose time has stood still too long; `patience` more is granted to stand-ins.
    pub fn stalled(
        &self,
        camera: CameraId,
        now: HostTime,
        patience: HostDuration,
    ) -> Option<Trouble> {
        if now - self.moved_at <= STALLED_AFTER + patience {
            return None;
        }
        let what = match self.reached {
            Some(us) => format!(
                "{camera}: expected its time to go on, found it standing at {:.6} s",
                us as f64 * 1e-6
            ),
            None => format!("{camera}: expected a stream, found nothing"),
        };
        Some(trouble::silent(DeviceRole::of_camera(camera), what))
    }
}
