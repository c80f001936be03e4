//! The simulated trigger box: sends the pulse trains of `skinrig_model::pulse` to both cameras.

use skinrig_device::{DeviceError, TriggerBox, TriggerCapabilities};
use skinrig_model::{
    BoxReport, BoxTime, DeviceIdentity, DeviceRole, HostDuration, HostTime, Mark, PulseTrain,
    RigFault, SentMark,
};

use crate::config::{SimConfig, TriggerBoxConfig};
use crate::drifting::DriftingClock;
use crate::faults::{self, FaultTrigger};
use crate::random::{Purpose, Stream};
use crate::world::Shared;

/// Interval at which a noisy box sends unreadable data, ns.
const NOISE_EVERY_NS: i64 = 1_000_000_000;

/// A simulated trigger box.
pub(crate) struct SimTriggerBox {
    shared: Shared,
    config: TriggerBoxConfig,
    serial: String,
    latencies: Stream,
    delays: Stream,
    /// Time of the next time exchange, ns.
    next_exchange_ns: i64,
    /// An exchange whose reply is still in transit.
    exchange: Option<(i64, BoxReport)>,
    lost: Option<FaultTrigger>,
    noisy: Option<FaultTrigger>,
    /// Time of the last unreadable data, ns.
    noise_ns: Option<i64>,
}

impl SimTriggerBox {
    /// The box of a rig.
    #[must_use]
    pub(crate) fn new(config: &SimConfig, shared: Shared) -> Self {
        let when = |kind| faults::times(&config.faults, kind).next();
        // The first leg has the indices 0 to 2.
        let leg = u64::from(config.legs_before) << 32;
        let of_leg = |index: u64| Stream::new(config.seed, Purpose::TriggerBox, leg + index);
        Self {
            shared,
            config: config.trigger_box,
            serial: format!("sim-{:08x}-t", config.seed as u32),
            latencies: of_leg(0),
            delays: of_leg(2),
            next_exchange_ns: 0,
            exchange: None,
            lost: when(RigFault::BoxSilent),
            noisy: when(RigFault::BoxNoisy),
            noise_ns: None,
        }
    }

    fn gone(&self) -> DeviceError {
        DeviceError::Lost {
            role: DeviceRole::TriggerBox,
            serial: self.serial.clone(),
            detail: "expected an answer, found none".to_owned(),
        }
    }

    /// The next time exchange with the arrival time of its reply.
    fn next_exchange(&mut self, clock: DriftingClock) -> Option<(i64, BoxReport)> {
        if self.config.exchange_period_ms == 0 {
            return None;
        }
        let (least, mean) = (self.config.min_delay_us, self.config.mean_delay_us);
        let mut delay_ns = || ((least + mean * self.delays.exponential()) * 1_000.0) as i64;
        let sent_ns = self.next_exchange_ns;
        let read_ns = sent_ns + delay_ns();
        let received_ns = read_ns + delay_ns();
        self.next_exchange_ns =
            received_ns.max(sent_ns + i64::from(self.config.exchange_period_ms) * 1_000_000);
        let report = BoxReport::Exchange {
            sent: HostTime(sent_ns),
            received: HostTime(received_ns),
            at: BoxTime {
                us: clock.own_us(read_ns),
            },
        };
        Some((received_ns, report))
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
            // 200 µs longer than the longest train, to cover the latency.
            train_duration: HostDuration::from_micros(PulseTrain::DURATION_US as i64),
        }
    }

    fn send(&mut self, mark: Mark) -> Result<SentMark, DeviceError> {
        let now = self.shared.now();
        let mut world = self.shared.world();
        if self.lost.is_some_and(|when| world.has_occurred(when)) {
            return Err(self.gone());
        }
        if let Some(until) = world.line.busy_until(now.0) {
            let until = HostTime(until);
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
                expected: format!("up to {}", skinrig_model::pulse::LAST_MARKED_PRESS),
                found: mark.press.to_string(),
            });
        };
        let (low, high) = (self.config.min_latency_ns, self.config.max_latency_ns);
        let latency = low + (self.latencies.unit() * (high - low) as f64) as i64;
        let until = now + self.capabilities().train_duration;
        world.line.send(mark, train, now.0 + latency, until.0);
        // For the host, the edge rose at any time between the shortest and the longest latency.
        let half = (high - low).div_euclid(2) + 1;
        Ok(SentMark {
            mark,
            t: HostTime(now.0 + low + (high - low) / 2),
            uncertainty_ns: half,
        })
    }

    fn poll(&mut self, reports: &mut Vec<BoxReport>) -> Result<(), DeviceError> {
        let now = self.shared.now();
        let shared = self.shared.clone();
        let mut world = shared.world();
        if self.lost.is_some_and(|when| world.has_occurred(when)) {
            return Err(self.gone());
        }
        let clock = world.line.clock();
        // Both in order of arrival at the host.
        loop {
            if self.exchange.is_none() && self.next_exchange_ns <= now.0 {
                self.exchange = self.next_exchange(clock);
            }
            let before = self.exchange.map_or(now.0, |(t_ns, _)| t_ns.min(now.0));
            if let Some((_, report)) = world.line.take_report(before) {
                reports.push(report);
            } else if let Some((_, report)) = self.exchange.take_if(|(t_ns, _)| *t_ns <= now.0) {
                reports.push(report);
            } else {
                break;
            }
        }
        let due_ns = self.noise_ns.map_or(0, |t_ns| t_ns + NOISE_EVERY_NS);
        if self.noisy.is_some_and(|when| world.has_occurred(when)) && now.0 >= due_ns {
            self.noise_ns = Some(now.0);
            return Err(DeviceError::State {
                role: DeviceRole::TriggerBox,
                serial: self.serial.clone(),
                expected: "a readable report".to_owned(),
                found: "noise on the serial line".to_owned(),
            });
        }
        Ok(())
    }
}
