//! State of the arm in shared memory: written by the firmware, read by any process at any rate.

use std::fs::File;
use std::io;
use std::os::fd::AsRawFd;
use std::path::Path;
use std::ptr::NonNull;
use std::sync::atomic::{AtomicU64, Ordering, fence};

/// State of the motors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Not calibrated; motors off.
    Reset,
    /// Motors off, no brake.
    Idle,
    /// Motors live.
    Force,
    /// Electromagnetic brake.
    Brake,
}

/// State of the emulated arm. Robot frame, SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmState {
    /// Time, ns of `CLOCK_MONOTONIC`.
    pub t_ns: u64,
    /// Iterations of the regulation loop so far.
    pub tick: u64,
    /// True position of the tip, m.
    pub position_m: [f64; 3],
    /// True velocity, m/s.
    pub velocity_m_s: [f64; 3],
    /// Motor force including gravity compensation, N; 0 unless the mode is [`Mode::Force`].
    pub motor_force_n: [f64; 3],
    /// Force of the sample on the tip, N.
    pub contact_force_n: [f64; 3],
    /// Set point of the regulation, m.
    pub reference_m: [f64; 3],
    /// Reported position, m: quantised, and with active faults.
    pub reported_position_m: [f64; 3],
    /// Reported velocity, m/s.
    pub reported_velocity_m_s: [f64; 3],
    /// Reported force, N: without gravity compensation, and with active faults.
    pub reported_force_n: [f64; 3],
    /// State of the motors.
    pub mode: Mode,
    /// Why the power last went off, as in the status vector.
    pub force_off_cause: i32,
    /// Number of watchdog trips.
    pub watchdog_trips: u64,
    /// Number of velocity trips.
    pub velocity_trips: u64,
    /// Whether the arm has been calibrated since power-up.
    pub initialised: bool,
    /// Whether a calibration or a sweep of the end stops is in progress.
    pub initialising: bool,
    /// Whether the regulation thread is running.
    pub regulating: bool,
    /// Whether a move or a tracked target is in progress.
    pub moving: bool,
    /// Whether USB is connected.
    pub connected: bool,
    /// Whether the motors are saturated.
    pub saturated: bool,
    /// Whether a library has the device open.
    pub held: bool,
}

/// Size of a state in the page, in words after the sequence counter.
const WORDS: usize = 2 + 8 * 3 + 5;
/// Size of the page's file.
const BYTES: usize = (WORDS + 1) * 8;
/// Read attempts before the writer counts as dead.
const ATTEMPTS: u32 = 100_000;

/// The mapped page. Word 0 is a sequence lock: it counts writes and is odd during a write.
#[derive(Debug)]
pub struct Page {
    words: NonNull<AtomicU64>,
}

// SAFETY: the page is only reached through atomics.
unsafe impl Send for Page {}
// SAFETY: the page is only reached through atomics.
unsafe impl Sync for Page {}

impl Page {
    /// Creates and maps the page's file.
    pub fn create(path: &Path) -> io::Result<Self> {
        let file = File::options()
            .read(true)
            .write(true)
            .create(true)
            .truncate(true)
            .open(path)?;
        file.set_len(BYTES as u64)?;
        Self::map(&file)
    }

    /// Maps the page of a running arm.
    pub fn open(path: &Path) -> io::Result<Self> {
        let file = File::options().read(true).write(true).open(path)?;
        if file.metadata()?.len() != BYTES as u64 {
            return Err(io::Error::new(
                io::ErrorKind::InvalidData,
                "not the page of an arm",
            ));
        }
        Self::map(&file)
    }

    fn map(file: &File) -> io::Result<Self> {
        // SAFETY: a fresh shared mapping of a file of that length; it aliases nothing in this process.
        let address = unsafe {
            libc::mmap(
                std::ptr::null_mut(),
                BYTES,
                libc::PROT_READ | libc::PROT_WRITE,
                libc::MAP_SHARED,
                file.as_raw_fd(),
                0,
            )
        };
        if address == libc::MAP_FAILED {
            return Err(io::Error::last_os_error());
        }
        NonNull::new(address.cast())
            .map(|words| Self { words })
            .ok_or_else(|| io::ErrorKind::OutOfMemory.into())
    }

