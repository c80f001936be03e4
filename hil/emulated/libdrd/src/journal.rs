//! The journal: one line per C call of every process that loaded the library.
//!
//! `time process thread name function arguments -> result`: start time in ns of `CLOCK_MONOTONIC`, process ID, index and name of the thread
//! (spaces as `_`), and the arguments as comma-separated numbers (`-` for none). Lines are written at the end of a call; [`Journal`] sorts
//! them by start.

use std::cell::OnceCell;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::file;
use crate::time::now_ns;

/// A call.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Start, ns of `CLOCK_MONOTONIC`.
    pub t_ns: u64,
    /// Process ID.
    pub pid: u32,
    /// Index of the thread in its process, from 0 in order of first calls.
    pub thread: u64,
    /// Name of the thread.
    pub thread_name: String,
    /// Name of the function.
    pub call: String,
    /// Numeric arguments, without output pointers and the device.
    pub arguments: Vec<f64>,
    /// Result; NaN for a function without one.
    pub result: f64,
}

/// Calls in order of their start.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Journal {
    /// All calls.
    pub entries: Vec<Entry>,
}

impl Journal {
    /// Reads the journal of the arm in `directory`.
    ///
    /// # Errors
    /// When the file is unreadable or malformed.
    pub fn read(directory: &Path) -> io::Result<Self> {
        let text = match fs::read_to_string(directory.join(file::JOURNAL)) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => String::new(),
            other => other?,
        };
        // A killed process may leave an incomplete last line.
        let whole = text.rfind('\n').map_or("", |end| &text[..end]);
        let mut entries = whole
            .lines()
            .map(|line| {
                parse(line).ok_or_else(|| {
                    io::Error::new(io::ErrorKind::InvalidData, format!("not a call: {line}"))
                })
            })
            .collect::<io::Result<Vec<_>>>()?;
        entries.sort_by_key(|e| e.t_ns);
        Ok(Self { entries })
    }

    /// The calls of one function.
    pub fn calls(&self, name: &str) -> impl DoubleEndedIterator<Item = &Entry> {
        self.entries.iter().filter(move |e| e.call == name)
    }

    /// Position of the first call of a function.
    #[must_use]
    pub fn first(&self, name: &str) -> Option<usize> {
        self.entries.iter().position(|e| e.call == name)
    }

    /// Position of the last call of a function.
    #[must_use]
    pub fn last(&self, name: &str) -> Option<usize> {
        self.entries.iter().rposition(|e| e.call == name)
    }

    /// Every thread that called more than read functions: process, index, name.
    #[must_use]
    pub fn owners(&self) -> Vec<(u32, u64, String)> {
        let mut owners: Vec<_> = self
            .entries
            .iter()
            .filter(|e| !is_reading(&e.call))
            .map(|e| (e.pid, e.thread, e.thread_name.clone()))
            .collect();
        owners.sort();
        owners.dedup();
        owners
    }

    /// Largest distance between consecutive targets of a motion, m, per function.
    #[must_use]
    pub fn largest_step_m(&self, name: &str) -> f64 {
        let targets: Vec<&[f64]> = self
            .calls(name)
            .filter_map(|e| e.arguments.get(..3))
            .collect();
        targets
            .windows(2)
            .map(|pair| {
                pair[0]
                    .iter()
                    .zip(pair[1])
                    .map(|(a, b)| (a - b).powi(2))
                    .sum::<f64>()
                    .sqrt()
            })
            .fold(0.0, f64::max)
    }

    /// Calls that interfere with the regulation thread: power or brakes between a start and the next stop.
    #[must_use]
    pub fn beside_regulation(&self) -> Vec<&Entry> {
        let mut regulating = false;
        let mut faults = Vec::new();
        for entry in &self.entries {
            match entry.call.as_str() {
                "drdStart" | "drdAutoInit" | "drdCheckInit" => regulating |= entry.result >= 0.0,
                "drdStop" => regulating = regulating && entry.result < 0.0,
                "dhdEnableForce" | "dhdSetBrakes" if regulating => faults.push(entry),
                _ => {}
            }
        }
        faults
    }
}

/// Whether a function only reads.
#[must_use]
pub(crate) fn is_reading(name: &str) -> bool {
    // The verb after the prefix `dhd` or `drd`.
    let verb = name.get(3..).unwrap_or_default();
    ["Get", "Is", "Error"].iter().any(|v| verb.starts_with(v)) || name == "drdWaitForTick"
}

fn parse(line: &str) -> Option<Entry> {
    let words: Vec<&str> = line.split(' ').collect();
    let [t, pid, thread, thread_name, call, arguments, "->", result] = words[..] else {
        return None;
    };
    let arguments = match arguments {
        "-" => Vec::new(),
        numbers => numbers
            .split(',')
            .map(str::parse)
            .collect::<Result<_, _>>()
            .ok()?,
    };
    Some(Entry {
        t_ns: t.parse().ok()?,
        pid: pid.parse().ok()?,
        thread: thread.parse().ok()?,
        thread_name: thread_name.to_owned(),
        call: (call.len() > 3).then(|| call.to_owned())?,
        arguments,
        result: result.parse().ok()?,
    })
}

/// Writes calls of a library.
#[derive(Debug)]
pub(crate) struct Writer {
    file: File,
    reads: bool,
}

impl Writer {
    /// Appends to the journal of the arm in `directory`; `reads`: include calls that only read.
    pub fn open(directory: &Path, reads: bool) -> io::Result<Self> {
        let file = File::options()
            .append(true)
            .create(true)
            .open(directory.join(file::JOURNAL))?;
        Ok(Self { file, reads })
    }

    /// Writes a call as a single write, so that lines of several processes never mix.
    pub fn write(&self, began_ns: u64, call: &str, arguments: &[f64], result: f64) {
        if !self.reads && is_reading(call) {
            return;
        }
        let arguments = match arguments {
            [] => "-".to_owned(),
            some => some
                .iter()
                .map(f64::to_string)
                .collect::<Vec<_>>()
                .join(","),
        };
        let (thread, name) = this_thread();
        let pid = std::process::id();
        let line = format!("{began_ns} {pid} {thread} {name} {call} {arguments} -> {result}\n");
        // A journal that cannot be written shows as missing calls.
        let _ = (&self.file).write_all(line.as_bytes());
    }
}

/// Start of a call.
pub(crate) fn began() -> u64 {
    now_ns()
}

/// Index and name of the calling thread.
fn this_thread() -> (u64, String) {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    thread_local! {
        static NUMBER: OnceCell<(u64, String)> = const { OnceCell::new() };
    }
    NUMBER.with(|n| {
        n.get_or_init(|| (NEXT.fetch_add(1, Ordering::Relaxed), thread_name()))
            .clone()
    })
}

/// System name of the calling thread: its handle may belong to another Rust library.
fn thread_name() -> String {
    let mut name = [0_u8; 64];
    // SAFETY: the buffer has 64 bytes, more than any system's thread names, and outlives the call.
    let failed = unsafe {
        libc::pthread_getname_np(libc::pthread_self(), name.as_mut_ptr().cast(), name.len())
    };
    let end = name.iter().position(|b| *b == 0).unwrap_or(0);
    match String::from_utf8_lossy(&name[..end]) {
        text if failed == 0 && !text.is_empty() => text.replace(char::is_whitespace, "_"),
        _ => "?".to_owned(),
    }
}
