//! The emulated bus: creates the devices, serves them, and starts processes that see them.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::io::{self, BufRead, BufReader, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use rustix::io::Errno;

use crate::config::{Access, BusConfig, DeviceConfig};
use crate::content::Source;
use crate::control::{AddressedCommand, Answer, DeviceCommand, Observation, ROOT_VARIABLE, Remote};
use crate::error::{BusError, SHIM, SHIM_VARIABLE};
use crate::evk1::{Evk1, SyncLine, produce};
use crate::treuzell::Treuzell;
use crate::usb::function::Function;
use crate::usb::queues::Queues;
use crate::usb::readiness::Readiness;
use crate::usb::serve::{Node, listen};
use crate::usb::testbed::{Address, TestBed};
use crate::world::{Edge, World};

enum Device {
    Evk1(Arc<Evk1>),
    Treuzell(Arc<Treuzell>),
}

struct BusDevice {
    config: DeviceConfig,
    at: Address,
    device: Device,
    queues: Arc<Queues>,
    present: bool,
}

struct Inner {
    bed: TestBed,
    world: Arc<World>,
    sync_line: Arc<SyncLine>,
    devices: Mutex<BTreeMap<String, BusDevice>>,
    closed: AtomicBool,
}

/// An emulated bus. Dropping it removes everything on it.
pub struct Bus(Arc<Inner>);

impl Bus {
    /// Creates a bus with its devices.
    ///
    /// # Errors
    /// When the configuration is inconsistent or the system fails.
    pub fn start(config: &BusConfig) -> Result<Self, BusError> {
        let bed = TestBed::create()?;
        let inner = Arc::new(Inner {
            world: Arc::new(World::around(bed.root())),
            bed,
            sync_line: Arc::default(),
            devices: Mutex::default(),
            closed: AtomicBool::new(false),
        });
        let root = inner.bed.root();
        inner
            .world
            .listen(UnixListener::bind(root.join("world"))?)?;
        let listener = UnixListener::bind(root.join("control"))?;
        for (n, device) in config.devices.iter().enumerate() {
            let at = Address {
                port: n as u8 + 1,
                number: n as u8 + 2,
            };
            inner.plug(device, at)?;
        }
        let serving = Arc::clone(&inner);
        thread::Builder::new()
            .name("control".into())
            .spawn(move || serving.accept_connections(&listener))?;
        Ok(Self(inner))
    }

    /// Folder that replaces `/sys` and `/dev`.
    #[must_use]
    pub fn root(&self) -> &Path {
        self.0.bed.root()
    }

    /// Inputs of the cameras from outside.
    #[must_use]
    pub fn world(&self) -> Arc<World> {
        Arc::clone(&self.0.world)
    }

    /// A connection for controlling the devices.
    ///
    /// When the system fails.
    /// When the machine refuses.
    pub fn remote(&self) -> io::Result<Remote> {
        Remote::connect(self.root())
    }

    /// A command that sees this bus instead of the computer's.
    ///
    /// # Errors
    /// [`BusError::NoShim`].
    pub fn command(&self, program: impl AsRef<OsStr>) -> Result<Command, BusError> {
        let mut command = Command::new(program);
        command
            .env("LD_PRELOAD", shim()?)
            .env(ROOT_VARIABLE, self.root());
        Ok(command)
    }
}

impl Drop for Bus {
    fn drop(&mut self) {
        let inner = &self.0;
        inner.closed.store(true, Ordering::Relaxed);
        inner.world.close();
        let serials: Vec<String> = inner.lock().keys().cloned().collect();
        for serial in serials {
            // A device that is already unplugged stays so.
            let _ = inner.execute(&serial, DeviceCommand::Unplug);
        }
        for name in ["world", "control"] {
            // Wakes the listener, which then ends.
            let _ = UnixStream::connect(inner.bed.root().join(name));
        }
    }
}

