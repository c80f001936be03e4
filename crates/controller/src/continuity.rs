//! Whether the cameras' streams go on: their time keeps pace with the host's, they reach to the end of a press, and no storm
//! drowns it. A press whose data are spoilt is taken again.

use skinrig_device::DeviceError;
use skinrig_model::{CameraId, HostDuration, HostTime, RawChunk, Record};

use crate::core::{Collect, Core};
use crate::error::{ControllerError, Halt};
use crate::press::cleared_at;
use crate::press_fault::PressFault;

/// How fast two clocks may drift apart: far beyond any quartz, parts per million.
const DRIFT_PPM: i64 = 1_000;

/// Where a camera's stream has come to.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Continuity {
    /// When the last bytes came.
    arrived: Option<HostTime>,
    /// When camera time came last, and how far that time then was ahead of the host's at most, µs: bytes come late at times,
    /// but never early.
    ahead: Option<(HostTime, i64)>,
    /// The last camera time that came, µs.
    last_us: Option<i64>,
    /// The last bytes came late.
    late: bool,
    /// When the flush under way was first asked for.
    flushing_since: Option<HostTime>,
    /// Everything up to then was handed over.
    flushed_to: Option<HostTime>,
}

/// How a chunk's time compares with the host's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pace {
    /// As ever, or the chunk has no time.
    Even,
    /// The camera's time stepped forward by this many µs.
    Stepped(i64),
    /// The bytes came late, or the camera's time stepped back, by this many µs; told once.
    Late(i64),
}

impl Continuity {
    /// Takes the next chunk; `limit` is how far its time may be off.
    pub(crate) fn see(&mut self, chunk: &RawChunk, limit: HostDuration) -> Pace {
        if !chunk.bytes.is_empty() {
            self.arrived = Some(chunk.host_time);
        }
        let t = chunk.host_time;
        let Some(camera_us) = chunk.facts.last_us.and_then(|us| i64::try_from(us).ok()) else {
            return Pace::Even;
        };
        self.last_us = Some(camera_us);
        let ahead_us = camera_us - t.0 / 1_000;
        let Some((before, most_us)) = self.ahead else {
            self.ahead = Some((t, ahead_us));
            return Pace::Even;
        };
        let drift_us = (t - before).0 / 1_000 * DRIFT_PPM / 1_000_000;
        self.ahead = Some((t, ahead_us.max(most_us - drift_us)));
        let off_us = ahead_us - most_us;
        let limit_us = limit.0 / 1_000;
        let was_late = std::mem::replace(&mut self.late, off_us < -limit_us);
        if off_us > limit_us {
            Pace::Stepped(off_us)
        } else if self.late && !was_late {
            Pace::Late(-off_us)
        } else {
            Pace::Even
        }
    }

    /// Takes the answer to a flush that was asked for at `now`; one that is under way is no fault.
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

    /// Whether everything up to `t` was handed over.
    pub(crate) fn is_flushed_to(&self, t: HostTime) -> bool {
        self.flushed_to.is_some_and(|to| to >= t)
    }

    /// Up to when, by the host's clock, the stream tells what the camera saw. By the camera's own time where it tells one: bytes that
    /// come late tell of an earlier time than that at which they came. A delay that was there from the first byte on is not seen.
    pub(crate) fn reached(&self) -> Option<HostTime> {
        match (self.last_us, self.ahead) {
            (Some(last_us), Some((_, ahead_us))) => Some(HostTime((last_us - ahead_us) * 1_000)),
            _ => self.arrived,
        }
    }
}

