//! Takes the lease of a bench for every command that moves its robot, and shows leases (`skinrig
//! hil lease`).

use std::path::PathBuf;

use sha2::{Digest, Sha256};
use skinrig_hil::lease::{self, Lease, LeaseState, LeaseTiming, Owner};
use skinrig_protocol::rig::{RigFile, RigKind};

use super::args::HilLeaseArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::host::host_name;
use crate::rig::bench;

/// Takes the lease of `rig` for the command `what`. Keep it until every device is closed.
///
/// # Errors
/// [`Failure::rig`] (3) when another program holds it. The message names the holder and the next
/// step.
pub(crate) fn take(rig: &RigFile, what: &str) -> Result<Lease, Failure> {
    let owner = Owner::this_process(user(), host_name(), what.to_owned());
    let lease = Lease::take(&path(rig), owner, LeaseTiming::default()).map_err(Failure::rig)?;
    if let Some(note) = lease.note() {
        errln!("note: the bench was {note}");
    }
    Ok(lease)
}

/// Path of the lease file. It is named after the robot, so that two rig files for one robot share
/// it. Emulated robots all have the same serial number: their leases are named after their library
/// and stored beside it.
pub(crate) fn path(rig: &RigFile) -> PathBuf {
    let robot = &rig.robot;
    let name = format!("{}-{}", robot.model, robot.serial);
    let (RigKind::Emulated, Some(library)) = (rig.kind, &robot.library) else {
        return lease::path_of(&lease::folder(), &name);
    };
    let digest = Sha256::digest(library.as_os_str().as_encoded_bytes());
    let short: String = digest[..4].iter().map(|b| format!("{b:02x}")).collect();
    let beside = library.parent().filter(|f| f.is_dir());
    let folder = match beside {
        Some(folder) if std::env::var_os(lease::VARIABLE).is_none() => folder.to_owned(),
        _ => lease::folder(),
    };
    lease::path_of(&folder, &format!("{name}-emulated-{short}"))
}

/// Login name from the environment; `unknown` if it has none.
fn user() -> String {
    ["USER", "LOGNAME", "USERNAME"]
        .iter()
        .find_map(|name| std::env::var(name).ok().filter(|v| !v.is_empty()))
        .unwrap_or_else(|| "unknown".to_owned())
}

/// `skinrig hil lease`.
///
/// # Errors
/// [`Failure`] when rig file or lease cannot be read.
pub(crate) fn lease(args: &HilLeaseArgs, json: bool) -> Outcome {
    let paths = match &args.rig {
        Some(file) => vec![path(&bench::load(file)?)],
        None => lease_paths()?,
    };
    let mut shown = Vec::new();
    for path in &paths {
        let state = lease::inspect(path)
            .map_err(|e| Failure::rig(format!("{}: cannot be read: {e}", path.display())))?;
        if json {
            shown.push(to_json(path, &state));
        } else {
            outln!("{}\n  {}", path.display(), describe(&state));
        }
    }
    if json {
        crate::terminal::print_json(&serde_json::json!({ "leases": shown }));
    } else if paths.is_empty() {
        outln!("no leases in {}", lease::folder().display());
    }
    Ok(Exit::Ok)
}

/// Paths of all leases on this computer.
fn lease_paths() -> Result<Vec<PathBuf>, Failure> {
    let folder = lease::folder();
    let listed = std::fs::read_dir(&folder)
        .map_err(|e| Failure::rig(format!("{}: cannot be read: {e}", folder.display())))?;
    let mut paths: Vec<PathBuf> = listed
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|p| {
            let name = p.file_name().and_then(|n| n.to_str()).unwrap_or_default();
            name.starts_with("skinrig-") && name.ends_with(".lease")
        })
        .collect();
    paths.sort();
    Ok(paths)
}

/// Describes the holder of a lease. A new holder locks the file before it writes its name.
pub(crate) fn holder_of(owner: Option<&Owner>) -> String {
    owner.map_or_else(
        || "a program that is just acquiring it".to_owned(),
        ToString::to_string,
    )
}

fn describe(state: &LeaseState) -> String {
    match state {
        LeaseState::Free { last: None } => "free; never taken".to_owned(),
        LeaseState::Free { last: Some(last) } => format!("free; last: {last}"),
        LeaseState::Held { owner, beat_at } => {
            let who = holder_of(owner.as_deref());
            let beat = beat_at.as_ref();
            let beat = beat.map_or(String::new(), |b| format!("; last heartbeat {b}"));
            format!("held by {who}{beat}")
        }
        LeaseState::Abandoned { owner, beat_at } => {
            let end = match owner.is_running(&host_name()) {
                Some(false) => "which ended without releasing it",
                _ => "whose lock is invisible here; taking the lease first waits for a heartbeat",
            };
            format!("abandoned by {owner}, {end}; last heartbeat {beat_at}")
        }
    }
}

fn to_json(path: &std::path::Path, state: &LeaseState) -> serde_json::Value {
    let (state, owner, beat_at) = match state {
        LeaseState::Free { last } => ("free", last.as_ref(), None),
        LeaseState::Held { owner, beat_at } => ("held", owner.as_ref(), beat_at.as_ref()),
        LeaseState::Abandoned { owner, beat_at } => ("left", Some(owner), Some(beat_at)),
    };
    serde_json::json!({ "path": path, "state": state, "owner": owner, "beat_at": beat_at })
}
