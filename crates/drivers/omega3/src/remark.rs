//! What the operator should know of a robot that was opened.

use std::fmt;

use skinrig_drd_abi::ForceOffCause;

use crate::open::cause_words;

/// Something that the operator should know of a robot that was opened, or of its library.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Remark {
    /// The library reports another type, which the rig file accepts.
    OtherType(i32),
    /// The SDK has no call that checks the controller's memory.
    MemoryNotChecked,
    /// The motors were live when the robot was opened; it was braked.
    MotorsWereLive,
    /// The motors went off before, for this reason.
    MotorsWentOff(ForceOffCause),
    /// Status word 13 is 0: there are no redundant encoders, or their check failed.
    NoRedundantEncoders,
    /// The device has no watchdog; a supervisor process is configured.
    NoWatchdog,
    /// The velocity threshold is 0.
    NoVelocityTrip,
    /// The arm moved to initialise itself.
    InitialisedItself,
    /// The library is older than advised; the text names both versions.
    Library(String),
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OtherType(number) => write!(f, "type {number} is taken for an omega.3"),
            Self::MemoryNotChecked => f.write_str("this SDK cannot check the controller's memory"),
            Self::MotorsWereLive => {
                f.write_str("the motors were live when the robot was opened; it was braked")
            }
            Self::MotorsWentOff(cause) => {
                write!(f, "motors last went off because of {}", cause_words(*cause))
            }
            Self::NoRedundantEncoders => f.write_str(
                "status word 13 is 0: no redundant encoders, or their check failed; if this robot reported 1 before, have it \
                 serviced and write `redundant_encoders: required` in the rig file",
            ),
            Self::NoWatchdog => f.write_str(
                "no watchdog in this device: only the supervisor brakes the arm if this program dies",
            ),
            Self::NoVelocityTrip => {
                f.write_str("the device's velocity trip is off (threshold 0)")
            }
            Self::InitialisedItself => f.write_str("the robot initialised itself"),
            Self::Library(advice) => f.write_str(advice),
        }
    }
}