impl Core<'_> {
    /// Looks at the time of a chunk that came. Data that come late are noted: the verdict on a press waits for them. A clock that was
    /// set forward ends the run, for no later press could be placed in time: resumed, the session gets a clock of its own for what
    /// follows.
    pub(crate) fn follow_stream(&mut self, chunk: &RawChunk) -> Result<(), ControllerError> {
        let Some(limit) = self.settings.camera_lag else {
            return Ok(());
        };
        let camera = chunk.camera;
        match self.continuity[camera.index()].see(chunk, limit) {
            Pace::Even => Ok(()),
            Pace::Stepped(us) => Err(ControllerError::ClockStep {
                camera,
                limit,
                found: HostDuration(us * 1_000),
            }),
            Pace::Late(us) => {
                let text = format!(
                    "{camera}: expected data within {limit}, found them {} late",
                    HostDuration(us * 1_000)
                );
                let t = chunk.host_time;
                self.journal.emit(Record::Note { t, text })
            }
        }
    }

    /// Waits until both cameras have delivered what they saw of the press, so that what was lost of it is known before the verdict;
    /// not for long.
    pub(crate) fn await_streams(&mut self) -> Result<(), Halt> {
        if self.settings.camera_lag.is_none() {
            return Ok(());
        }
        let end = self.end_of_press();
        let within = self.settings.data_within;
        self.collect(Collect::Flush)?;
        // A camera that does not answer a flush is a fault in the end.
        while !self.is_flushed_to(end)
            || self.first_behind(end).is_some() && self.now() < end + within
        {
            self.tick(None)?;
            self.collect(Collect::Flush)?;
        }
        for camera in CameraId::ALL {
            let reached = self.continuity[camera.index()].reached();
            if reached.is_none_or(|t| t < end) {
                let late = PressFault::DataLate {
                    camera,
                    end,
                    waited: within,
                    reached,
                };
                self.with_open(|open| open.spoilt.push(late));
            }
        }
        Ok(())
    }

    /// Whether both cameras have handed over everything up to `t`.
    pub(crate) fn is_flushed_to(&self, t: HostTime) -> bool {
        self.continuity.iter().all(|c| c.is_flushed_to(t))
    }

    /// A camera whose stream has not come to `end`.
    fn first_behind(&self, end: HostTime) -> Option<CameraId> {
        let behind = |c: &CameraId| {
            let reached = self.continuity[c.index()].reached();
            reached.is_none_or(|t| t < end)
        };
        CameraId::ALL.into_iter().find(behind)
    }

    /// When the tip was clear again; the present when it was never seen to be.
    fn end_of_press(&self) -> HostTime {
        let cleared = self.open.as_ref().and_then(cleared_at);
        cleared.unwrap_or_else(|| self.now())
    }

    /// Holds the event rates of the press under way against the level of a storm, when the plan has one.
    pub(crate) fn weigh_storm(&mut self) {
        let Some(level) = self.plan.suspend.event_rate.map(|t| t.trip) else {
            return;
        };
        let now = self.now();
        self.with_open(|open| {
            let seconds = (now - open.began).as_secs_f64().max(1e-3);
            for camera in CameraId::ALL {
                let rate = open.events[camera.index()] as f64 / seconds;
                if rate > level {
                    open.spoilt.push(PressFault::Storm {
                        camera,
                        level_ev_s: level,
                        found_ev_s: rate,
                    });
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use skinrig_model::ChunkFacts;

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
    fn a_step_forward_is_told_from_late_bytes() {
        let limit = HostDuration::from_millis(250);
        let mut stream = Continuity::default();
        let mut see = |host_ms, camera_ms| stream.see(&chunk(host_ms, camera_ms), limit);
        assert_eq!(see(1_000, Some(77_000)), Pace::Even);
        // A minute without bytes, in which the clocks drift apart.
        assert_eq!(see(61_000, Some(137_010)), Pace::Even);
        assert_eq!(see(62_000, None), Pace::Even);
        // Late, and back in time: no step.
        assert_eq!(see(63_000, Some(138_710)), Pace::Late(300_000));
        assert_eq!(see(63_100, Some(138_720)), Pace::Even, "told once");
        assert_eq!(see(64_000, Some(140_010)), Pace::Even);
        assert_eq!(see(65_000, Some(141_310)), Pace::Stepped(300_000));
    }

    /// Bytes that come late tell of the time at which the camera sent them.
    #[test]
    fn a_stream_has_come_as_far_as_its_own_time_tells() {
        let limit = HostDuration::from_millis(250);
        let mut stream = Continuity::default();
        assert_eq!(stream.reached(), None);
        stream.see(&chunk(900, None), limit);
        assert_eq!(stream.reached(), Some(HostTime(900_000_000)));
        stream.see(&chunk(1_000, Some(77_000)), limit);
        assert_eq!(stream.reached(), Some(HostTime(1_000_000_000)));
        // 300 ms late; half a millisecond may be drift.
        stream.see(&chunk(1_500, Some(77_200)), limit);
        assert_eq!(stream.reached(), Some(HostTime(1_200_500_000)));
        stream.see(&chunk(1_501, None), limit);
        assert_eq!(stream.reached(), Some(HostTime(1_200_500_000)));
    }

    #[test]
    fn a_slow_clock_is_never_late() {
        let limit = HostDuration::from_millis(250);
        let mut stream = Continuity::default();
        for s in 0..40_000_u64 {
            let chunk = chunk(s as i64 * 1_000, Some(s * 1_000 - s / 10));
            assert_eq!(stream.see(&chunk, limit), Pace::Even, "at {s} s");
        }
    }
}
