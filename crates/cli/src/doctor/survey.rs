//! Queries the drivers: devices, and the robot's library.

use skinrig_omega3::load::{self, LoadError};
use skinrig_protocol::rig::RigFile;

use crate::devices::{self, DeviceState, Line};

/// Result of the query.
pub(super) struct Survey {
    /// Devices, as `skinrig devices` lists them.
    pub lines: Vec<Line>,
    /// The robot's library.
    pub library: Library,
    /// True if the bench is in use: no device was queried.
    pub left_alone: bool,
}

/// Why the devices of a bench in use were not queried.
pub(super) const LEFT_ALONE: &str = "the bench is in use, so its devices were not queried";

/// The robot's library.
pub(super) enum Library {
    /// Loaded.
    Loaded {
        /// Its version.
        version: String,
        /// What the operator should know about that version.
        advice: Option<String>,
    },
    /// Not found in this many places.
    Absent(usize),
    /// Found but unusable, for this reason.
    Unusable(String),
}

impl Survey {
    /// Queries all devices and the library.
    pub(super) fn query(rig: Option<&RigFile>) -> Self {
        Self {
            lines: devices::survey(rig),
            left_alone: false,
            ..Self::of_a_held_bench(rig)
        }
    }

    /// Queries the library only.
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

    /// The device with this role in the rig file.
    pub(super) fn role(&self, role: &str) -> Option<&Line> {
        self.lines.iter().find(|l| l.role.as_deref() == Some(role))
    }

    /// Cameras on the bus, usable or not.
    pub(super) fn cameras(&self) -> impl Iterator<Item = &Line> {
        let is_attached = |l: &&Line| l.device == "camera" && l.usb.is_some();
        self.lines
            .iter()
            .filter(is_attached)
            .filter(|l| l.state != DeviceState::OtherDevice)
    }
}

/// Name of a device in findings: its role, else its kind and serial number or place.
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
