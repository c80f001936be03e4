//! Injected faults: `KIND@WHEN` in `faults:` of a protocol and in `--fault`, for rehearsals on the simulated rig.

use std::fmt;
use std::str::FromStr;

use serde::Serialize;
use skinrig_model::{CameraId, HostDuration, RigFault};

use skinrig_settings::{Collector, closest};
use skinrig_settings::{Dimension, quantity};
use skinrig_settings::{Field, Shape, Value};

/// An injected fault of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PlantedFault {
    /// Kind of the fault.
    pub kind: RigFault,
    /// Time of the fault.
    pub when: FaultTime,
}

/// Faults of a protocol; the simulated rig and the recorder inject them.
const FAULTS: [RigFault; 27] = {
    use CameraId::{One, Two};
    use RigFault as F;
    [
        F::CameraUnplugged(One),
        F::CameraUnplugged(Two),
        F::CameraStalled(One),
        F::CameraStalled(Two),
        F::CameraDrops(One),
        F::CameraDrops(Two),
        F::CameraStorm(One),
        F::CameraStorm(Two),
        F::CameraClockStep(One),
        F::CameraClockStep(Two),
        F::CameraHot(One),
        F::CameraHot(Two),
        F::TriggerLost,
        F::TriggerDoubled,
        F::TriggerDelayed,
        F::BoxSilent,
        F::BoxNoisy,
        F::RobotLost,
        F::RobotStalled,
        F::RobotSlow,
        F::RobotZHigh,
        F::RobotZLow,
        F::RobotForceSpike,
        F::RobotStale,
        F::RecorderSlow,
        F::DiskFull,
        F::Killed,
    ]
};

/// Time of a fault. Numbers count from 1, through the whole run: sync presses, surface searches and failed attempts
/// count too.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaultTime {
    /// From the start.
    Preflight,
    /// When the robot is powered.
    Arming,
    /// At this time after the start.
    Time(HostDuration),
    /// At the n-th occurrence of a phase.
    Nth(FaultPhase, u32),
    /// Before the session is sealed.
    Seal,
}

/// A phase that recurs in a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaultPhase {
    /// The tip moves sideways above the skin.
    Travel,
    /// The tip moves down; for faults of records: a press is about to start.
    Press,
    /// The tip touches the skin.
    Contact,
    /// The tip rests in the skin.
    Hold,
    /// The tip moves up out of the skin.
    Retract,
    /// The tip rests above the skin again.
    Between,
    /// A record is about to be taken.
    Record,
    /// A record of the journal is about to be taken: not one of streams or motions.
    Journal,
}

const PHASES: [(&str, FaultPhase); 9] = [
    ("press", FaultPhase::Press),
    ("approach", FaultPhase::Press),
    ("travel", FaultPhase::Travel),
    ("contact", FaultPhase::Contact),
    ("hold", FaultPhase::Hold),
    ("retract", FaultPhase::Retract),
    ("between", FaultPhase::Between),
    ("record", FaultPhase::Record),
    ("journal", FaultPhase::Journal),
];

impl FaultTime {
    /// The valid times of `kind` if this one is invalid.
    fn misfit(self, kind: RigFault) -> Option<&'static str> {
        use FaultPhase as P;
        let fits = match self {
            Self::Preflight | Self::Arming | Self::Time(_) => !kind.is_of_records(),
            Self::Seal => kind == RigFault::Killed,
            Self::Nth(P::Press, _) => true,
            Self::Nth(P::Record | P::Journal, _) => kind.is_of_records(),
            Self::Nth(..) => !kind.is_of_records(),
        };
        match kind {
            _ if fits => None,
            RigFault::Killed => Some("`record:N`, `journal:N`, `press:N` or `seal`"),
            RigFault::DiskFull => Some("`record:N`, `journal:N` or `press:N`"),
            _ => Some(OF_DEVICES),
        }
    }
}

const OF_DEVICES: &str = "`preflight`, `arming`, `time:SECONDS`, or `travel:N`, `press:N`, `contact:N`, `hold:N`, `retract:N`, `between:N`";

/// Reason why a text is not a fault.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InvalidFault {
    expected: String,
    found: String,
    help: Option<String>,
}

