//! Fault injection: faults of a simulated rig, as data.

use skinrig_model::{CameraId, HostTime};

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

/// A motion phase as seen by the simulated robot. Every descent counts, including those that search for the surface and those of failed
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

/// A fault.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Fault {
    /// The robot stops responding and brakes at its position. Seen as [`skinrig_device::DeviceError::Lost`].
    IndenterLost(FaultTrigger),
    /// The robot follows its set point with this percentage of its usual bandwidth: it settles late, or never in time.
    Sluggish {
        /// Start.
        when: FaultTrigger,
        /// 1 to 100.
        percent: u32,
    },
    /// The tip is higher than the robot reports (negative: lower); the offset grows at `HEIGHT_OFF_MM_S`.
    HeightOff {
        /// Start.
        when: FaultTrigger,
        /// Offset, µm.
        by_um: i32,
    },
    /// The tip stays in place and ignores commands; the pose stream continues.
    IndenterStuck(FaultTrigger),
    /// The robot reports a force that is `SPIKE_N` too high, for `SPIKE_NS`.
    ForceSpike(FaultTrigger),
    /// The pose stream stops without an error.
    PosesStale(FaultTrigger),
    /// A limit reads back with another value than written. Seen as
    /// [`skinrig_device::DeviceError::ReadBack`].
    IndenterReadBack,
    /// A camera is unplugged. Data already sent is still delivered; then
    /// [`skinrig_device::DeviceError::Lost`].
    CameraUnplugged {
        /// The camera.
        camera: CameraId,
        /// Time of the fault.
        when: FaultTrigger,
    },
    /// The next `words` 32-bit words of a camera are lost; seen in `lost_before` of the next chunk.
    CameraBytesLost {
        /// The camera.
        camera: CameraId,
        /// Time of the fault.
        when: FaultTrigger,
        /// Number of words.
        words: u64,
    },
    /// A camera stops sending without an error.
    CameraStalled {
        /// The camera.
        camera: CameraId,
        /// Time of the fault.
        when: FaultTrigger,
    },
    /// [`STORM_PIXELS`] pixels of a camera send [`STORM_PER_MS`] events per millisecond each, for `STORM_NS`.
    HotPixelStorm {
        /// The camera.
        camera: CameraId,
        /// Time of the fault.
        when: FaultTrigger,
    },
    /// A camera's clock jumps forward.
    ClockStep {
        /// The camera.
        camera: CameraId,
        /// Time of the fault.
        when: FaultTrigger,
        /// Size of the jump, µs.
        by_us: u32,
    },
    /// A camera heats up by `HOT_C` within `HOT_RISE_NS`, stays hot for `HOT_NS`, and cools down as fast.
    CameraHot {
        /// The camera.
        camera: CameraId,
        /// Start.
        when: FaultTrigger,
    },
    /// A bias reads back with another value than written. Seen as
    /// [`skinrig_device::DeviceError::ReadBack`].
    CameraReadBack(CameraId),
    /// A pulse of a mark does not reach a camera. Seen as lost edges; a lost start pulse as stray edges and a missing mark.
    PulseLost {
        /// The camera.
        camera: CameraId,
        /// Index of the mark, from 0.
        train: u32,
        /// Index of the pulse, from 0.
        pulse: u32,
    },
    /// A camera's trigger input loses, doubles and invents edges, each as a percentage of the edges sent.
    NoisyLine {
        /// The camera.
        camera: CameraId,
        /// Edges that never arrive.
        lost_percent: u8,
        /// Edges that arrive twice, within 10 µs.
        doubled_percent: u8,
        /// Spurious edges anywhere within a train.
        spurious_percent: u8,
    },
    /// The next mark does not reach the cameras, reaches them twice, or late; the box reports it as sent.
    Mark {
        /// Effect on the mark.
        fate: MarkFault,
        /// The first mark after this time is affected.
        when: FaultTrigger,
    },
    /// The trigger inputs of both cameras lose, double and invent edges, 20 % each, and some data from the box to the host is unreadable. Seen
    /// as [`skinrig_device::DeviceError::State`] when polled.
    TriggerBoxNoisy(FaultTrigger),
    /// The program stalls, for example because of a slow recorder: no device is polled meanwhile.
    HostHeldUp {
        /// Time of the fault.
        when: FaultTrigger,
        /// Duration, ms.
        for_ms: u32,
    },
    /// The trigger box stops responding. Seen as [`skinrig_device::DeviceError::Lost`].
    TriggerBoxLost(FaultTrigger),
    /// The n-th contact, counted from 0, produces no events in a camera (geometric level).
    DeadPress {
        /// The camera.
        camera: CameraId,
        /// Index of the contact.
        contact: u32,
    },
}

/// Effect of a fault on a mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MarkFault {
    /// None of its pulses arrives.
    Lost,
    /// It arrives twice, one after the other.
    Doubled,
    /// It arrives `DELAY_NS` late.
    Delayed,
}

/// Delay of a delayed mark, ns.
pub(crate) const DELAY_NS: i64 = 20_000_000;
/// Duration of a force spike, ns.
pub(crate) const SPIKE_NS: i64 = 50_000_000;
/// Height of a force spike, N; more than the robot can exert.
pub(crate) const SPIKE_N: f64 = 20.0;
/// Rate at which the true height deviates from the reported one, mm/s; slow enough for a small viscous force.
pub(crate) const HEIGHT_OFF_MM_S: f64 = 10.0;
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
