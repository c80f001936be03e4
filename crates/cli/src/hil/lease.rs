//! The lease of a bench, taken by everything here that moves its robot; and `skinrig hil lease`, which shows it.

use std::path::PathBuf;

use sha2::{Digest, Sha256};
use skinrig_hil::lease::{self, Lease, LeaseState, LeaseTiming, Owner};
use skinrig_protocol::rig::{RigFile, RigKind};

use super::args::HilLeaseArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::host::host_name;
use crate::rig::bench;

/// Takes the bench of `rig`, to do `what` on it. Hold on to it until every device is closed.
///
/// # Errors
/// [`Failure::rig`] (3) when somebody else holds it: who, since when, and what to do.
pub(crate) fn take(rig: &RigFile, what: &str) -> Result<Lease, Failure> {
    let owner = Owner::this_process(user(), host_name(), what.to_owned());
    let lease = Lease::take(&path(rig), owner, LeaseTiming::default()).map_err(Failure::rig)?;
    if let Some(note) = lease.note() {
        errln!("note: the bench was {note}");
    }
    Ok(lease)
}

/// The file of the lease. The robot names it: two rig files for one robot share it. Stand-ins all have one serial number; what
/// tells them apart is the library that each is reached through, and their leases lie beside it and go with it.
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

/// The login name, as far as the environment tells it.
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
        None => all()?,
    };
    let mut shown = Vec::new();
    for path in &paths {
        let standing = lease::inspect(path)
            .map_err(|e| Failure::rig(format!("{}: cannot be read: {e}", path.display())))?;
        if json {
            shown.push(described(path, &standing));
        } else {
            outln!("{}\n  {}", path.display(), words(&standing));
        }
    }
    if json {
        crate::terminal::print_json(&serde_json::json!({ "leases": shown }));
    } else if paths.is_empty() {
        outln!("no lease was ever taken in {}", lease::folder().display());
    }
    Ok(Exit::Ok)
}

/// Every lease of this computer.
fn all() -> Result<Vec<PathBuf>, Failure> {
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

/// Who holds a lease; there is no name in the moment before the holder wrote it.
pub(crate) fn holder_of(owner: Option<&Owner>) -> String {
    owner.map_or_else(
        || "somebody who is just taking it".to_owned(),
        ToString::to_string,
    )
}

fn words(standing: &LeaseState) -> String {
    match standing {
        LeaseState::Free { last: None } => "free; nobody ever took it".to_owned(),
        LeaseState::Free { last: Some(last) } => format!("free; last: {last}"),
        LeaseState::Held { owner, beat_at } => {
            let who = holder_of(owner.as_deref());
            let beat = beat_at.as_ref();
            let beat = beat.map_or(String::new(), |b| format!("; last sign of life {b}"));
            format!("held by {who}{beat}")
        }
        LeaseState::Abandoned { owner, beat_at } => {
            let end = match owner.is_running(&host_name()) {
                Some(false) => "which died without releasing it",
                _ => "whose lock is not seen here; who takes it watches for a sign of life first",
            };
            format!("left by {owner}, {end}; last sign of life {beat_at}")
        }
    }
}

fn described(path: &std::path::Path, standing: &LeaseState) -> serde_json::Value {
    let (state, owner, beat_at) = match standing {
        LeaseState::Free { last } => ("free", last.as_ref(), None),
        LeaseState::Held { owner, beat_at } => ("held", owner.as_ref(), beat_at.as_ref()),
        LeaseState::Abandoned { owner, beat_at } => ("left", Some(owner), Some(beat_at)),
    };
    serde_json::json!({ "path": path, "state": state, "owner": owner, "beat_at": beat_at })
}
