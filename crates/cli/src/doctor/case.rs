//! What `skinrig doctor` examines.

use std::path::Path;

use skinrig_protocol::rig::RigFile;

use super::machine::Machine;
use super::survey::Survey;
use crate::rig::inputs::Input;

/// What is examined.
pub(super) struct Case<'a> {
    pub machine: &'a Machine,
    pub rig: Option<&'a RigFile>,
    /// What the rig file names on this computer.
    pub inputs: &'a [Input],
    pub survey: &'a Survey,
    pub sessions: &'a Path,
    /// The file of the bench's lease.
    pub lease: Option<&'a Path>,
}
