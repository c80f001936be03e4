//! The devices of the small rig: each call is counted, and can fail.

use super::*;

/// Counts a call; fails it if its number is reached.
pub(crate) fn call(world: &Shared, role: DeviceRole) -> Result<(), DeviceError> {
    let mut w = lock(world);
    w.calls += 1;
    if w.dead == Some(role) {
        return Err(World::lost(role));
    }
    match w.faults.at_call {
        Some((k, failure)) if k == w.calls => match failure {
            Failure::Once => Err(World::lost(role)),
            Failure::Forever => {
                w.dead = Some(role);
                Err(World::lost(role))
            }
            Failure::Panic => {
                drop(w);
                std::panic::panic_any(format!("mock {role:?} panics"));
            }
        },
        _ => Ok(()),
    }
}

pub(crate) fn identity(model: &str) -> DeviceIdentity {
    DeviceIdentity {
        model: model.into(),
        serial: "mock".into(),
        firmware: "0".into(),
    }
}

pub(crate) struct MockClock(pub Shared);

impl Clock for MockClock {
    fn now(&self) -> HostTime {
        HostTime(lock(&self.0).t)
    }
    fn wait_until(&mut self, t: HostTime) {
        let mut w = lock(&self.0);
        w.t = w.t.max(t.0);
        w.ticks += 1;
        if w.faults.strike == Some(FeedbackFault::Late) && w.tip[2] < -1.0 && w.broken_at.is_none()
        {
            w.t += 1500 * MS;
            w.broken_at = Some(w.t);
        }
        if let Some((tick, press)) = w.faults.operator {
            if tick == w.ticks {
                match press {
                    OperatorAction::Pause => w.control.pause(),
                    OperatorAction::PauseNow => w.control.pause_now(),
                    OperatorAction::Stop => w.control.stop(),
                    OperatorAction::Abort => w.control.abort(),
                    OperatorAction::Halt => w.control.halt(),
                    OperatorAction::Note => assert_eq!(w.control.note(NOTE.into()), Ok(1)),
                }
            } else if matches!(press, OperatorAction::Pause | OperatorAction::PauseNow)
                && w.ticks == tick + 200
            {
                w.control.resume();
            }
            if w.faults.halt_after.is_some_and(|n| tick + n == w.ticks) {
                w.control.halt();
            }
        }
    }
}

/// Capabilities of a scripted robot.
pub(crate) fn capabilities() -> IndenterCapabilities {
    IndenterCapabilities {
        workspace_min_mm: [-100.0; 3],
        workspace_max_mm: [100.0; 3],
        max_speed_mm_s: 200.0,
        max_acceleration_mm_s2: 500.0,
        max_force_n: 12.0,
        pose_rate_hz: 1000.0,
        reports_force: true,
    }
}

pub(crate) struct MockIndenter(pub Shared);

impl Indenter for MockIndenter {
    fn identity(&self) -> DeviceIdentity {
        identity("mock indenter")
    }
    fn capabilities(&self) -> IndenterCapabilities {
        capabilities()
    }
    fn configure(&mut self, limits: &MotionLimits) -> Result<Vec<Setting>, DeviceError> {
        call(&self.0, DeviceRole::Indenter)?;
        lock(&self.0).limits = Some(*limits);
        Ok(vec![Setting {
            name: "max_speed_mm_s".into(),
            requested: limits.max_speed_mm_s.to_string(),
            read_back: limits.max_speed_mm_s.to_string(),
        }])
    }
    fn arm(&mut self) -> Result<(), DeviceError> {
        call(&self.0, DeviceRole::Indenter)?;
        let mut w = lock(&self.0);
        w.advance();
        (w.armed, w.ever_armed, w.confirmed) = (true, true, false);
        w.target = w.tip;
        w.set_point = w.tip;
        Ok(())
    }
    fn command(&mut self, target: Point3<Robot>, speed_mm_s: f64) -> Result<(), DeviceError> {
        call(&self.0, DeviceRole::Indenter)?;
        let mut w = lock(&self.0);
        w.advance();
        if !w.armed {
            w.violations.push("command while disarmed".into());
        }
        let target = robot_from_skin().inverse().apply(target).to_array();
        let t = w.t;
        w.commands.push((target, speed_mm_s, t));
        w.target = target;
        w.speed = speed_mm_s;
        Ok(())
    }
    fn poll(&mut self, samples: &mut Vec<RobotSample>) -> Result<(), DeviceError> {
        let answer = call(&self.0, DeviceRole::Indenter);
        let mut w = lock(&self.0);
        w.advance();
        if w.dead != Some(DeviceRole::Indenter) {
            samples.append(&mut w.samples);
        }
        answer
    }
    fn hold(&mut self) -> Result<(), DeviceError> {
        call(&self.0, DeviceRole::Indenter)?;
        let mut w = lock(&self.0);
        w.advance();
        w.target = w.set_point;
        let t = w.t;
        w.robot_calls.push((t, "hold"));
        Ok(())
    }
    fn disarm(&mut self) -> Result<(), DeviceError> {
        call(&self.0, DeviceRole::Indenter)?;
        let mut w = lock(&self.0);
        w.advance();
        (w.armed, w.confirmed) = (false, true);
        let t = w.t;
        w.robot_calls.push((t, "disarm"));
        Ok(())
    }
}

