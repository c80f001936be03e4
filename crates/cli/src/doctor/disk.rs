//! Checks free space, write speed and file system of the sessions folder.

use std::path::{Path, PathBuf};

use super::bench;
use super::case::Case;
use super::finding::{Finding, check};
use crate::rig::gates::size;

const AREA: &str = "disk";
/// Space left after a session, bytes, and rate of both cameras together, bytes/s: the defaults of `preflight` in a rig file.
const MIN_FREE_B: f64 = 2e9;
const DATA_RATE_B_S: f64 = 20e6;
/// A session of this length should fit, s. The preflight uses the length of the protocol instead.
const ROOM_FOR_S: f64 = 3600.0;
/// The session's log holds every byte before the session does.
const WRITES_PER_BYTE: f64 = 2.0;

/// All findings about the disk.
pub(super) fn findings(case: &Case<'_>) -> Vec<Finding> {
    // The folder may not exist yet: check the nearest one that does.
    let absolute = std::path::absolute(case.sessions).unwrap_or_else(|_| case.sessions.to_owned());
    let existing = absolute.ancestors().find(|f| f.exists());
    let existing = existing.unwrap_or(Path::new("/"));
    vec![
        space(case, existing),
        speed(case, existing),
        file_system(case, existing),
    ]
}

fn space(case: &Case<'_>, folder: &Path) -> Finding {
    let limits = case.rig.map(|r| r.preflight);
    let keep_b = limits.map_or(MIN_FREE_B, |l| l.min_free_disk_b);
    let rate_b_s = limits.map_or(DATA_RATE_B_S, |l| l.data_rate_b_s);
    let check = check(
        AREA,
        "free",
        format!(
            "{} to be left (preflight.min_free_disk), and an hour at {}/s (preflight.data_rate)",
            size(keep_b),
            size(rate_b_s)
        ),
    );
    let next = "free some space, or choose another folder with --sessions";
    match (case.machine.free_b)(folder) {
        Err(why) => check.not_checked(why),
        Ok(free_b) if free_b < keep_b => check.problem(size(free_b), next),
        Ok(free_b) => {
            let room_b = free_b - keep_b;
            let hours = |b_s: f64| format!("{:.1} h", room_b / b_s / 3600.0);
            let mut meaning = format!("{} at {}/s", hours(rate_b_s), size(rate_b_s));
            if let Some(demo_b_s) = crate::new::demo_rate_b_s() {
                meaning += &format!(" (demo: {:.0} h)", room_b / demo_b_s / 3600.0);
            }
            let finding = if room_b / rate_b_s < ROOM_FOR_S {
                check.warning(size(free_b), next)
            } else {
                check.ok(size(free_b))
            };
            finding.means(meaning)
        }
    }
}

fn speed(case: &Case<'_>, folder: &Path) -> Finding {
    let rate_b_s = case
        .rig
        .map_or(DATA_RATE_B_S, |r| r.preflight.data_rate_b_s);
    let need_b_s = WRITES_PER_BYTE * rate_b_s;
    let check = check(
        AREA,
        "write speed",
        format!(
            "at least {}/s: a run writes {}/s (preflight.data_rate), first to its log",
            size(need_b_s),
            size(rate_b_s)
        ),
    );
    if bench::running(case.sessions).is_some() {
        return check.not_checked("a run writes to this folder now; measuring would disturb it");
    }
    match (case.machine.write_b_s)(folder) {
        Err(fault) => check.problem(fault.what, fault.next),
        Ok(b_s) => {
            let found = format!("{}/s", size(b_s));
            let finding = if b_s < need_b_s {
                check.warning(
                    found,
                    "end programs that use the disk, or choose a faster one with --sessions",
                )
            } else {
                check.ok(found)
            };
            finding.means(format!("{:.1} times what a run writes", b_s / need_b_s))
        }
    }
}

/// Why a file system is unsuitable for sessions; `None` if it is suitable.
fn unfit(kind: &str) -> Option<&'static str> {
    Some(match kind {
        "tmpfs" | "ramfs" => "it is in memory and is lost when the computer is switched off",
        "nfs" | "nfs4" | "cifs" | "smb3" | "smbfs" | "9p" | "afs" | "ceph" | "glusterfs"
        | "lustre" | "fuse.sshfs" | "fuse.rclone" => {
            "it is behind a network, whose pauses lose data; SQLite's log does not work across machines"
        }
        "vfat" | "msdos" => "a file cannot exceed 4 GB",
        "fuseblk" | "fuse.ntfs-3g" | "fuse.exfat" => {
            "it is written slowly, by a separate program, and a power cut may lose more than the last write"
        }
        _ => return None,
    })
}

fn file_system(case: &Case<'_>, folder: &Path) -> Finding {
    let check = check(AREA, "file system", "a writable local disk");
    let mounts = match case.machine.text("/proc/self/mountinfo") {
        Ok(mounts) => mounts,
        Err(why) => return check.not_checked(why),
    };
    let folder = std::fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
    // The last of several mounts at one point hides the others.
    let under = mounts
        .lines()
        .filter_map(Mount::parse)
        .filter(|m| folder.starts_with(&m.point))
        .enumerate()
        .max_by_key(|(i, m)| (m.point.components().count(), *i));
    let Some((_, mount)) = under else {
        return check.not_checked(format!("no mount contains {}", folder.display()));
    };
    let found = format!("{} at {}", mount.kind, mount.point.display());
    let next = "choose another folder with --sessions";
    match unfit(&mount.kind) {
        _ if mount.read_only => check.problem(format!("{found}, read-only"), next),
        Some(why) => check.warning(format!("{found}: {why}"), next),
        None => check.ok(found),
    }
}

/// A line of `/proc/self/mountinfo` (`proc_pid_mountinfo(5)`).
struct Mount {
    point: PathBuf,
    read_only: bool,
    kind: String,
}

impl Mount {
    fn parse(line: &str) -> Option<Self> {
        let (place, system) = line.split_once(" - ")?;
        let mut place = place.split(' ').skip(4);
        let (point, options) = (place.next()?, place.next()?);
        let has = |options: &str| options.split(',').any(|o| o == "ro");
        let mut system = system.split(' ');
        let kind = system.next()?.to_owned();
        let super_options = system.nth(1).unwrap_or("");
        Some(Self {
            // White space and backslashes are octal escapes.
            point: point
                .replace("\\040", " ")
                .replace("\\011", "\t")
                .replace("\\134", "\\")
                .into(),
            read_only: has(options) || has(super_options),
            kind,
        })
    }
}