/// Path of the preload library: from the variable `SKINRIG_USBSHIM`, otherwise next to this
/// program, where Cargo puts it.
///
/// # Errors
/// [`BusError::NoShim`].
pub fn shim() -> Result<PathBuf, BusError> {
    if let Some(path) = std::env::var_os(SHIM_VARIABLE) {
        let path = PathBuf::from(path);
        return if path.is_file() {
            Ok(path)
        } else {
            Err(BusError::NoShim(path))
        };
    }
    let program = std::env::current_exe()?;
    let folder = program.parent().unwrap_or(Path::new("."));
    // A test is in `deps`, a program one level above.
    let candidates = [folder.join(SHIM), folder.join("deps").join(SHIM)];
    let [first, second] = &candidates;
    if second.is_file() && !first.is_file() {
        return Ok(second.clone());
    }
    if first.is_file() {
        return Ok(first.clone());
    }
    Err(BusError::NoShim(first.clone()))
}

impl Inner {
    fn lock(&self) -> std::sync::MutexGuard<'_, BTreeMap<String, BusDevice>> {
        self.devices.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn plug(&self, config: &DeviceConfig, at: Address) -> Result<(), BusError> {
        let name = config.serial().to_owned();
        if self.lock().get(&name).is_some_and(|d| d.present) {
            return Err(BusError::Config {
                expected: "a name for each device".into(),
                found: format!("two devices named {name}"),
            });
        }
        let ready = Readiness::create(&self.bed.node(at))?;
        let (device, function, queues): (Device, Arc<dyn Function>, Arc<Queues>) = match config {
            DeviceConfig::Evk1(config) => {
                let serial =
                    u32::from_str_radix(&config.serial, 16).map_err(|_| BusError::Config {
                        expected: "a serial number of hexadecimal digits".into(),
                        found: config.serial.clone(),
                    })?;
                let source = Source::new(&config.content)?;
                let queues = Arc::new(Queues::new(config.fifo_bytes, ready));
                match config.access {
                    Access::Free => {}
                    Access::Busy => queues.occupy(),
                    Access::NotPermitted => self.bed.refuse(at, Errno::ACCESS)?,
                }
                let camera = Arc::new(Evk1::new(
                    (**config).clone(),
                    serial,
                    Arc::clone(&queues),
                    Arc::clone(&self.world),
                    Arc::clone(&self.sync_line),
                ));
                let producing = Arc::clone(&camera);
                thread::Builder::new()
                    .name(format!("evk1 {}", config.serial))
                    .spawn(move || produce(&producing, source))?;
                (Device::Evk1(Arc::clone(&camera)), camera, queues)
            }
            DeviceConfig::Treuzell { .. } => {
                let camera = Arc::new(Treuzell::new());
                let queues = Arc::new(Queues::new(0, ready));
                (Device::Treuzell(Arc::clone(&camera)), camera, queues)
            }
        };
        let node = Node {
            function: Arc::clone(&function),
            queues: Arc::clone(&queues),
        };
        listen(node, UnixListener::bind(self.bed.socket(at))?)?;
        self.bed.add(at, function.descriptors())?;
        let plugged = BusDevice {
            config: config.clone(),
            at,
            device,
            queues,
            present: true,
        };
        self.lock().insert(name, plugged);
        Ok(())
    }

    fn accept_connections(self: &Arc<Self>, listener: &UnixListener) {
        while let Ok((stream, _)) = listener.accept() {
            if self.closed.load(Ordering::Relaxed) {
                return;
            }
            let inner = Arc::clone(self);
            let serving = move || {
                // A broken connection means that the process ended.
                let _ = inner.serve_connection(stream);
            };
            if thread::Builder::new()
                .name("control line".into())
                .spawn(serving)
                .is_err()
            {
                return;
            }
        }
    }