pub(crate) struct MockCamera(pub Shared, pub CameraId);

impl MockCamera {
    fn role(&self) -> DeviceRole {
        DeviceRole::of_camera(self.1)
    }
    fn chunk(&self, chunks: &mut Vec<RawChunk>) {
        let mut w = lock(&self.0);
        let i = self.1.index();
        let seq = w.seq[i];
        w.seq[i] += 1;
        let mut lost_before = match w.faults.loss {
            Some((camera, at, bytes)) if camera == self.1 && at == seq => bytes,
            _ => 0,
        };
        // Data that arrive now were sent earlier, in order.
        let sent_ms = match w.faults.delay {
            Some((from_ms, by_ms)) if self.1 == CameraId::Two => {
                (w.t / MS).min(from_ms).max(w.t / MS - by_ms)
            }
            _ => w.t / MS,
        };
        let lost_now = |at: &mut i64| self.1 == CameraId::Two && *at <= sent_ms;
        if w.faults.lost_at_ms.take_if(lost_now).is_some() {
            lost_before = 8;
        }
        let time_us = (w.faults.delay.is_some()).then_some(sent_ms as u64 * 1_000);
        chunks.push(RawChunk {
            camera: self.1,
            seq,
            host_time: HostTime(w.t),
            lost_before,
            lost_from_us: None,
            bytes: vec![0; 8],
            facts: ChunkFacts {
                cd_events: 100,
                first_us: time_us,
                last_us: time_us,
                ..ChunkFacts::default()
            },
            triggers: vec![],
        });
    }
}

impl EventCamera for MockCamera {
    fn camera(&self) -> CameraId {
        self.1
    }
    fn identity(&self) -> DeviceIdentity {
        identity("mock camera")
    }
    fn capabilities(&self) -> CameraCapabilities {
        CameraCapabilities {
            width: 640,
            height: 480,
            format: StreamFormat::Evt2,
            trigger_channels: vec![0],
            biases: vec![],
        }
    }
    fn configure(&mut self, _: &CameraSettings) -> Result<Vec<Setting>, DeviceError> {
        call(&self.0, self.role())?;
        Ok(vec![])
    }
    fn start(&mut self) -> Result<(), DeviceError> {
        call(&self.0, self.role())?;
        let mut w = lock(&self.0);
        w.streaming[self.1.index()] = true;
        w.started.push(self.1);
        Ok(())
    }
    fn poll(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        call(&self.0, self.role())?;
        let due = {
            let w = lock(&self.0);
            w.streaming[self.1.index()] && w.t / (100 * MS) >= w.seq[self.1.index()] as i64
        };
        if due {
            self.chunk(chunks);
        }
        Ok(())
    }
    fn flush(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        call(&self.0, self.role())?;
        self.chunk(chunks);
        Ok(())
    }
    fn stop(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        let answer = call(&self.0, self.role());
        lock(&self.0).streaming[self.1.index()] = false;
        answer?;
        self.chunk(chunks);
        Ok(())
    }
    fn take_notes(&mut self, notes: &mut Vec<String>) {
        let is_own = |of: &mut (CameraId, String)| of.0 == self.1;
        notes.extend(lock(&self.0).faults.remark.take_if(is_own).map(|r| r.1));
    }
    fn temperature_c(&mut self) -> Result<Option<f64>, DeviceError> {
        call(&self.0, self.role())?;
        let mut w = lock(&self.0);
        w.temperature_reads[self.1.index()] += 1;
        let hot_ms = w.faults.hot_ms.clone().filter(|_| self.1 == CameraId::One);
        let ms = w.t / MS;
        Ok(hot_ms.map(|hot| if hot.contains(&ms) { 70.0 } else { 30.0 }))
    }
}

pub(crate) struct MockTriggerBox(pub Shared);

impl TriggerBox for MockTriggerBox {
    fn identity(&self) -> DeviceIdentity {
        identity("mock trigger box")
    }
    fn capabilities(&self) -> TriggerCapabilities {
        TriggerCapabilities {
            train_duration: HostDuration::from_millis(lock(&self.0).faults.train_ms),
        }
    }
    fn send(&mut self, mark: Mark) -> Result<SentMark, DeviceError> {
        call(&self.0, DeviceRole::TriggerBox)?;
        let mut w = lock(&self.0);
        if w.t < w.line_until {
            w.violations.push("mark on a busy line".into());
        }
        w.line_until = w.t + w.faults.train_ms * MS;
        Ok(SentMark {
            mark,
            t: HostTime(w.t),
            uncertainty_ns: 1000,
        })
    }

    fn poll(&mut self, _reports: &mut Vec<BoxReport>) -> Result<(), DeviceError> {
        Ok(())
    }

    fn take_notes(&mut self) -> Vec<String> {
        Vec::from_iter(lock(&self.0).faults.box_remark.take())
    }
}
