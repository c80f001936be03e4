//! Faults of a rig in physical terms: one vocabulary for protocols, the simulated rig and the emulated bench.
//!
//! Each of them supports a subset and refuses the rest with [`UnsupportedFault`]. Sizes, such as the number of lost
//! words, belong to whoever injects the fault.

use std::fmt;
use std::str::FromStr;

use crate::id::CameraId;
use crate::text::UnknownName;

/// A fault of a device, of its connections or of the computer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RigFault {
    /// A camera stops answering.
    CameraUnplugged(CameraId),
    /// A camera stops sending without an error.
    CameraStalled(CameraId),
    /// A camera loses some bytes, and counts them.
    CameraDrops(CameraId),
    /// Hot pixels of a camera send a storm of events.
    CameraStorm(CameraId),
    /// The clock of a camera jumps forward.
    CameraClockStep(CameraId),
    /// A camera overheats, then cools down.
    CameraHot(CameraId),
    /// A camera ignores the value written to one of its settings.
    CameraSettingIgnored(CameraId),
    /// The trigger line of a camera is cut: no edge arrives.
    LineCut(CameraId),
    /// The trigger line of a camera loses edges or adds some.
    LineNoisy(CameraId),
    /// The next mark reaches no camera.
    TriggerLost,
    /// The next mark reaches the cameras twice.
    TriggerDoubled,
    /// The next mark reaches the cameras late.
    TriggerDelayed,
    /// The trigger box stops answering.
    BoxSilent,
    /// Noise on the trigger lines and in the box's reports.
    BoxNoisy,
    /// The robot stops answering; its brakes are on.
    RobotLost,
    /// The robot loses power and its calibration.
    RobotPowerLost,
    /// The robot ignores all commands.
    RobotStalled,
    /// The robot follows its set point too slowly.
    RobotSlow,
    /// The robot reports its tip higher than it is: presses are deeper than planned.
    RobotZHigh,
    /// The robot reports its tip lower than it is: presses are shallower than planned.
    RobotZLow,
    /// The robot briefly reports a force beyond every limit.
    RobotForceSpike,
    /// The pose stream stops without an error.
    RobotStale,
    /// The robot ignores the value written to one of its settings.
    RobotSettingIgnored,
    /// The recorder delays the run briefly.
    RecorderSlow,
    /// The disk is full.
    DiskFull,
    /// The process is killed, as by `kill -9`.
    Killed,
}

impl RigFault {
    /// All faults with their names.
    pub const NAMES: [(&'static str, Self); 35] = {
        use CameraId::{One, Two};
        [
            ("camera1-unplugged", Self::CameraUnplugged(One)),
            ("camera2-unplugged", Self::CameraUnplugged(Two)),
            ("camera1-stalled", Self::CameraStalled(One)),
            ("camera2-stalled", Self::CameraStalled(Two)),
            ("camera1-drops", Self::CameraDrops(One)),
            ("camera2-drops", Self::CameraDrops(Two)),
            ("camera1-storm", Self::CameraStorm(One)),
            ("camera2-storm", Self::CameraStorm(Two)),
            ("camera1-clock-step", Self::CameraClockStep(One)),
            ("camera2-clock-step", Self::CameraClockStep(Two)),
            ("camera1-hot", Self::CameraHot(One)),
            ("camera2-hot", Self::CameraHot(Two)),
            ("camera1-setting-ignored", Self::CameraSettingIgnored(One)),
            ("camera2-setting-ignored", Self::CameraSettingIgnored(Two)),
            ("line1-cut", Self::LineCut(One)),
            ("line2-cut", Self::LineCut(Two)),
            ("line1-noisy", Self::LineNoisy(One)),
            ("line2-noisy", Self::LineNoisy(Two)),
            ("trigger-lost", Self::TriggerLost),
            ("trigger-doubled", Self::TriggerDoubled),
            ("trigger-delayed", Self::TriggerDelayed),
            ("box-silent", Self::BoxSilent),
            ("box-noisy", Self::BoxNoisy),
            ("robot-lost", Self::RobotLost),
            ("robot-power-lost", Self::RobotPowerLost),
            ("robot-stalled", Self::RobotStalled),
            ("robot-slow", Self::RobotSlow),
            ("robot-z-high", Self::RobotZHigh),
            ("robot-z-low", Self::RobotZLow),
            ("robot-force-spike", Self::RobotForceSpike),
            ("robot-stale", Self::RobotStale),
            ("robot-setting-ignored", Self::RobotSettingIgnored),
            ("recorder-slow", Self::RecorderSlow),
            ("disk-full", Self::DiskFull),
            ("killed", Self::Killed),
        ]
    };

    /// The name in protocols and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::NAMES
            .iter()
            .find(|(_, fault)| *fault == self)
            .map_or("", |(name, _)| name)
    }

    /// True for a fault of the records rather than of a device.
    #[must_use]
    pub const fn is_of_records(self) -> bool {
        matches!(self, Self::DiskFull | Self::Killed)
    }

    /// The affected camera, if the fault is that of one camera or its trigger line.
    #[must_use]
    pub const fn camera(self) -> Option<CameraId> {
        match self {
            Self::CameraUnplugged(camera)
            | Self::CameraStalled(camera)
            | Self::CameraDrops(camera)
            | Self::CameraStorm(camera)
            | Self::CameraClockStep(camera)
            | Self::CameraHot(camera)
            | Self::CameraSettingIgnored(camera)
            | Self::LineCut(camera)
            | Self::LineNoisy(camera) => Some(camera),
            _ => None,
        }
    }
}

impl fmt::Display for RigFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for RigFault {
    type Err = UnknownName;

    fn from_str(text: &str) -> Result<Self, UnknownName> {
        let found = Self::NAMES.iter().find(|(name, _)| *name == text);
        found.map(|(_, fault)| *fault).ok_or_else(|| UnknownName {
            expected: "a fault of a rig",
            found: text.to_owned(),
        })
    }
}

/// A fault that this rig cannot inject.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UnsupportedFault {
    /// The fault.
    pub fault: RigFault,
    /// The rig, with its article: `the simulated rig`.
    pub rig: &'static str,
}

impl fmt::Display for UnsupportedFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { fault, rig } = self;
        write!(f, "expected a fault that {rig} injects, found `{fault}`")
    }
}

impl std::error::Error for UnsupportedFault {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_read_back_and_name_the_camera() {
        for (name, fault) in RigFault::NAMES {
            assert_eq!(fault.name(), name);
            assert_eq!(name.parse(), Ok(fault));
            let number = fault.camera().map(|camera| camera.number().to_string());
            let named = name.find(|c: char| c.is_ascii_digit());
            assert_eq!(number.as_deref(), named.map(|at| &name[at..=at]), "{name}");
        }
        assert!("camera3-stalled".parse::<RigFault>().is_err());
    }
}