impl fmt::Display for InvalidFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "expected {}, found `{}`", self.expected, self.found)?;
        match &self.help {
            Some(help) => write!(f, "; {help}"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for InvalidFault {}

impl FromStr for PlantedFault {
    type Err = InvalidFault;

    fn from_str(text: &str) -> Result<Self, InvalidFault> {
        let (name, time) = text.trim().split_once('@').unwrap_or((text.trim(), ""));
        let Some(kind) = FAULTS.into_iter().find(|fault| fault.name() == name) else {
            let names = FAULTS.map(RigFault::name);
            let help = closest(name, names).map(|near| format!("did you mean `{near}`?"));
            return Err(InvalidFault {
                expected: format!("KIND@WHEN with a kind out of {}", names.join(", ")),
                found: text.to_owned(),
                help,
            });
        };
        let when = match time.split_once(':') {
            None => match time {
                "preflight" => Some(FaultTime::Preflight),
                "arming" => Some(FaultTime::Arming),
                "seal" => Some(FaultTime::Seal),
                _ => None,
            },
            Some(("time", span)) => quantity::parse(span, &[Dimension::Time])
                .ok()
                .filter(|q| (0.0..=86_400.0).contains(&q.value))
                .map(|q| FaultTime::Time(HostDuration::from_secs_f64(q.value))),
            Some((phase, number)) => {
                let phase = PHASES.iter().find(|(known, _)| *known == phase);
                let number = number.parse().ok().filter(|n| *n > 0);
                phase
                    .zip(number)
                    .map(|((_, phase), n)| FaultTime::Nth(*phase, n))
            }
        };
        let misfit = match when {
            Some(when) => when.misfit(kind),
            // Only one kind can occur at sealing; list its times.
            None => FaultTime::Seal
                .misfit(kind)
                .or(Some("`record:N`, `journal:N`, `press:N` or `seal`")),
        };
        match (when, misfit) {
            (Some(when), None) => Ok(Self { kind, when }),
            (_, misfit) => Err(InvalidFault {
                expected: format!(
                    "{name}@WHEN with WHEN one of {}",
                    misfit.unwrap_or(OF_DEVICES)
                ),
                found: text.to_owned(),
                help: Some("N counts from 1".to_owned()),
            }),
        }
    }
}

impl Serialize for PlantedFault {
    fn serialize<S: serde::Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.collect_str(self)
    }
}

impl fmt::Display for PlantedFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}@", self.kind.name())?;
        match self.when {
            FaultTime::Preflight => f.write_str("preflight"),
            FaultTime::Arming => f.write_str("arming"),
            FaultTime::Seal => f.write_str("seal"),
            FaultTime::Time(t) => write!(f, "time:{}s", t.as_secs_f64()),
            FaultTime::Nth(phase, n) => {
                let name = PHASES.iter().find(|(_, p)| *p == phase);
                write!(f, "{}:{n}", name.map_or("", |(name, _)| name))
            }
        }
    }
}

/// The shape of an item of `faults`.
pub(crate) const SHAPE: Shape = Shape::List {
    of: &Shape::Text,
    min: 1,
    max: 100,
};

/// Reads the items of `faults`.
pub(crate) fn faults(f: &Field, out: &mut Collector) -> Option<Vec<PlantedFault>> {
    let read = f.items().iter().map(|item| {
        let Value::Text(text) = &item.value else {
            return None;
        };
        match text.parse() {
            Ok(fault) => Some(fault),
            Err(InvalidFault {
                expected,
                found,
                help,
            }) => {
                let error = out
                    .error(item.span, item.path.clone(), "not a valid fault")
                    .expected(expected)
                    .found(found);
                if let Some(help) = help {
                    error.help(help);
                }
                None
            }
        }
    });
    // Read all items, so that all findings appear at once.
    read.collect::<Vec<_>>().into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_reads_back_as_it_is_shown() {
        for kind in FAULTS {
            let name = kind.name();
            let when = if kind.is_of_records() {
                "journal:3"
            } else {
                "hold:3"
            };
            let text = format!("{name}@{when}");
            assert_eq!(
                text.parse::<PlantedFault>().map(|f| f.to_string()),
                Ok(text)
            );
        }
        for text in [
            "robot-slow@preflight",
            "box-noisy@arming",
            "robot-stale@time:3.2s",
            "killed@seal",
        ] {
            let fault: Result<PlantedFault, _> = text.parse();
            assert_eq!(fault.map(|f| f.to_string()).as_deref(), Ok(text));
        }
        let approach: Result<PlantedFault, _> = "robot-slow@approach:2".parse();
        assert_eq!(approach, "robot-slow@press:2".parse());
    }

    #[test]
    fn invalid_faults_list_the_valid_ones() {
        for (text, message) in [
            ("", "a kind out of camera1-unplugged"),
            ("camera1-stall@hold:1", "did you mean `camera1-stalled`?"),
            ("camera3-stalled@hold:1", "did you mean"),
            ("robot-power-lost@hold:1", "a kind out of"),
            ("robot-slow", "`preflight`"),
            ("robot-slow@seal", "`preflight`"),
            ("robot-slow@record:1", "`preflight`"),
            ("robot-slow@hold:0", "N counts from 1"),
            ("robot-slow@hold:-1", "N counts from 1"),
            ("robot-slow@time:3", "`time:SECONDS`"),
            ("robot-slow@time:-3s", "`time:SECONDS`"),
            (
                "killed@hold:1",
                "`record:N`, `journal:N`, `press:N` or `seal`",
            ),
            ("disk-full@seal", "`record:N`, `journal:N` or `press:N`"),
            ("disk-full@arming", "`record:N`, `journal:N` or `press:N`"),
        ] {
            let refused = text.parse::<PlantedFault>().map_err(|e| e.to_string());
            assert!(
                refused.as_ref().is_err_and(|e| e.contains(message)),
                "{text}: {refused:?}"
            );
        }
    }
}