    fn word(&self, index: usize) -> &AtomicU64 {
        assert!(index <= WORDS, "beyond the page");
        // SAFETY: the index is inside the mapping, which is aligned to a page and lives as long as `self`.
        unsafe { self.words.add(index).as_ref() }
    }

    /// Publishes a state. Single writer: the firmware writes under its lock.
    pub fn write(&self, state: &ArmState) {
        let sequence = self.word(0).load(Ordering::Relaxed);
        self.word(0)
            .store(sequence.wrapping_add(1), Ordering::Relaxed);
        fence(Ordering::Release);
        for (index, word) in to_words(state).into_iter().enumerate() {
            self.word(index + 1).store(word, Ordering::Relaxed);
        }
        self.word(0)
            .store(sequence.wrapping_add(2), Ordering::Release);
    }

    /// The latest state; `None` if the firmware died during a write, or never wrote.
    pub fn read(&self) -> Option<ArmState> {
        for attempt in 0..ATTEMPTS {
            let before = self.word(0).load(Ordering::Acquire);
            if before == 0 {
                return None;
            }
            let words: [u64; WORDS] =
                std::array::from_fn(|i| self.word(i + 1).load(Ordering::Relaxed));
            fence(Ordering::Acquire);
            if before.is_multiple_of(2) && self.word(0).load(Ordering::Relaxed) == before {
                return Some(from_words(&words));
            }
            if attempt > 100 {
                std::thread::yield_now();
            }
        }
        None
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        // SAFETY: our own mapping of that length; no reference into it outlives `self`.
        unsafe { libc::munmap(self.words.as_ptr().cast(), BYTES) };
    }
}

fn to_words(state: &ArmState) -> [u64; WORDS] {
    let mut words = Vec::with_capacity(WORDS);
    words.extend([state.t_ns, state.tick]);
    for vector in [
        state.position_m,
        state.velocity_m_s,
        state.motor_force_n,
        state.contact_force_n,
        state.reference_m,
        state.reported_position_m,
        state.reported_velocity_m_s,
        state.reported_force_n,
    ] {
        words.extend(vector.map(f64::to_bits));
    }
    let flags = [
        state.initialised,
        state.initialising,
        state.regulating,
        state.moving,
        state.connected,
        state.saturated,
        state.held,
    ];
    let mode = match state.mode {
        Mode::Reset => 0,
        Mode::Idle => 1,
        Mode::Force => 2,
        Mode::Brake => 3,
    };
    words.extend([
        mode,
        u64::from(state.force_off_cause.unsigned_abs()),
        state.watchdog_trips,
        state.velocity_trips,
        flags
            .iter()
            .rev()
            .fold(0, |word, flag| word << 1 | u64::from(*flag)),
    ]);
    std::array::from_fn(|i| words[i])
}

fn from_words(words: &[u64; WORDS]) -> ArmState {
    let vector = |n: usize| std::array::from_fn(|axis| f64::from_bits(words[2 + 3 * n + axis]));
    let [mode, cause, watchdog_trips, velocity_trips, flags] =
        std::array::from_fn(|i| words[26 + i]);
    let flag = |bit: u32| flags >> bit & 1 == 1;
    ArmState {
        t_ns: words[0],
        tick: words[1],
        position_m: vector(0),
        velocity_m_s: vector(1),
        motor_force_n: vector(2),
        contact_force_n: vector(3),
        reference_m: vector(4),
        reported_position_m: vector(5),
        reported_velocity_m_s: vector(6),
        reported_force_n: vector(7),
        mode: match mode {
            0 => Mode::Reset,
            1 => Mode::Idle,
            2 => Mode::Force,
            _ => Mode::Brake,
        },
        force_off_cause: i32::try_from(cause).unwrap_or(-1),
        watchdog_trips,
        velocity_trips,
        initialised: flag(0),
        initialising: flag(1),
        regulating: flag(2),
        moving: flag(3),
        connected: flag(4),
        saturated: flag(5),
        held: flag(6),
    }
}
