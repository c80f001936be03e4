//! What `--tolerant` let pass of a rig, and the lines of its rig file that accept it.

use std::collections::BTreeSet;

use skinrig_evk1::{Accept, Mismatches};
use skinrig_model::CameraId;
use skinrig_protocol::rig::{CameraSetup, RigFile};

/// What was let pass so far; goes on growing while the cameras run.
#[derive(Debug, Clone, Default)]
pub struct ToleratedMismatches(Vec<(CameraId, Mismatches)>);

impl ToleratedMismatches {
    /// Also what this camera shows.
    pub(crate) fn add(&mut self, camera: CameraId, seen: Mismatches) {
        self.0.push((camera, seen));
    }

    /// Prints the lines of `rig` that accept what was let pass, when anything was.
    pub(crate) fn propose(&self, rig: &RigFile) {
        if let Some(lines) = self.lines(rig) {
            errln!(
                "warning: camera mismatches were accepted. Add what is right for your cameras to {}, then run without --tolerant:\n{lines}",
                rig.file_name
            );
        }
    }

    /// Those lines, in the place where they belong, together with what the rig file accepts already.
    fn lines(&self, rig: &RigFile) -> Option<String> {
        let mut lines = String::new();
        for camera in CameraId::ALL {
            let of_camera = self.0.iter().filter(|(c, _)| *c == camera);
            let seen: BTreeSet<Accept> = of_camera
                .flat_map(|(_, seen)| seen.all())
                .map(|mismatch| mismatch.key)
                .collect();
            if !seen.is_empty() {
                let setup = &rig.cameras[camera.index()];
                lines += &format!("  camera{}:\n{}", camera.index() + 1, keys(setup, &seen));
            }
        }
        (!lines.is_empty()).then(|| format!("cameras:\n{}", lines.trim_end()))
    }
}

fn keys(setup: &CameraSetup, seen: &BTreeSet<Accept>) -> String {
    let mut statuses: BTreeSet<u8> = setup.read_status.iter().copied().collect();
    let mut registers: BTreeSet<u32> = setup.read_back_exceptions.iter().copied().collect();
    let (mut reset, mut transfers) = (false, false);
    for key in seen {
        match key {
            Accept::ReadStatus(status) => drop(statuses.insert(*status)),
            Accept::ReadBack(address) => drop(registers.insert(*address)),
            Accept::FailedReset => reset = true,
            Accept::FailedTransfers => transfers = true,
        }
    }
    let list = |items: Vec<String>| items.join(", ");
    let mut lines = String::new();
    if seen.iter().any(|k| matches!(k, Accept::ReadStatus(_))) {
        let items = statuses.iter().map(|s| format!("\"{s:#04x}\"")).collect();
        lines += &format!("    read_status: [{}]\n", list(items));
    }
    if seen.iter().any(|k| matches!(k, Accept::ReadBack(_))) {
        let items = registers.iter().map(|a| format!("\"{a:#06x}\"")).collect();
        lines += &format!("    read_back_exceptions: [{}]\n", list(items));
    }
    for (told, key) in [
        (reset, Accept::FailedReset),
        (transfers, Accept::FailedTransfers),
    ] {
        if told {
            lines += &format!("    {key}\n");
        }
    }
    lines
}
