//! Fault injection: faults of a simulated rig, their times and their sizes.

use std::fmt;

use skinrig_model::{CameraId, HostTime, RigFault, UnsupportedFault};

/// When a fault occurs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaultTrigger {
    /// At this time.
    At(HostTime),
    /// At the n-th contact, counted from 0.
    Contact(u32),
    /// At the n-th occurrence of this motion phase, counted from 0.
    Moment(MotionPhase, u32),
}

/// A motion phase of the simulated robot. Every descent counts, including those that search for the surface and those of failed
/// attempts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MotionPhase {
    /// The motors are switched on.
    Arming,
    /// A sideways motion above the skin starts.
    Travel,
    /// A descent to the skin starts.
    Approach,
    /// The set point stops in the skin.
    Hold,
    /// An ascent from the skin starts.
    Retract,
    /// The set point stops above the skin after an ascent.
    Between,
}

impl fmt::Display for FaultTrigger {
    /// As in `--fault`, with numbers from 1: `hold:5`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::At(HostTime::ZERO) => write!(f, "preflight"),
            Self::At(t) => write!(f, "time:{} s", t.as_secs_f64()),
            Self::Contact(n) => write!(f, "contact:{}", u64::from(*n) + 1),
            Self::Moment(MotionPhase::Arming, 0) => write!(f, "arming"),
            Self::Moment(phase, n) => write!(f, "{}:{}", phase.name(), u64::from(*n) + 1),
        }
    }
}

impl MotionPhase {
    const fn name(self) -> &'static str {
        match self {
            Self::Arming => "arming",
            Self::Travel => "travel",
            Self::Approach => "press",
            Self::Hold => "hold",
            Self::Retract => "retract",
            Self::Between => "between",
        }
    }
}

impl fmt::Display for Fault {
    /// As in `--fault`: `camera1-drops@hold:5`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Timed(TimedFault { kind, when }) => write!(f, "{}@{when}", kind.name()),
            Self::PulseLost {
                camera,
                train,
                pulse,
            } => {
                write!(f, "pulse {pulse} of mark {train} lost by {camera}")
            }
            Self::DeadPress { camera, contact } => {
                write!(f, "contact {contact} without events in {camera}")
            }
        }
    }
}

/// A fault of a simulated rig.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// A fault of the shared vocabulary.
    Timed(TimedFault),
    /// A pulse of a mark does not reach a camera. Seen as lost edges; a lost start pulse as stray edges and a missing mark.
    PulseLost {
        /// The camera.
        camera: CameraId,
        /// Index of the mark, from 0.
        train: u32,
        /// Index of the pulse, from 0.
        pulse: u32,
    },
    /// The n-th contact, counted from 0, produces no events in a camera (geometric level).
    DeadPress {
        /// The camera.
        camera: CameraId,
        /// Index of the contact.
        contact: u32,
    },
}

impl Fault {
    /// A fault of the shared vocabulary at this time. Effects, with the sizes of [`FaultSizes`]:
    ///
    /// | fault | effect |
    /// |---|---|
    /// | `CameraUnplugged` | data already sent is still delivered, then [`Lost`](skinrig_device::DeviceError::Lost) |
    /// | `CameraDrops` | the next words are lost; `lost_before` of the next chunk counts them |
    /// | `CameraStorm` | [`STORM_PIXELS`] pixels send [`STORM_PER_MS`] events per ms each, for `STORM_NS` |
    /// | `CameraHot` | heats up by `HOT_C` within `HOT_RISE_NS`, stays hot for `HOT_NS`, cools down as fast |
    /// | `CameraSettingIgnored`, `RobotSettingIgnored` | [`ReadBack`](skinrig_device::DeviceError::ReadBack) of a bias or limit |
    /// | `LineNoisy` | the trigger input loses, doubles and invents edges |
    /// | `LineCut` | the trigger input loses all edges |
    /// | `TriggerLost`, `TriggerDoubled`, `TriggerDelayed` | the box reports the next mark as sent |
    /// | `BoxSilent` | [`Lost`](skinrig_device::DeviceError::Lost) |
    /// | `BoxNoisy` | noise of 20 % on both lines, and unreadable data: [`State`](skinrig_device::DeviceError::State) |
    /// | `RobotLost` | brakes at its position, then [`Lost`](skinrig_device::DeviceError::Lost) |
    /// | `RobotStalled` | the tip stays in place, the pose stream continues |
    /// | `RobotZHigh`, `RobotZLow` | the reported height drifts off at `Z_ERROR_MM_S` |
    /// | `RobotForceSpike` | the reported force is `SPIKE_N` too high, for `SPIKE_NS` |
    /// | `RecorderSlow` | no device is polled for a while |
    ///
    /// # Errors
    /// [`UnsupportedFault`] for `RobotPowerLost`, `DiskFull` and `Killed`.
    pub const fn new(kind: RigFault, when: FaultTrigger) -> Result<Self, UnsupportedFault> {
        match kind {
            RigFault::RobotPowerLost | RigFault::DiskFull | RigFault::Killed => {
                Err(UnsupportedFault {
                    fault: kind,
                    rig: "the simulated rig",
                })
            }
            _ => Ok(Self::Timed(TimedFault { kind, when })),
        }
    }

