//! Check `disk`: write rate and free space of the disk for sessions.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read as _, Seek as _, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use skinrig_nightly::{Evidence, EvidenceKind};
use skinrig_protocol::suite::{Check, Measure};

use crate::bench::{Bench, Problem};
use crate::device_evidence::COMPUTER;
use crate::findings::Findings;

/// Bytes per write and per read.
const BLOCK: usize = 4 << 20;
/// Writing stops after this time: a slower disk fails, whatever the amount.
const WRITE_TIMEOUT: Duration = Duration::from_secs(120);
/// Required free space as a multiple of the amount: a check must not fill the disk.
const RESERVE: f64 = 1.1;

/// Runs the check.
pub(super) fn disk(check: &Check, bench: &mut dyn Bench, findings: &mut Findings) {
    let Measure::Disk { amount_b } = check.measure else {
        return;
    };
    let folder = bench.folder().to_owned();
    let created = std::fs::create_dir_all(&folder);
    let free = created
        .map_err(|e| io_problem(&e, "creating", &folder))
        .and_then(|()| {
            free_b(&folder).map_err(|e| io_problem(&e, "asking for free space in", &folder))
        });
    let free_b = match free {
        Ok(free_b) => free_b,
        Err(problem) => return findings.failed(*problem, COMPUTER, &["write_rate", "free"]),
    };
    findings
        .value(COMPUTER, "free", free_b)
        .with_note(folder.display().to_string());
    if free_b < amount_b * RESERVE {
        let what = format!(
            "{}: expected at least {:.0} MB plus 10 % free, found {:.0} MB free",
            folder.display(),
            amount_b / 1e6,
            free_b / 1e6
        );
        let evidence = Evidence::new(EvidenceKind::Disk, COMPUTER, what).next(FREE_SPACE_STEP);
        return findings.failed(evidence, COMPUTER, &["write_rate"]);
    }
    match write_and_read(&folder, amount_b as u64) {
        Ok(timing) => {
            let read_mb_s = timing.bytes as f64 / timing.read_s.max(1e-9) / 1e6;
            findings
                .value(COMPUTER, "write_rate", timing.write_rate_b_s())
                .with_note(format!(
                    "{:.0} MB, synced after {:.3} s; read back at {read_mb_s:.0} MB/s, possibly from the cache",
                    timing.bytes as f64 / 1e6,
                    timing.write_s
                ));
        }
        Err(problem) => findings.failed(*problem, COMPUTER, &["write_rate"]),
    }
}

/// Bytes per second that the disk of `folder` takes, synced. The amount is written to a file without a name.
///
/// # Errors
/// Evidence of a disk that cannot be written, or that returns other bytes, with the next step.
pub fn disk_write_rate(folder: &Path, amount_b: u64) -> Result<f64, Problem> {
    let timing = write_and_read(folder, amount_b)?;
    Ok(timing.write_rate_b_s())
}

const FREE_SPACE_STEP: &str = "free some space, or choose another folder with --sessions";

/// Amount and duration of the test.
struct DiskTiming {
    bytes: u64,
    write_s: f64,
    read_s: f64,
}

impl DiskTiming {
    fn write_rate_b_s(&self) -> f64 {
        self.bytes as f64 / self.write_s.max(1e-9)
    }
}

/// A file without a name: the system deletes it when the handle closes, even after a crash.
struct UnlinkedFile {
    file: File,
    /// Former path, for messages.
    path: PathBuf,
}

impl UnlinkedFile {
    fn create(folder: &Path) -> Result<Self, Problem> {
        let since = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap_or_default();
        let name = format!(
            ".skinrig-disk-check-{}-{}",
            std::process::id(),
            since.as_nanos()
        );
        let path = folder.join(name);
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .create_new(true)
            .open(&path);
        let file = file.map_err(|e| io_problem(&e, "creating", &path))?;
        // The system frees the space when the handle closes.
        std::fs::remove_file(&path).map_err(|e| io_problem(&e, "removing", &path))?;
        Ok(Self { file, path })
    }
}

