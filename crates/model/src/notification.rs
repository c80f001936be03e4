//! Notifications: their occasions, and the record of each message.

use std::fmt;

use serde::{Deserialize, Serialize};
use skinrig_settings::Choice;

use crate::fault::NotificationFault;
use crate::run_end::RunEnd;
use crate::{RunFault, WatchdogTrip};

/// An occasion for a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, Choice)]
#[serde(rename_all = "snake_case")]
pub enum Occasion {
    /// A fault of the rig, the recorder or the computer ended a run.
    Fault,
    /// The operator or a limit ended a run.
    Stop,
    /// A run completed its plan.
    Completed,
    /// A night is PASS.
    NightPass,
    /// A night is MARGINAL.
    NightMarginal,
    /// A night is INCONCLUSIVE.
    NightInconclusive,
    /// A night is FAIL.
    NightFail,
    /// A night is INVALID.
    NightInvalid,
    /// Every check of a night was skipped.
    NightSkipped,
    /// A night raised trend alarms.
    TrendAlarm,
}

impl Occasion {
    /// All occasions.
    pub const ALL: &[Self] = <Self as Choice>::ALL;

    /// The name used in files: `fault`.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.word()
    }

    /// The occasion of the end of a run. The first cause decides.
    #[must_use]
    pub fn of_end(end: &RunEnd) -> Self {
        match end {
            end if end.is_complete() => Self::Completed,
            RunEnd::Completed => Self::Completed,
            RunEnd::Stopped(_) => Self::Stop,
            RunEnd::Faulted(causes) => match causes.as_slice().first() {
                Some(
                    RunFault::InvalidInARow { .. }
                    | RunFault::Watchdog(
                        WatchdogTrip::Force { .. }
                        | WatchdogTrip::Depth { .. }
                        | WatchdogTrip::Speed { .. },
                    )
                    | RunFault::Suspended { .. }
                    | RunFault::Stopped(_)
                    | RunFault::Halted,
                ) => Self::Stop,
                _ => Self::Fault,
            },
        }
    }

    /// Whether nights, not runs, have this occasion.
    #[must_use]
    pub const fn is_of_a_night(self) -> bool {
        !matches!(self, Self::Fault | Self::Stop | Self::Completed)
    }
}

/// A way to send messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NotificationChannel {
    /// Mail by SMTP.
    Mail,
    /// HTTP POST of JSON.
    Webhook,
    /// A program with the JSON on its standard input.
    Command,
}

impl NotificationChannel {
    /// All channels.
    pub const ALL: [Self; 3] = [Self::Mail, Self::Webhook, Self::Command];

    /// The name used in sessions: `mail`, `webhook` or `command`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mail => "mail",
            Self::Webhook => "webhook",
            Self::Command => "command",
        }
    }
}

impl fmt::Display for NotificationChannel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A message, and whether it was sent. Contains no secrets.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Notification {
    /// Where it was sent.
    pub channel: NotificationChannel,
    /// Its occasion.
    pub occasion: Occasion,
    /// Its subject line.
    pub subject: String,
    /// Civil time of the occasion, RFC 3339.
    pub raised_at: String,
    /// Civil time of the result, RFC 3339.
    pub ended_at: String,
    /// Number of tries that ended.
    pub tries: u32,
    /// Why it was not sent, or has no result; `None`: the receiver accepted it.
    pub fault: Option<NotificationFault>,
}

impl fmt::Display for Notification {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (channel, occasion) = (self.channel, self.occasion.name());
        match &self.fault {
            None => write!(f, "{channel}: {occasion}: sent"),
            Some(fault) => {
                let result = match fault {
                    NotificationFault::GraceOver { .. } => "unknown whether it was sent",
                    _ => "not sent",
                };
                let tries = if self.tries == 1 { "try" } else { "tries" };
                let number = self.tries;
                write!(
                    f,
                    "{channel}: {occasion}: {result} ({number} {tries}): {fault}"
                )
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{HostDuration, HostTime, SinkFault, StopReason};

    #[test]
    fn the_first_cause_of_an_end_decides_the_occasion() {
        let disk = || RunFault::Sink(SinkFault::Rejected("disk full".into()));
        let limit = || {
            RunFault::Watchdog(WatchdogTrip::Depth {
                limit_mm: 3.0,
                found_mm: 3.2,
                t: HostTime::ZERO,
            })
        };
        let stale = RunFault::Watchdog(WatchdogTrip::Stale {
            limit: HostDuration::from_millis(100),
            found: HostDuration::from_millis(200),
        });
        for (end, occasion) in [
            (RunEnd::Completed, Occasion::Completed),
            (RunEnd::Stopped(StopReason::Abort), Occasion::Stop),
            (RunEnd::fault(disk()), Occasion::Fault),
            (RunEnd::fault(limit()), Occasion::Stop),
            (RunEnd::fault(stale), Occasion::Fault),
            (RunEnd::fault(disk()).and_fault(limit()), Occasion::Fault),
            (RunEnd::fault(limit()).and_fault(disk()), Occasion::Stop),
            (
                RunEnd::Stopped(StopReason::Stop).and_fault(disk()),
                Occasion::Stop,
            ),
        ] {
            assert_eq!(Occasion::of_end(&end), occasion, "{end:?}");
        }
    }
}
