//! One camera: registers, faults and counters.

use std::collections::BTreeSet;
use std::mem;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::clock::{Oscillator, SyncLine, TimeBase};
use super::counters::Counters;
use super::registers as r;
use super::registers::Registers;
use super::sensor::{Gates, Roi, Sync, runs};
use crate::config::{Evk1Config, Pacing};
use crate::control::Request;
use crate::usb::descriptors::Descriptors;
use crate::usb::queues::Queues;
use crate::world::{World, now_ns};

/// Faults of a camera.
#[derive(Debug, Clone, Default)]
pub(crate) struct Faults {
    /// Registers that ignore writes.
    pub ignored_registers: BTreeSet<u32>,
    /// Whether control requests stay unanswered.
    pub silent: bool,
    /// Whether register reads report failure.
    pub failing_reads: bool,
    /// Words to insert into the next packet.
    pub garbage: Vec<u32>,
    /// Words lost at the end of each packet.
    pub dropped_words: usize,
    /// Number of pixels with an event every millisecond.
    pub hot_pixels: u16,
}

/// One run of the time base.
#[derive(Debug)]
pub(crate) struct Run {
    /// Number of the run.
    pub number: u64,
    /// Start in true time, ns.
    pub from_ns: i64,
    /// The camera's time during the run.
    pub time: TimeBase,
}

pub(crate) struct Model {
    pub registers: Registers,
    pub roi: Arc<Roi>,
    pub faults: Faults,
    pub counters: Counters,
    pub journal: Vec<Request>,
    /// Number and start of the current run.
    running: Option<(u64, i64, Sync)>,
    /// Camera time at the end of the previous run, µs.
    reached_us: u64,
    unplugged: bool,
}

impl Model {
    /// Sets the value of the board's temperature sensor, in 1/4096 °C.
    pub(crate) fn set_temperature(&mut self, steps: u32) {
        self.registers.set(r::TEMPERATURE, steps);
    }

    fn is_running(&self, run: u64) -> bool {
        !self.unplugged && self.running.is_some_and(|(number, ..)| number == run)
    }
}

/// An emulated EVK1.
pub(crate) struct Evk1 {
    pub config: Evk1Config,
    pub descriptors: Descriptors,
    pub queues: Arc<Queues>,
    pub world: Arc<World>,
    pub sync_line: Arc<SyncLine>,
    plugged: Instant,
    model: Mutex<Model>,
    changed: Condvar,
}

impl Evk1 {
    /// A camera that was just plugged in; `serial` is its number as a register value.
    pub(crate) fn new(
        config: Evk1Config,
        serial: u32,
        queues: Arc<Queues>,
        world: Arc<World>,
        sync_line: Arc<SyncLine>,
    ) -> Self {
        // Class, subclass and strings of an EVK1 are not public: vendor-specific, none, none.
        let descriptors = Descriptors {
            vendor: 0x04b4,
            product: config.product_id,
            interface_class: 0xff,
            interface_subclass: 0,
            endpoints: vec![0x81],
            speed_mbit: config.speed_mbit,
            strings: [const { None }; 3],
        };
        let registers = Registers::power_up(&config, serial);
        let model = Model {
            roi: Arc::new(Roi::read(&registers)),
            registers,
            faults: Faults::default(),
            counters: Counters::default(),
            journal: Vec::new(),
            running: None,
            reached_us: config.origin_us,
            unplugged: false,
        };
        let stale: Vec<u8> = (0..config.stale_words as u32)
            .flat_map(|n| (0x8fff_0000 | n & 0xffff).to_le_bytes())
            .collect();
        queues.push(stale, true);
        Self {
            config,
            descriptors,
            queues,
            world,
            sync_line,
            plugged: Instant::now(),
            model: Mutex::new(model),
            changed: Condvar::new(),
        }
    }

    pub(crate) fn lock(&self) -> MutexGuard<'_, Model> {
        self.model.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether the FPGA has booted.
    pub(crate) fn is_booted(&self) -> bool {
        self.plugged.elapsed() >= Duration::from_millis(self.config.boot_ms)
    }

    pub(crate) fn oscillator(&self) -> Oscillator {
        Oscillator::new(self.config.drift_ppm)
    }

