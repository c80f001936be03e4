//! The simulated trigger box: the pulse trains of `skinrig_model::pulse` on the lines of both cameras.

use skinrig_device::{DeviceError, TriggerBox, TriggerCapabilities};
use skinrig_model::{
    BoxReport, CameraId, DeviceIdentity, DeviceRole, HostDuration, HostTime, Mark, PulseTrain,
    SentMark,
};

use crate::config::{SimConfig, TriggerBoxConfig};
use crate::faults::{Fault, When};
use crate::random::{Purpose, Stream};
use crate::world::{LineEdge, Shared};

/// A simulated trigger box.
pub struct SimTriggerBox {
    shared: Shared,
    config: TriggerBoxConfig,
    serial: String,
    random: Stream,
    sent: u32,
    busy_until: Option<HostTime>,
    lost_pulses: Vec<(CameraId, u32, u32)>,
    lost: Option<When>,
}

impl SimTriggerBox {
    /// The box of a rig.
    #[must_use]
    pub fn new(config: &SimConfig, shared: Shared) -> Self {
        let mut lost_pulses = Vec::new();
        let mut lost = None;
        for fault in &config.faults {
            match *fault {
                Fault::PulseLost {
                    camera,
                    train,
                    pulse,
                } => {
                    lost_pulses.push((camera, train, pulse));
                }
                Fault::TriggerBoxLost(when) => lost = Some(when),
                _ => {}
            }
        }
        Self {
            shared,
            config: config.trigger_box,
            serial: format!("sim-{:08x}-t", config.seed as u32),
            random: Stream::new(config.seed, Purpose::TriggerBox, 0),
            sent: 0,
            busy_until: None,
            lost_pulses,
            lost,
        }
    }
}

impl TriggerBox for SimTriggerBox {
    fn identity(&self) -> DeviceIdentity {
        DeviceIdentity {
            model: "simulated trigger box".to_owned(),
            serial: self.serial.clone(),
            firmware: concat!("skinrig-sim ", env!("CARGO_PKG_VERSION")).to_owned(),
        }
    }

    fn capabilities(&self) -> TriggerCapabilities {
        TriggerCapabilities {
            // 200 µs longer than the longest train, which covers the latency.
            train_duration: HostDuration::from_micros(PulseTrain::DURATION_US as i64),
        }
    }

    fn send(&mut self, mark: Mark) -> Result<SentMark, DeviceError> {
        let now = self.shared.now();
        let mut world = self.shared.world();
        if self.lost.is_some_and(|when| world.has_struck(when)) {
            return Err(DeviceError::Lost {
                role: DeviceRole::TriggerBox,
                serial: self.serial.clone(),
                detail: "expected an answer, found none".to_owned(),
            });
        }
        if let Some(until) = self.busy_until.filter(|&until| now < until) {
            return Err(DeviceError::State {
                role: DeviceRole::TriggerBox,
                serial: self.serial.clone(),
                expected: "idle".to_owned(),
                found: format!("busy with a train until {until}"),
            });
        }
        let Some(train) = PulseTrain::new(mark) else {
            return Err(DeviceError::Refused {
                role: DeviceRole::TriggerBox,
                serial: self.serial.clone(),
                expected: format!("a press up to {}", skinrig_model::pulse::MAX_MARKED_PRESS),
                found: mark.press.0.to_string(),
            });
        };
        let (low, high) = (self.config.min_latency_ns, self.config.max_latency_ns);
        let latency = low + (self.random.unit() * (high - low) as f64) as i64;
        let rise = now.0 + latency;
        for (k, (offset_us, width_us)) in train.pulses().enumerate() {
            let up = rise + offset_us as i64 * 1_000;
            let down = up + width_us as i64 * 1_000;
            for camera in CameraId::ALL {
                let lost = self.lost_pulses.contains(&(camera, self.sent, k as u32));
                if !lost {
                    let line = &mut world.edges[camera.index()];
                    line.push_back(LineEdge {
                        t_ns: up,
                        rising: true,
                    });
                    line.push_back(LineEdge {
                        t_ns: down,
                        rising: false,
                    });
                }
            }
        }
        self.sent += 1;
        self.busy_until = Some(now + self.capabilities().train_duration);
        // The host knows only that the edge rose between the shortest and the longest latency.
        let half = (high - low).div_euclid(2) + 1;
        Ok(SentMark {
            mark,
            t: HostTime(now.0 + low + (high - low) / 2),
            uncertainty_ns: half,
        })
    }

    fn poll(&mut self, _reports: &mut Vec<BoxReport>) -> Result<(), DeviceError> {
        Ok(())
    }
}
