//! Injected faults: `KIND@WHEN` in `faults:` of a protocol and in `--fault`, for rehearsals on the simulated rig.

use std::fmt;
use std::str::FromStr;

use serde::Serialize;
use skinrig_model::{CameraId, HostDuration};

use skinrig_settings::{Collector, closest};
use skinrig_settings::{Dimension, quantity};
use skinrig_settings::{Field, Shape, Value};

/// An injected fault of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PlantedFault {
    /// Kind of the fault.
    pub kind: FaultKind,
    /// Time of the fault.
    pub when: FaultTime,
}

/// Kind of an injected fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaultKind {
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
    /// The recorder delays the run briefly.
    RecorderSlow,
    /// The disk is full.
    DiskFull,
    /// The process is killed, as by `kill -9`.
    Killed,
}

/// Names of all kinds.
const KINDS: [(&str, FaultKind); 27] = {
    use CameraId::{One, Two};
    use FaultKind as K;
    [
        ("camera1-unplugged", K::CameraUnplugged(One)),
        ("camera2-unplugged", K::CameraUnplugged(Two)),
        ("camera1-stalled", K::CameraStalled(One)),
        ("camera2-stalled", K::CameraStalled(Two)),
        ("camera1-drops", K::CameraDrops(One)),
        ("camera2-drops", K::CameraDrops(Two)),
        ("camera1-storm", K::CameraStorm(One)),
        ("camera2-storm", K::CameraStorm(Two)),
        ("camera1-clock-step", K::CameraClockStep(One)),
        ("camera2-clock-step", K::CameraClockStep(Two)),
        ("camera1-hot", K::CameraHot(One)),
        ("camera2-hot", K::CameraHot(Two)),
        ("trigger-lost", K::TriggerLost),
        ("trigger-doubled", K::TriggerDoubled),
        ("trigger-delayed", K::TriggerDelayed),
        ("box-silent", K::BoxSilent),
        ("box-noisy", K::BoxNoisy),
        ("robot-lost", K::RobotLost),
        ("robot-stalled", K::RobotStalled),
        ("robot-slow", K::RobotSlow),
        ("robot-z-high", K::RobotZHigh),
        ("robot-z-low", K::RobotZLow),
        ("robot-force-spike", K::RobotForceSpike),
        ("robot-stale", K::RobotStale),
        ("recorder-slow", K::RecorderSlow),
        ("disk-full", K::DiskFull),
        ("killed", K::Killed),
    ]
};

impl FaultKind {
    /// The name in a protocol.
    #[must_use]
    pub fn name(self) -> &'static str {
        KINDS
            .iter()
            .find(|(_, kind)| *kind == self)
            .map_or("", |(name, _)| name)
    }

    /// True for a fault of the records rather than of a device.
    #[must_use]
    pub const fn is_of_records(self) -> bool {
        matches!(self, Self::DiskFull | Self::Killed)
    }
}

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
    fn misfit(self, kind: FaultKind) -> Option<&'static str> {
        use FaultPhase as P;
        let fits = match self {
            Self::Preflight | Self::Arming | Self::Time(_) => !kind.is_of_records(),
            Self::Seal => kind == FaultKind::Killed,
            Self::Nth(P::Press, _) => true,
            Self::Nth(P::Record | P::Journal, _) => kind.is_of_records(),
            Self::Nth(..) => !kind.is_of_records(),
        };
        match kind {
            _ if fits => None,
            FaultKind::Killed => Some("`record:N`, `journal:N`, `press:N` or `seal`"),
            FaultKind::DiskFull => Some("`record:N`, `journal:N` or `press:N`"),
            _ => Some(OF_DEVICES),
        }
    }
}

const OF_DEVICES: &str = "`preflight`, `arming`, `time:SECONDS`, or `travel:N`, `press:N`, `contact:N`, `hold:N`, `retract:N`, `between:N`";

/// Reason why a text is not a fault.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NoFault {
    expected: String,
    found: String,
    help: Option<String>,
}

impl fmt::Display for NoFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "expected {}, found `{}`", self.expected, self.found)?;
        match &self.help {
            Some(help) => write!(f, "; {help}"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for NoFault {}

impl FromStr for PlantedFault {
    type Err = NoFault;

    fn from_str(text: &str) -> Result<Self, NoFault> {
        let (name, time) = text.trim().split_once('@').unwrap_or((text.trim(), ""));
        let Some((_, kind)) = KINDS.iter().find(|(known, _)| *known == name) else {
            let names = KINDS.map(|(name, _)| name);
            let help = closest(name, names).map(|near| format!("did you mean `{near}`?"));
            return Err(NoFault {
                expected: format!("KIND@WHEN with a kind out of {}", names.join(", ")),
                found: text.to_owned(),
                help,
            });
        };
        let kind = *kind;
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
            (_, misfit) => Err(NoFault {
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
            Err(NoFault {
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
        for (name, kind) in KINDS {
            assert_eq!(kind.name(), name);
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
        for (text, told) in [
            ("", "a kind out of camera1-unplugged"),
            ("camera1-stall@hold:1", "did you mean `camera1-stalled`?"),
            ("camera3-stalled@hold:1", "did you mean"),
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
                refused.as_ref().is_err_and(|e| e.contains(told)),
                "{text}: {refused:?}"
            );
        }
    }
}
