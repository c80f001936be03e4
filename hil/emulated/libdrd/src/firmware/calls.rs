//! Handles requests like the library and the controller.

use skinrig_drd_abi::{ErrorCode, StatusField};

use super::settings::Settings;
use super::vector::Vector;
use super::world::{Cause, Holder, World};
use crate::config::{Fault, Setting};
use crate::page::Mode;
use crate::wire::{Call, Control, Reply};

/// Sender of a request.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Caller {
    /// Number of the connection.
    pub connection: u64,
    /// Its process.
    pub pid: u32,
}

type Answer = Result<Vec<f64>, ErrorCode>;

impl World {
    /// Number of connected devices, and of free ones.
    pub fn count(&self) -> Reply {
        let all = if self.connected() {
            self.config.devices.len()
        } else {
            self.config.devices.len() - 1
        };
        let taken = self.connected() && (self.holder.is_some() || self.busy());
        let free = all - usize::from(taken);
        Reply::values([all, free].map(|n| n as f64).to_vec())
    }

    /// Handles a request of the control client.
    pub fn control(&mut self, control: Control) -> Reply {
        match control {
            Control::Inject(when, fault) => {
                self.faults.inject(self.t_ns(), when, fault);
                // Effects that are due are visible at once.
                self.apply_due_faults();
            }
            Control::ClearFaults => self.faults.clear(),
            Control::SetContact(contact) => self.body.contact = contact,
            Control::Place(position) => {
                self.body.position = position;
                self.body.velocity = [0.0; 3];
                if let Some(regulation) = &mut self.regulation {
                    regulation.hold(position);
                }
            }
        }
        Reply::ok()
    }

    /// Handles a call about a device.
    pub fn call(&mut self, caller: Caller, index: usize, call: &Call) -> Reply {
        let Some(device) = self.config.devices.get(index).cloned() else {
            return Reply::failed(ErrorCode::INVALID_INDEX);
        };
        let answer = if index == self.config.arm_index {
            self.call_arm(caller, call)
        } else {
            match call {
                Call::Open | Call::Close => Ok(Vec::new()),
                Call::Identity => Ok(vec![
                    f64::from(device.device_type),
                    f64::from(device.serial),
                    device.firmware,
                    1.0,
                    1.0,
                ]),
                _ => Err(ErrorCode::NOT_AVAILABLE),
            }
        };
        answer.map_or_else(Reply::failed, Reply::values)
    }

    fn connected(&self) -> bool {
        !self.faults.any(|f| matches!(f, Fault::Lost))
    }

    fn busy(&self) -> bool {
        self.faults.any(|f| matches!(f, Fault::Busy))
    }

    fn call_arm(&mut self, caller: Caller, call: &Call) -> Answer {
        if *call == Call::Open {
            return self.open(caller);
        }
        if !self.connected()
            || self
                .holder
                .is_none_or(|h| h.connection != caller.connection)
        {
            return Err(ErrorCode::COM);
        }
        let done = Ok(Vec::new());
        match call {
            Call::Open => done,
            Call::Close => {
                if self.faults.close_fails() {
                    return Err(ErrorCode::COM);
                }
                self.release_holder();
                done
            }
            Call::Identity => Ok(self.identity()),
            Call::Status => Ok(self.status().iter().map(|w| f64::from(*w)).collect()),
            Call::Initialised => Ok(vec![f64::from(u8::from(self.initialised))]),
            Call::AutoInit | Call::CheckInit => self.auto_init(*call == Call::CheckInit),
            Call::Start => self.start(),
            Call::Stop { keep_force } => self.stop(*keep_force),
            Call::Brake => {
                if self.faults.stop_fails() {
                    return Err(ErrorCode::COM);
                }
                self.power_off(Cause::Software);
                done
            }
            Call::Force(on) => self.force(*on),
            Call::Brakes(on) => self.brakes(*on),
            Call::Move(target) => self.set_target(*target, true),
            Call::Track(target) => self.set_target(*target, false),
            Call::Hold => {
                let position = self.body.position;
                let regulation = self.regulation.as_mut().ok_or(ErrorCode::NO_REGULATION)?;
                regulation.hold(position);
                done
            }
            Call::Set(setting, values) => {
                let mut settings = self.settings.clone();
                settings.set(*setting, values)?;
                if !self.faults.ignores(*setting) {
                    self.settings = settings;
                }
                if *setting == Setting::Watchdog {
                    self.last_command_ns = self.t_ns();
                }
                done
            }
            Call::Get(setting) => Ok(self.settings.get(*setting)),
        }
    }

    fn open(&mut self, caller: Caller) -> Answer {
        if let Some(code) = self.faults.find(|f| match f {
            Fault::Open(code) => Some(*code),
            _ => None,
        }) {
            return Err(ErrorCode(code));
        }
        if !self.connected() {
            return Err(ErrorCode::NO_DEVICE_FOUND);
        }
        match self.holder {
            Some(holder) if holder.connection == caller.connection => return Ok(Vec::new()),
            Some(_) => return Err(ErrorCode::DEVICE_IN_USE),
            None if self.busy() => return Err(ErrorCode::DEVICE_IN_USE),
            None => {}
        }
        self.holder = Some(Holder {
            connection: caller.connection,
            pid: caller.pid,
            stopped: false,
        });
        // The controller's state survives an open; the library's is reset.
        let watchdog = self.settings.watchdog;
        self.settings = Settings {
            watchdog,
            ..Settings::new(&self.config)
        };
        Ok(Vec::new())
    }

