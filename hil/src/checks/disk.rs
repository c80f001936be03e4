//! Checks: the disk that sessions go to.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read as _, Seek as _, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use skinrig_nightly::{Evidence, EvidenceKind};
use skinrig_protocol::suite::{Check, Measure};

use crate::bench::{Bench, Trouble};
use crate::findings::Findings;
use crate::trouble::COMPUTER;

/// Bytes of a write; also of a read.
const BLOCK: usize = 4 << 20;
/// No block is begun after this: a disk so slow has failed, whatever the amount.
const LIMIT: Duration = Duration::from_secs(120);
/// So much more than the amount must be free before anything is written: a check does not fill a disk.
const RESERVE: f64 = 1.1;

/// Makes the check.
pub fn disk(check: &Check, bench: &mut dyn Bench, found: &mut Findings) {
    let Measure::Disk { amount_b } = check.measure else {
        return;
    };
    let folder = bench.folder().to_owned();
    let made = std::fs::create_dir_all(&folder);
    let room = made
        .map_err(|e| failed(&e, "making", &folder))
        .and_then(|()| {
            free_b(&folder).map_err(|e| failed(&e, "asking for free space in", &folder))
        });
    let free_b = match room {
        Ok(free_b) => free_b,
        Err(trouble) => return found.trouble(*trouble, COMPUTER, &["write_rate", "free"]),
    };
    found
        .value(COMPUTER, "free", free_b)
        .noting(folder.display().to_string());
    if free_b < amount_b * RESERVE {
        let what = format!(
            "{}: expected room for {:.0} MB and a tenth more, found {:.0} MB free",
            folder.display(),
            amount_b / 1e6,
            free_b / 1e6
        );
        let evidence = Evidence::new(EvidenceKind::Disk, COMPUTER, what).next(MAKE_ROOM);
        return found.trouble(evidence, COMPUTER, &["write_rate"]);
    }
    match write_and_read(&folder, amount_b as u64) {
        Ok(done) => {
            let read_mb_s = done.bytes as f64 / done.read_s.max(1e-9) / 1e6;
            found
                .value(COMPUTER, "write_rate", done.bytes as f64 / done.write_s.max(1e-9))
                .noting(format!(
                    "{:.0} MB, synchronised after {:.3} s; read back at {read_mb_s:.0} MB/s, perhaps from memory",
                    done.bytes as f64 / 1e6,
                    done.write_s
                ));
        }
        Err(trouble) => found.trouble(*trouble, COMPUTER, &["write_rate"]),
    }
}

const MAKE_ROOM: &str = "make room, or give another folder with --sessions";

/// What was written, and how long it took.
struct Done {
    bytes: u64,
    write_s: f64,
    read_s: f64,
}

/// A file without a name: it is gone with its handle, however this ends.
struct Nameless {
    file: File,
    /// Where it was, for messages.
    path: PathBuf,
}

impl Nameless {
    fn create(folder: &Path) -> Result<Self, Trouble> {
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
        let file = file.map_err(|e| failed(&e, "making", &path))?;
        // Its space is given back when the handle is closed, by whatever end.
        std::fs::remove_file(&path).map_err(|e| failed(&e, "removing", &path))?;
        Ok(Self { file, path })
    }
}

/// Writes `amount_b` bytes that nothing compresses, synchronises, reads them back and compares.
fn write_and_read(folder: &Path, amount_b: u64) -> Result<Done, Trouble> {
    let mut on = Nameless::create(folder)?;
    let mut block = vec![0; BLOCK];
    let begin = Instant::now();
    let mut bytes = 0;
    let mut blocks = 0;
    while bytes < amount_b && begin.elapsed() < LIMIT {
        fill(&mut block, blocks);
        let part = BLOCK.min(usize::try_from(amount_b - bytes).unwrap_or(BLOCK));
        on.file
            .write_all(&block[..part])
            .map_err(|e| failed(&e, "writing to", &on.path))?;
        bytes += part as u64;
        blocks += 1;
    }
    on.file
        .sync_all()
        .map_err(|e| failed(&e, "synchronising", &on.path))?;
    let write_s = begin.elapsed().as_secs_f64();
    forget_cached(&on.file);
    let begin = Instant::now();
    on.file
        .rewind()
        .map_err(|e| failed(&e, "reading", &on.path))?;
    let (mut expected, mut rest) = (vec![0; BLOCK], bytes);
    for number in 0..blocks {
        let part = BLOCK.min(usize::try_from(rest).unwrap_or(BLOCK));
        fill(&mut expected, number);
        on.file
            .read_exact(&mut block[..part])
            .map_err(|e| failed(&e, "reading", &on.path))?;
        if let Some(at) = (0..part).find(|k| block[*k] != expected[*k]) {
            let what = format!(
                "{}: expected what was written, found another byte at {}",
                folder.display(),
                number * BLOCK as u64 + at as u64
            );
            let next = "do not trust this disk: look at its health (`smartctl`, `dmesg`) before any campaign";
            let evidence = Evidence::new(EvidenceKind::Disk, COMPUTER, what).next(next);
            return Err(Box::new(evidence));
        }
        rest -= part as u64;
    }
    Ok(Done {
        bytes,
        write_s,
        read_s: begin.elapsed().as_secs_f64(),
    })
}

/// Bytes of the block with this number: the generator of Steele, Lea and Flood (2014), which no disk compresses.
fn fill(block: &mut [u8], number: u64) {
    let mut state = number.wrapping_mul(0xd134_2543_de82_ef95);
    for word in block.chunks_exact_mut(8) {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (state ^ state >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        word.copy_from_slice(&(z ^ z >> 31).to_le_bytes());
    }
}

/// Evidence of what the system answered, with what to do about it.
fn failed(error: &io::Error, doing: &str, path: &Path) -> Trouble {
    let next = match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => MAKE_ROOM,
        ErrorKind::ReadOnlyFilesystem => {
            "the file system is read-only: look for its errors (`dmesg`), mount it for writing"
        }
        ErrorKind::PermissionDenied => {
            "let this user write there (owner and mode of the folder), or give another folder with --sessions"
        }
        ErrorKind::NotADirectory | ErrorKind::NotFound => "give a folder with --sessions",
        _ => "look at the disk's health (`smartctl`, `dmesg`)",
    };
    let what = format!(
        "expected success in {doing} {}, found: {error}",
        path.display()
    );
    Box::new(Evidence::new(EvidenceKind::Disk, COMPUTER, what).next(next))
}

/// Free bytes in `folder`, for whoever may write there.
#[cfg(unix)]
fn free_b(folder: &Path) -> io::Result<f64> {
    let room = rustix::fs::statvfs(folder)?;
    Ok(room.f_bavail as f64 * room.f_frsize as f64)
}

#[cfg(not(unix))]
fn free_b(_folder: &Path) -> io::Result<f64> {
    Err(io::Error::other(
        "free space cannot be asked for on this system",
    ))
}

/// Asks the system to read from the disk what it is asked for next, instead of from memory; it need not.
#[cfg(target_os = "linux")]
fn forget_cached(file: &File) {
    // A file system that does not know this reads from memory.
    let _ = rustix::fs::fadvise(file, 0, None, rustix::fs::Advice::DontNeed);
}

#[cfg(not(target_os = "linux"))]
fn forget_cached(_file: &File) {}