    fn serve_connection(&self, mut stream: UnixStream) -> io::Result<()> {
        for line in BufReader::new(stream.try_clone()?).lines() {
            let answer = match serde_json::from_str::<AddressedCommand>(&line?) {
                Ok((serial, order)) => self
                    .execute(&serial, order)
                    .unwrap_or_else(|e| Answer::Failed(e.to_string())),
                Err(e) => Answer::Failed(e.to_string()),
            };
            let mut text = serde_json::to_string(&answer)?;
            text.push('\n');
            stream.write_all(text.as_bytes())?;
        }
        Ok(())
    }

    fn execute(&self, serial: &str, order: DeviceCommand) -> Result<Answer, BusError> {
        let unknown = || BusError::Config {
            expected: "a device of this bus".into(),
            found: serial.to_owned(),
        };
        let mut devices = self.lock();
        let newest = devices.values().map(|d| d.at.number).max();
        let plugged = devices.get_mut(serial).ok_or_else(unknown)?;
        let camera = match &plugged.device {
            Device::Evk1(camera) => Ok(camera),
            Device::Treuzell(_) => Err(BusError::Config {
                expected: "an order for an EVK1".into(),
                found: format!("{order:?} for {serial}"),
            }),
        };
        match order {
            DeviceCommand::Unplug => {
                if plugged.present {
                    plugged.present = false;
                    match &plugged.device {
                        Device::Evk1(camera) => camera.unplug(),
                        Device::Treuzell(_) => plugged.queues.unplug(),
                    }
                    // Wakes the listener, which then ends.
                    let _ = UnixStream::connect(self.bed.socket(plugged.at));
                    self.bed.remove(plugged.at)?;
                }
            }
            DeviceCommand::Plug => {
                let config = plugged.config.clone();
                let at = Address {
                    port: plugged.at.port,
                    number: newest.unwrap_or(1) + 1,
                };
                drop(devices);
                self.plug(&config, at)?;
            }
            DeviceCommand::Stall => plugged.queues.stall(),
            DeviceCommand::Cut(bytes) => plugged.queues.cut_next(bytes),
            DeviceCommand::Garbage(words) => camera?.lock().faults.garbage.extend(words),
            DeviceCommand::DropWords(words) => camera?.lock().faults.dropped_words = words,
            DeviceCommand::HotPixels(pixels) => camera?.lock().faults.hot_pixels = pixels,
            DeviceCommand::IgnoreWrites(address) => {
                camera?.lock().faults.ignored_registers.insert(address);
            }
            DeviceCommand::Silence(on) => camera?.lock().faults.silent = on,
            DeviceCommand::FailResets(on) => plugged.queues.fail_resets(on),
            DeviceCommand::BreakTransfer(after) => plugged.queues.break_after(after),
            DeviceCommand::FailReads(on) => camera?.lock().faults.failing_reads = on,
            DeviceCommand::Edge {
                channel,
                rising,
                at_ns,
            } => {
                let edge = Edge {
                    channel,
                    rising,
                    at_ns,
                };
                self.world.edge(serial, edge);
            }
            DeviceCommand::Temperature(steps) => {
                camera?.lock().set_temperature(steps);
            }
            DeviceCommand::Observe => {
                let counters = camera?.lock().counters;
                let delivered = plugged.queues.delivered();
                return Ok(Answer::Observed(Observation {
                    delivered,
                    counters,
                }));
            }
            DeviceCommand::Journal => {
                return Ok(Answer::Journal(match &plugged.device {
                    Device::Evk1(camera) => camera.lock().journal.clone(),
                    Device::Treuzell(camera) => camera.journal(),
                }));
            }
            DeviceCommand::Register(address) => {
                let value = camera?.lock().registers.read(address);
                return value.map(Answer::Register).ok_or_else(|| BusError::Config {
                    expected: "a register of an EVK1".into(),
                    found: format!("{address:#06x}"),
                });
            }
        }
        Ok(Answer::Done)
    }
}