    fn identity(&self) -> Vec<f64> {
        let device = &self.config.devices[self.config.arm_index];
        let claimed = self.faults.find(|f| match f {
            Fault::DeviceType(claimed) => Some(*claimed),
            _ => None,
        });
        let serial = if self.faults.any(|f| matches!(f, Fault::NoSerial)) {
            -1.0
        } else {
            f64::from(device.serial)
        };
        let unless = |broken: bool| f64::from(u8::from(!broken));
        vec![
            f64::from(claimed.unwrap_or(device.device_type)),
            serial,
            device.firmware,
            unless(self.faults.any(|f| matches!(f, Fault::ControllerMemory))),
            unless(self.faults.any(|f| matches!(f, Fault::Unsupported))),
        ]
    }

    /// Status vector of the length for the SDK version.
    fn status(&self) -> Vec<i32> {
        let is = |mode: Mode| i32::from(self.mode == mode);
        let fields = [
            (StatusField::Power, 1),
            (StatusField::Connected, 1),
            (StatusField::Started, 1),
            (StatusField::Reset, i32::from(!self.initialised)),
            (StatusField::Idle, is(Mode::Idle)),
            (StatusField::Force, is(Mode::Force)),
            (StatusField::Brake, is(Mode::Brake)),
            (StatusField::Gravity, i32::from(self.settings.gravity)),
            (StatusField::TimeGuard, 1),
            // 0, "failed or none": the least informative value.
            (StatusField::Redundancy, 0),
            (StatusField::ForceOffCause, self.cause as i32),
            (StatusField::Locks, -1),
        ];
        let by_version = match self.config.sdk {
            [3, 0..=6, _] => 15,
            [3, 0..=16, _] => 16,
            _ => 17,
        };
        let cut = self.faults.find(|f| match f {
            Fault::StatusLength(words) => Some(*words),
            _ => None,
        });
        let mut words = vec![0; 17];
        for (field, word) in fields {
            words[field as usize] = word;
        }
        words.truncate(cut.unwrap_or(by_version));
        words
    }

    fn auto_init(&mut self, sweep: bool) -> Answer {
        if let Some(code) = self.faults.find(|f| match f {
            Fault::AutoInitFails(code) => Some(*code),
            _ => None,
        }) {
            return Err(ErrorCode(code));
        }
        if self.button_off {
            return Err(ErrorCode::TIMEOUT);
        }
        self.begin_initialisation(sweep);
        Ok(Vec::new())
    }

    fn start(&mut self) -> Answer {
        if let Some(code) = self.faults.find(|f| match f {
            Fault::StartFails(code) => Some(*code),
            _ => None,
        }) {
            return Err(ErrorCode(code));
        }
        if !self.initialised {
            return Err(ErrorCode::DEVICE_NOT_READY);
        }
        // It is not documented whether the vendor's start keeps gains and parameters: this one resets them.
        let Settings {
            gains,
            moves,
            tracking,
            motor_ratio,
            filter,
            ..
        } = Settings::new(&self.config);
        self.settings = Settings {
            gains,
            moves,
            tracking,
            motor_ratio,
            filter,
            ..self.settings.clone()
        };
        if self.regulation.is_none() {
            self.start_regulation();
        }
        Ok(Vec::new())
    }

    fn stop(&mut self, keep_force: bool) -> Answer {
        if self.faults.stop_fails() {
            return Err(ErrorCode::COM);
        }
        let idle = self.regulation.is_none() && self.initialisation.is_none();
        if idle && self.faults.any(|f| matches!(f, Fault::StopNeedsRegulation)) {
            return Ok(Vec::new());
        }
        self.regulation = None;
        self.initialisation = None;
        if !keep_force {
            self.power_off(Cause::Software);
        }
        Ok(Vec::new())
    }

    fn force(&mut self, on: bool) -> Answer {
        if !on {
            self.power_off(Cause::Software);
            return Ok(Vec::new());
        }
        if !self.initialised {
            return Err(ErrorCode::DEVICE_NOT_READY);
        }
        if self.power_on() {
            Ok(Vec::new())
        } else {
            Err(ErrorCode::NOT_ENABLED)
        }
    }

    fn brakes(&mut self, on: bool) -> Answer {
        match (self.mode, on) {
            (Mode::Force, true) => self.power_off(Cause::Software),
            (Mode::Idle, true) => self.mode = Mode::Brake,
            (Mode::Brake, false) => self.mode = Mode::Idle,
            _ => {}
        }
        Ok(Vec::new())
    }

    fn set_target(&mut self, target: Vector, straight: bool) -> Answer {
        if target.iter().any(|x| !x.is_finite()) {
            return Err(ErrorCode::INVALID);
        }
        if !self.reachable(target) {
            return Err(ErrorCode::GEOMETRY);
        }
        let regulation = self.regulation.as_mut().ok_or(ErrorCode::NO_REGULATION)?;
        if straight {
            regulation.move_to(target, &self.settings);
        } else {
            regulation.track(target, &self.settings);
        }
        self.faults.move_began(self.t_ns());
        Ok(Vec::new())
    }
}
