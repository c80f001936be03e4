//! What the drivers say when they are asked: devices, and the robot's library.

use skinrig_omega3::load::{self, LoadError};
use skinrig_protocol::rig::RigFile;

use crate::devices::{self, Line};

/// What was found by asking.
pub(super) struct Survey {
    /// As `skinrig devices` lists it.
    pub lines: Vec<Line>,
    /// The robot's library.
    pub library: Library,
    /// Somebody else holds the bench: no device was asked.
    pub left_alone: bool,
}

/// Why a device of a held bench was not asked.
pub(super) const LEFT_ALONE: &str = "somebody holds the bench: its devices were left alone";

/// The robot's library.
pub(super) enum Library {
    /// Loaded.
    Loaded {
        /// Its version.
        version: String,
        /// What the operator should know about that version.
        advice: Option<String>,
    },
    /// There is none in this many places.
    Absent(usize),
    /// There is one, and it cannot be used.
    Unusable(String),
}

impl Survey {
    /// Asks everything that is there.
    pub(super) fn make(rig: Option<&RigFile>) -> Self {
        Self {
            lines: devices::survey(rig),
            left_alone: false,
            ..Self::of_a_held_bench(rig)
        }
    }

    /// Looks for the library alone.
    pub(crate) fn of_a_held_bench(rig: Option<&RigFile>) -> Self {
        let library = match load::load(rig.and_then(|r| r.robot.library.as_deref())) {
            Ok(loaded) => Library::Loaded {
                version: loaded.version.to_string(),
                advice: loaded.advice,
            },
            Err(LoadError::Absent(tried)) => Library::Absent(tried.len()),
            Err(other) => Library::Unusable(other.to_string()),
        };
        Self {
            lines: Vec::new(),
            library,
            left_alone: true,
        }
    }

    /// What plays this role of the rig file.
    pub(super) fn role(&self, role: &str) -> Option<&Line> {
        self.lines.iter().find(|l| l.role.as_deref() == Some(role))
    }

    /// Cameras that are on the bus, whatever keeps them from being used.
    pub(super) fn cameras(&self) -> impl Iterator<Item = &Line> {
        let seen = |l: &&Line| l.device == "camera" && l.usb.is_some();
        self.lines
            .iter()
            .filter(seen)
            .filter(|l| l.state != "other device")
    }
}

/// What a line is called in findings: its role, else what and where it is.
pub(super) fn name_of(line: &Line) -> String {
    match (&line.role, &line.serial) {
        (Some(role), _) => role.clone(),
        (None, Some(serial)) => format!("{} {serial}", line.device),
        (None, None) => match line.usb {
            Some((bus, device)) => format!("{} at bus {bus} device {device}", line.device),
            None => line.device.to_owned(),
        },
    }
}
