//! The firmware process: the arm continues when the program that drives it dies.

mod body;
mod calls;
mod faults;
mod initialise;
mod regulation;
mod settings;
mod trajectory;
mod vector;
mod world;

use std::fs;
use std::io::{self, Write};
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use self::calls::Caller;
use self::world::{STEP_US, World};
use crate::config::ArmConfig;
use crate::file;
use crate::page::Page;
use crate::time::now_ns;
use crate::wire::{Connection, Reply, Request};

/// Interval at which the simulation advances without requests.
const WAKE_EVERY: Duration = Duration::from_micros(250);
/// Wake-ups between two checks of the driving process.
const WAKES_PER_LOOK: u32 = 16;

/// The arm and its shared memory.
#[derive(Debug)]
struct Firmware {
    world: Mutex<World>,
    page: Page,
}

/// The world at the current time; publishes the new state on drop.
struct CurrentWorld<'a> {
    world: MutexGuard<'a, World>,
    page: &'a Page,
}

impl Firmware {
    fn current(&self) -> CurrentWorld<'_> {
        let mut world = self.world.lock().unwrap_or_else(PoisonError::into_inner);
        world.advance_to(now_ns());
        CurrentWorld {
            world,
            page: &self.page,
        }
    }
}

impl Drop for CurrentWorld<'_> {
    fn drop(&mut self) {
        let state = self.world.state();
        self.page.write(&state);
    }
}

/// Runs the firmware of the arm in `directory` until the process ends.
///
/// Reads `arm.json` if it exists. With `announce_ready`, prints a line as soon as a library can connect.
///
/// # Errors
/// When the directory, the configuration, the page or the socket cannot be used.
pub fn run(directory: &Path, announce_ready: bool) -> io::Result<()> {
    let config = match fs::read(directory.join(file::CONFIG)) {
        Ok(json) => serde_json::from_slice(&json)?,
        Err(error) if error.kind() == io::ErrorKind::NotFound => ArmConfig::default(),
        Err(error) => return Err(error),
    };
    check(&config)?;
    let page = Page::create(&directory.join(file::PAGE))?;
    let firmware = Arc::new(Firmware {
        world: Mutex::new(World::new(config, now_ns())),
        page,
    });
    drop(firmware.current());
    let socket = directory.join(file::SOCKET);
    match fs::remove_file(&socket) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    let listener = UnixListener::bind(socket)?;
    if announce_ready {
        writeln!(io::stdout(), "ready")?;
        io::stdout().flush()?;
    }
    let arm = Arc::clone(&firmware);
    thread::Builder::new()
        .name("arm".to_owned())
        .spawn(move || run_clock(&arm))?;
    for (connection, stream) in (0..).zip(listener.incoming()) {
        let stream = stream?;
        let firmware = Arc::clone(&firmware);
        thread::Builder::new()
            .name("connection".to_owned())
            .spawn(move || serve(&firmware, connection, Connection::new(stream)))?;
    }
    Ok(())
}

fn check(config: &ArmConfig) -> io::Result<()> {
    let fault = if config.arm_index >= config.devices.len() {
        "arm_index: expected the index of one of the devices"
    } else if !(config.loop_khz > 0.0 && config.loop_khz <= 1000.0 / f64::from(STEP_US)) {
        "loop_khz: expected more than 0 and at most 4"
    } else if !(config.inertia_kg > 0.0 && config.resolution_m > 0.0 && config.reach_radius_m > 0.0)
    {
        "inertia_kg, resolution_m, reach_radius_m: expected more than 0"
    } else {
        return Ok(());
    };
    Err(io::Error::new(io::ErrorKind::InvalidData, fault))
}

/// Advances the arm repeatedly.
fn run_clock(firmware: &Firmware) {
    for wake in 0_u32.. {
        thread::sleep(WAKE_EVERY);
        let mut current = firmware.current();
        if wake.is_multiple_of(WAKES_PER_LOOK)
            && current.world.regulation.is_some()
            && let Some(holder) = &mut current.world.holder
        {
            holder.stopped = is_stopped(holder.pid);
        }
    }
}

/// Whether a process is stopped by a signal or dead, if the system reports it.
fn is_stopped(pid: u32) -> bool {
    let Ok(stat) = fs::read_to_string(format!("/proc/{pid}/stat")) else {
        return false;
    };
    // The state letter follows the command name in parentheses, which may contain parentheses.
    let state = stat
        .rsplit_once(") ")
        .and_then(|(_, rest)| rest.chars().next());
    matches!(state, Some('T' | 't' | 'Z' | 'X'))
}

/// Serves one library or control client until it disconnects.
fn serve(firmware: &Firmware, connection: u64, mut peer: Connection) {
    let mut pid = 0;
    while let Ok(Some(request)) = peer.receive() {
        let mut current = firmware.current();
        let world = &mut current.world;
        let reply = match request {
            Request::Hello { pid: driver } => {
                pid = driver;
                let config = &world.config;
                let mut about: Vec<f64> = config.sdk.iter().map(|n| f64::from(*n)).collect();
                about.push(config.arm_index as f64);
                about.extend(
                    [config.odd_bools, config.journal_reads].map(|b| f64::from(u8::from(b))),
                );
                Reply::values(about)
            }
            Request::Count => world.count(),
            Request::Device { index, call } => world.call(Caller { connection, pid }, index, &call),
            Request::Control(control) => world.control(control),
        };
        drop(current);
        if peer.send(&reply).is_err() {
            break;
        }
    }
    let mut current = firmware.current();
    if current
        .world
        .holder
        .is_some_and(|h| h.connection == connection)
    {
        current.world.release_holder();
    }
}
