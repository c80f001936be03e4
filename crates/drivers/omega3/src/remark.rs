//! Remarks for the operator about an open robot.

use std::fmt;

use skinrig_drd_abi::ForceOffCause;

/// A remark about a robot or its library, for the operator and the session record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Remark {
    /// The robot reports another type, which the rig file accepts.
    OtherType(i32),
    /// The SDK cannot check the controller's memory.
    MemoryNotChecked,
    /// The motors were live when the robot was opened; the driver braked it.
    MotorsWereLive,
    /// Reason of the last power-off of the motors.
    MotorsWentOff(ForceOffCause),
    /// Status word 13 is 0: no redundant encoders, or their check failed.
    NoRedundantEncoders,
    /// The device has no watchdog; a supervisor process substitutes for it.
    NoWatchdog,
    /// The velocity threshold is 0, which disables the velocity trip.
    NoVelocityTrip,
    /// The robot initialised itself and moved its arm.
    InitialisedItself,
    /// The library is older than recommended; the text names both versions.
    Library(String),
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OtherType(number) => write!(f, "type {number} is accepted as an omega.3"),
            Self::MemoryNotChecked => f.write_str("this SDK cannot check the controller's memory"),
            Self::MotorsWereLive => {
                f.write_str("the motors were live when the robot was opened; it was braked")
            }
            Self::MotorsWentOff(cause) => {
                write!(f, "motors last went off because of {}", describe_cause(*cause))
            }
            Self::NoRedundantEncoders => f.write_str(
                "status word 13 is 0: no redundant encoders, or their check failed; if this robot reported 1 before, contact Force \
                Dimension support and set `redundant_encoders: required` in the rig file",
            ),
            Self::NoWatchdog => f.write_str(
                "this device has no watchdog: only the supervisor brakes the arm if this program dies",
            ),
            Self::NoVelocityTrip => {
                f.write_str("the device's velocity trip is off (threshold 0)")
            }
            Self::InitialisedItself => f.write_str("the robot initialised itself"),
            Self::Library(advice) => f.write_str(advice),
        }
    }
}

/// Describes why the motors went off.
pub(crate) fn describe_cause(cause: ForceOffCause) -> String {
    match cause {
        ForceOffCause::None => "no reported cause".to_owned(),
        ForceOffCause::Button => "the force button on the base".to_owned(),
        ForceOffCause::Velocity => "the velocity trip: an axis was too fast".to_owned(),
        ForceOffCause::Watchdog => "the watchdog: no command arrived in time".to_owned(),
        ForceOffCause::Software => "a program's command".to_owned(),
        ForceOffCause::UsbDisconnect => "a USB disconnect".to_owned(),
        ForceOffCause::Deadman => "the dead man's switch".to_owned(),
        ForceOffCause::Unknown(code) => format!("an unknown cause (code {code})"),
    }
}