    /// Performs the side effects of a register write.
    pub(crate) fn written(&self, model: &mut Model, address: u32, value: u32) {
        match address {
            r::ROI_CTRL if value >> 5 & 1 == 1 => {
                model.roi = Arc::new(Roi::read(&model.registers));
            }
            r::CCAM2_CONTROL => self.start_or_stop(model),
            _ => {}
        }
    }

    fn start_or_stop(&self, model: &mut Model) {
        let should_run = runs(&model.registers);
        match (model.running, should_run) {
            (None, true) => {
                let sync = Sync::read(&model.registers);
                let from_ns = now_ns();
                model.counters.starts += 1;
                model.running = Some((model.counters.starts, from_ns, sync));
                if sync == Sync::Master {
                    self.sync_line.begin(self.oscillator(), from_ns);
                }
                self.changed.notify_all();
            }
            (Some((_, _, sync)), false) => {
                model.running = None;
                if sync == Sync::Master {
                    self.sync_line.end(now_ns());
                }
            }
            _ => {}
        }
    }

    /// Waits for the next run of the time base; `None` when the camera is unplugged.
    pub(crate) fn next_run(&self, after: u64) -> Option<Run> {
        let mut model = self.lock();
        loop {
            if model.unplugged {
                return None;
            }
            if let Some((number, from_ns, sync)) = model.running
                && number != after
            {
                let base_us = if self.config.time_restarts {
                    self.config.origin_us
                } else {
                    model.reached_us
                };
                let time = match sync {
                    Sync::Slave => TimeBase::Counted {
                        from_ns,
                        base_us: 0,
                        current: None,
                    },
                    Sync::Standalone | Sync::Master => TimeBase::Own {
                        oscillator: self.oscillator(),
                        from_ns,
                        // A master's slaves count from 0, and so does the master.
                        base_us: if sync == Sync::Master { 0 } else { base_us },
                    },
                };
                return Some(Run {
                    number,
                    from_ns,
                    time,
                });
            }
            model = self
                .changed
                .wait(model)
                .unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Event filters according to the registers in this run; `None` when it has ended.
    pub(crate) fn gates(&self, run: u64) -> Option<Gates> {
        let model = self.lock();
        model
            .is_running(run)
            .then(|| Gates::read(&model.registers, &model.roi))
    }

    /// Garbage words to insert into the next packet.
    pub(crate) fn garbage(&self) -> Vec<u32> {
        mem::take(&mut self.lock().faults.garbage)
    }

    /// Number of pixels with an event every millisecond.
    pub(crate) fn hot_pixels(&self) -> u16 {
        self.lock().faults.hot_pixels
    }

    /// Sends a packet of a run and counts it, unless the run has ended. Bytes that do not fit are lost.
    pub(crate) fn send(
        &self,
        run: u64,
        mut bytes: Vec<u8>,
        end: bool,
        reached_us: u64,
        count: impl FnOnce(&mut Counters),
    ) {
        // Hold the lock during the push, so that no packet follows the reply to the write that stops the run.
        let mut model = self.lock();
        if !model.is_running(run) {
            return;
        }
        let created = bytes.len();
        if self.config.pacing == Pacing::RealTime {
            bytes.truncate(self.queues.free() / 4 * 4);
        }
        bytes.truncate(bytes.len().saturating_sub(4 * model.faults.dropped_words));
        let dropped = created - bytes.len();
        let dropped_words = dropped / 4;
        self.queues.push(bytes, end);
        count(&mut model.counters);
        model.counters.made_bytes += created as u64;
        model.counters.dropped_bytes += dropped as u64;
        model.reached_us = reached_us;
        if dropped_words > 0 {
            // One per lost word, at most the register's maximum (assumed).
            let hits = model.registers.get(r::OVERFLOW_HITCOUNT) as usize + dropped_words;
            model
                .registers
                .set(r::OVERFLOW_HITCOUNT, hits.min(0xffff) as u32);
        }
    }

    /// Handles an unplugged cable.
    pub(crate) fn unplug(&self) {
        let mut model = self.lock();
        model.unplugged = true;
        if let Some((_, _, Sync::Master)) = model.running.take() {
            self.sync_line.end(now_ns());
        }
        drop(model);
        self.queues.unplug();
        self.changed.notify_all();
    }
}
