//! Input of the checks of `skinrig doctor`.

use std::path::Path;

use skinrig_protocol::rig::RigFile;

use super::machine::Machine;
use super::survey::Survey;
use crate::rig::inputs::Input;

/// Input of the checks.
pub(super) struct Case<'a> {
    pub machine: &'a Machine,
    pub rig: Option<&'a RigFile>,
    /// Files and programs of this computer that the rig file names.
    pub inputs: &'a [Input],
    pub survey: &'a Survey,
    pub sessions: &'a Path,
    /// The file of the bench's lease.
    pub lease: Option<&'a Path>,
}