/// Writes `amount_b` incompressible bytes, syncs, reads them back and compares.
fn write_and_read(folder: &Path, amount_b: u64) -> Result<DiskTiming, Problem> {
    let mut scratch = UnlinkedFile::create(folder)?;
    let mut block = vec![0; BLOCK];
    let begin = Instant::now();
    let mut bytes = 0;
    let mut blocks = 0;
    while bytes < amount_b && begin.elapsed() < WRITE_TIMEOUT {
        fill(&mut block, blocks);
        let part = BLOCK.min(usize::try_from(amount_b - bytes).unwrap_or(BLOCK));
        scratch
            .file
            .write_all(&block[..part])
            .map_err(|e| io_problem(&e, "writing to", &scratch.path))?;
        bytes += part as u64;
        blocks += 1;
    }
    scratch
        .file
        .sync_all()
        .map_err(|e| io_problem(&e, "syncing", &scratch.path))?;
    let write_s = begin.elapsed().as_secs_f64();
    drop_cache(&scratch.file);
    let begin = Instant::now();
    scratch
        .file
        .rewind()
        .map_err(|e| io_problem(&e, "reading", &scratch.path))?;
    let (mut expected, mut rest) = (vec![0; BLOCK], bytes);
    for number in 0..blocks {
        let part = BLOCK.min(usize::try_from(rest).unwrap_or(BLOCK));
        fill(&mut expected, number);
        scratch
            .file
            .read_exact(&mut block[..part])
            .map_err(|e| io_problem(&e, "reading", &scratch.path))?;
        if let Some(at) = (0..part).find(|k| block[*k] != expected[*k]) {
            let what = format!(
                "{}: expected the bytes that were written, found a different byte at offset {}",
                folder.display(),
                number * BLOCK as u64 + at as u64
            );
            let next = "do not trust this disk: check its health (`smartctl`, `dmesg`) before any campaign";
            let evidence = Evidence::new(EvidenceKind::Disk, COMPUTER, what).next(next);
            return Err(Box::new(evidence));
        }
        rest -= part as u64;
    }
    Ok(DiskTiming {
        bytes,
        write_s,
        read_s: begin.elapsed().as_secs_f64(),
    })
}

/// Fills a block with pseudorandom bytes (SplitMix, Steele, Lea and Flood, 2014), which no disk can compress.
fn fill(block: &mut [u8], number: u64) {
    let mut state = number.wrapping_mul(0xd134_2543_de82_ef95);
    for word in block.chunks_exact_mut(8) {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (state ^ state >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        word.copy_from_slice(&(z ^ z >> 31).to_le_bytes());
    }
}

/// Evidence from an I/O error, with the next step.
fn io_problem(error: &io::Error, doing: &str, path: &Path) -> Problem {
    let next = match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => FREE_SPACE_STEP,
        ErrorKind::ReadOnlyFilesystem => {
            "the file system is read-only: check it for errors (`dmesg`) and mount it for writing"
        }
        ErrorKind::PermissionDenied => {
            "give this user write access (owner and mode of the folder), or choose another folder with --sessions"
        }
        ErrorKind::NotADirectory | ErrorKind::NotFound => "choose a folder with --sessions",
        _ => "check the disk's health (`smartctl`, `dmesg`)",
    };
    let what = format!("{doing} {} failed: {error}", path.display());
    Box::new(Evidence::new(EvidenceKind::Disk, COMPUTER, what).next(next))
}

/// Bytes in `folder` that are free for unprivileged users.
#[cfg(unix)]
fn free_b(folder: &Path) -> io::Result<f64> {
    let free = rustix::fs::statvfs(folder)?;
    Ok(free.f_bavail as f64 * free.f_frsize as f64)
}

#[cfg(not(unix))]
fn free_b(_folder: &Path) -> io::Result<f64> {
    Err(io::Error::other("this system does not report free space"))
}

/// Asks the system to drop cached pages of the file, so that the next read comes from the disk. It may ignore this.
#[cfg(target_os = "linux")]
fn drop_cache(file: &File) {
    // File systems that do not support this read from memory.
    let _ = rustix::fs::fadvise(file, 0, None, rustix::fs::Advice::DontNeed);
}

#[cfg(not(target_os = "linux"))]
fn drop_cache(_file: &File) {}
