//! Mismatches that `--tolerant` accepted, and the lines of the rig file that accept them permanently.

use std::collections::BTreeSet;

use skinrig_evk1::{Mismatches, ToleranceKey};
use skinrig_model::CameraId;
use skinrig_protocol::rig::{CameraSetup, RigFile};

/// Mismatches tolerated so far; more are added while the cameras run.
#[derive(Debug, Clone, Default)]
pub struct ToleratedMismatches(Vec<(CameraId, Mismatches)>);

impl ToleratedMismatches {
    /// Adds the mismatches of a camera.
    pub(crate) fn add(&mut self, camera: CameraId, mismatches: Mismatches) {
        self.0.push((camera, mismatches));
    }

    /// Prints the lines for `rig` that accept the tolerated mismatches, if there were any.
    pub(crate) fn propose(&self, rig: &RigFile) {
        if let Some(lines) = self.lines(rig) {
            errln!(
                "warning: camera mismatches were accepted. Add what is right for your cameras to {}, then run without --tolerant:\n{lines}",
                rig.file_name
            );
        }
    }

    /// Those lines, under their keys, together with what the rig file already accepts.
    fn lines(&self, rig: &RigFile) -> Option<String> {
        let mut lines = String::new();
        for camera in CameraId::ALL {
            let of_camera = self.0.iter().filter(|(c, _)| *c == camera);
            let mismatches: BTreeSet<ToleranceKey> = of_camera
                .flat_map(|(_, mismatches)| mismatches.all())
                .map(|mismatch| mismatch.key)
                .collect();
            if !mismatches.is_empty() {
                let setup = &rig.cameras[camera.index()];
                lines += &format!(
                    "  camera{}:\n{}",
                    camera.index() + 1,
                    keys(setup, &mismatches)
                );
            }
        }
        (!lines.is_empty()).then(|| format!("cameras:\n{}", lines.trim_end()))
    }
}

fn keys(setup: &CameraSetup, mismatches: &BTreeSet<ToleranceKey>) -> String {
    let mut statuses: BTreeSet<u8> = setup.read_status.iter().copied().collect();
    let mut registers: BTreeSet<u32> = setup.read_back_exceptions.iter().copied().collect();
    let (mut reset, mut transfers) = (false, false);
    for key in mismatches {
        match key {
            ToleranceKey::ReadStatus(status) => drop(statuses.insert(*status)),
            ToleranceKey::ReadBack(address) => drop(registers.insert(*address)),
            ToleranceKey::FailedReset => reset = true,
            ToleranceKey::FailedTransfers => transfers = true,
        }
    }
    let list = |items: Vec<String>| items.join(", ");
    let mut lines = String::new();
    if mismatches
        .iter()
        .any(|k| matches!(k, ToleranceKey::ReadStatus(_)))
    {
        let items = statuses.iter().map(|s| format!("\"{s:#04x}\"")).collect();
        lines += &format!("    read_status: [{}]\n", list(items));
    }
    if mismatches
        .iter()
        .any(|k| matches!(k, ToleranceKey::ReadBack(_)))
    {
        let items = registers.iter().map(|a| format!("\"{a:#06x}\"")).collect();
        lines += &format!("    read_back_exceptions: [{}]\n", list(items));
    }
    for (is_tolerated, key) in [
        (reset, ToleranceKey::FailedReset),
        (transfers, ToleranceKey::FailedTransfers),
    ] {
        if is_tolerated {
            lines += &format!("    {key}\n");
        }
    }
    lines
}