    /// When it occurs, for a fault of the shared vocabulary.
    #[must_use]
    pub(crate) const fn when(&self) -> Option<FaultTrigger> {
        match self {
            Self::Timed(fault) => Some(fault.when),
            Self::PulseLost { .. } | Self::DeadPress { .. } => None,
        }
    }

    /// The fault in the shared vocabulary, if it has a name there.
    #[must_use]
    pub const fn kind(&self) -> Option<RigFault> {
        match self {
            Self::Timed(fault) => Some(fault.kind),
            Self::PulseLost { .. } | Self::DeadPress { .. } => None,
        }
    }
}

/// A fault of the shared vocabulary that the simulated rig supports, and its time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimedFault {
    kind: RigFault,
    when: FaultTrigger,
}

/// The times of the faults of one kind.
pub(crate) fn times(faults: &[Fault], kind: RigFault) -> impl Iterator<Item = FaultTrigger> {
    timed(faults).filter_map(move |(found, when)| (found == kind).then_some(when))
}

/// The faults of the shared vocabulary with their times.
pub(crate) fn timed(faults: &[Fault]) -> impl Iterator<Item = (RigFault, FaultTrigger)> {
    faults.iter().filter_map(|fault| match fault {
        Fault::Timed(TimedFault { kind, when }) => Some((*kind, *when)),
        _ => None,
    })
}

/// Sizes of the faults of a rig.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FaultSizes {
    /// 32-bit words lost by `CameraDrops`.
    pub lost_words: u64,
    /// Forward jump of `CameraClockStep`, µs.
    pub clock_step_us: u32,
    /// Edges affected by `LineNoisy`, percent of the edges sent.
    pub line_noise: LineNoise,
    /// Bandwidth of `RobotSlow`, percent of the usual one, 1 to 100: the robot settles late, or never in time.
    pub slow_percent: u32,
    /// Error of the height reported under `RobotZHigh` and `RobotZLow`, µm.
    pub z_error_um: u32,
    /// Duration of `RecorderSlow`, ms.
    pub recorder_ms: u32,
}

impl Default for FaultSizes {
    fn default() -> Self {
        Self {
            lost_words: 2_000,
            clock_step_us: 300_000,
            line_noise: BOX_NOISE,
            slow_percent: 4,
            z_error_um: 500,
            recorder_ms: 800,
        }
    }
}

/// Noise of a trigger line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LineNoise {
    /// Edges that never arrive.
    pub lost_percent: u8,
    /// Edges that arrive twice, within 10 µs.
    pub doubled_percent: u8,
    /// Spurious edges anywhere within a train.
    pub spurious_percent: u8,
}

/// Effect of a fault on a mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum MarkFault {
    /// None of its pulses arrives.
    Lost,
    /// It arrives twice, one after the other.
    Doubled,
    /// It arrives `DELAY_NS` late.
    Delayed,
}

/// Noise of both trigger lines while the box is noisy.
pub(crate) const BOX_NOISE: LineNoise = LineNoise {
    lost_percent: 20,
    doubled_percent: 20,
    spurious_percent: 20,
};
/// Delay of a delayed mark, ns.
pub(crate) const DELAY_NS: i64 = 20_000_000;
/// Duration of a force spike, ns.
pub(crate) const SPIKE_NS: i64 = 50_000_000;
/// Height of a force spike, N; more than the robot can exert.
pub(crate) const SPIKE_N: f64 = 20.0;
/// Rate at which the true height deviates from the reported one, mm/s; slow enough for a small viscous force.
pub(crate) const Z_ERROR_MM_S: f64 = 10.0;
/// Number of pixels in an event storm.
pub const STORM_PIXELS: u16 = 40;
/// Events per pixel and millisecond.
pub const STORM_PER_MS: i64 = 20;
/// Duration of an event storm, ns.
pub(crate) const STORM_NS: i64 = 300_000_000;
/// Temperature rise of a hot camera, °C.
pub(crate) const HOT_C: f64 = 40.0;
/// Time to heat up, and to cool down again, ns.
pub(crate) const HOT_RISE_NS: i64 = 1_000_000_000;
/// Time at the raised temperature, ns.
pub(crate) const HOT_NS: i64 = 6_000_000_000;
