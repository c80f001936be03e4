//! Continuity of a camera stream: its time keeps pace with the host's, and its data are complete up to a known time.

use skinrig_device::DeviceError;
use skinrig_model::{HostDuration, HostTime, RawChunk};

/// Largest drift between two clocks, parts per million: far beyond any quartz.
const DRIFT_PPM: i64 = 1_000;

/// Position of a camera's stream in time.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Continuity {
    /// Time of the last bytes.
    arrived: Option<HostTime>,
    /// Last host time with a camera time, and the largest lead of the camera's time over the host's so far, µs: bytes may come late,
    /// but never early.
    ahead: Option<(HostTime, i64)>,
    /// The last camera time, µs.
    last_us: Option<i64>,
    /// True if the last bytes were late.
    late: bool,
    /// Start of the flush in progress.
    flushing_since: Option<HostTime>,
    /// Everything up to this time has been delivered.
    flushed_to: Option<HostTime>,
}

/// Time of a chunk compared with the host's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StreamTiming {
    /// In step, or a chunk without a time.
    InStep,
    /// The camera's time jumped forward by this many µs.
    Stepped(i64),
    /// The bytes came late, or the camera's time jumped back, by this many µs; reported once.
    Late(i64),
}

impl Continuity {
    /// Processes the next chunk; `limit` is the largest allowed deviation.
    pub(crate) fn observe(&mut self, chunk: &RawChunk, limit: HostDuration) -> StreamTiming {
        if !chunk.bytes.is_empty() {
            self.arrived = Some(chunk.host_time);
        }
        let t = chunk.host_time;
        let Some(camera_us) = chunk.facts.last_us.and_then(|us| i64::try_from(us).ok()) else {
            return StreamTiming::InStep;
        };
        self.last_us = Some(camera_us);
        let ahead_us = camera_us - t.0 / 1_000;
        let Some((before, most_us)) = self.ahead else {
            self.ahead = Some((t, ahead_us));
            return StreamTiming::InStep;
        };
        let drift_us = (t - before).0 / 1_000 * DRIFT_PPM / 1_000_000;
        self.ahead = Some((t, ahead_us.max(most_us - drift_us)));
        let off_us = ahead_us - most_us;
        let limit_us = limit.0 / 1_000;
        let was_late = std::mem::replace(&mut self.late, off_us < -limit_us);
        if off_us > limit_us {
            StreamTiming::Stepped(off_us)
        } else if self.late && !was_late {
            StreamTiming::Late(-off_us)
        } else {
            StreamTiming::InStep
        }
    }

    /// Processes the answer to a flush requested at `now`; a flush still in progress is no fault.
    pub(crate) fn flush(
        &mut self,
        now: HostTime,
        answer: Result<(), DeviceError>,
    ) -> Result<(), DeviceError> {
        let since = *self.flushing_since.get_or_insert(now);
        match answer {
            Err(DeviceError::Pending { .. }) => return Ok(()),
            Ok(()) => self.flushed_to = Some(since),
            Err(_) => {}
        }
        self.flushing_since = None;
        answer
    }

    /// Whether everything up to `t` was delivered.
    pub(crate) fn is_flushed_to(&self, t: HostTime) -> bool {
        self.flushed_to.is_some_and(|to| to >= t)
    }

    /// Host time up to which the stream is complete, from the camera's own time if it has one, since late bytes carry an earlier
    /// time than their arrival. A constant delay since the first byte is not detected.
    pub(crate) fn reached(&self) -> Option<HostTime> {
        match (self.last_us, self.ahead) {
            (Some(last_us), Some((_, ahead_us))) => Some(HostTime((last_us - ahead_us) * 1_000)),
            _ => self.arrived,
        }
    }
}

#[cfg(test)]
mod tests {
    use skinrig_model::{CameraId, ChunkFacts};

    use super::*;

    fn chunk(host_ms: i64, camera_ms: Option<u64>) -> RawChunk {
        RawChunk {
            camera: CameraId::One,
            seq: 0,
            host_time: HostTime(host_ms * 1_000_000),
            lost_before: 0,
            lost_from_us: None,
            bytes: vec![0; 4],
            facts: ChunkFacts {
                last_us: camera_ms.map(|ms| ms * 1_000),
                ..ChunkFacts::default()
            },
            triggers: Vec::new(),
        }
    }

    #[test]
    fn a_forward_jump_differs_from_late_bytes() {
        let limit = HostDuration::from_millis(250);
        let mut stream = Continuity::default();
        let mut observe = |host_ms, camera_ms| stream.observe(&chunk(host_ms, camera_ms), limit);
        assert_eq!(observe(1_000, Some(77_000)), StreamTiming::InStep);
        // A minute without bytes, while the clocks drift apart.
        assert_eq!(observe(61_000, Some(137_010)), StreamTiming::InStep);
        assert_eq!(observe(62_000, None), StreamTiming::InStep);
        // Late and back in time: no jump.
        assert_eq!(observe(63_000, Some(138_710)), StreamTiming::Late(300_000));
        assert_eq!(
            observe(63_100, Some(138_720)),
            StreamTiming::InStep,
            "reported once"
        );
        assert_eq!(observe(64_000, Some(140_010)), StreamTiming::InStep);
        assert_eq!(
            observe(65_000, Some(141_310)),
            StreamTiming::Stepped(300_000)
        );
    }

    /// Late bytes carry the time at which the camera sent them.
    #[test]
    fn a_stream_has_reached_its_own_time() {
        let limit = HostDuration::from_millis(250);
        let mut stream = Continuity::default();
        assert_eq!(stream.reached(), None);
        stream.observe(&chunk(900, None), limit);
        assert_eq!(stream.reached(), Some(HostTime(900_000_000)));
        stream.observe(&chunk(1_000, Some(77_000)), limit);
        assert_eq!(stream.reached(), Some(HostTime(1_000_000_000)));
        // 300 ms late, of which half a millisecond may be drift.
        stream.observe(&chunk(1_500, Some(77_200)), limit);
        assert_eq!(stream.reached(), Some(HostTime(1_200_500_000)));
        stream.observe(&chunk(1_501, None), limit);
        assert_eq!(stream.reached(), Some(HostTime(1_200_500_000)));
    }

    #[test]
    fn a_slow_clock_is_never_late() {
        let limit = HostDuration::from_millis(250);
        let mut stream = Continuity::default();
        for s in 0..40_000_u64 {
            let chunk = chunk(s as i64 * 1_000, Some(s * 1_000 - s / 10));
            assert_eq!(
                stream.observe(&chunk, limit),
                StreamTiming::InStep,
                "at {s} s"
            );
        }
    }
}
