//! Fault injection: what goes wrong in a simulated rig, as data.

use skinrig_model::{CameraId, HostTime};

/// When a fault strikes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum When {
    /// At this instant.
    At(HostTime),
    /// When the tip touches the skin for the n-th time, counted from 0.
    Contact(u32),
    /// When this moment comes for the n-th time, counted from 0.
    Moment(Moment, u32),
}

/// A moment of a run as the simulated robot sees it. Every way down counts, also one that looks for the surface and one of
/// an attempt that did not succeed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moment {
    /// The motors are switched on.
    Arming,
    /// The tip is sent sideways above the skin.
    Travel,
    /// The tip is sent down to the skin.
    Approach,
    /// The set point comes to rest in the skin.
    Hold,
    /// The tip is sent up out of the skin.
    Retract,
    /// The set point comes to rest above the skin after a way up.
    Between,
}

/// Something that goes wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Fault {
    /// The robot answers no more; it brakes where it is. Seen as [`skinrig_device::DeviceError::Lost`].
    IndenterLost(When),
    /// From then on the robot follows its set point with this share (in percent) of its usual swiftness: it
    /// settles late, or with a small share never in time.
    Sluggish {
        /// When it begins.
        when: When,
        /// 1 to 100.
        percent: u32,
    },
    /// From then on the tip is so much higher than the robot reports (negative: lower); it gets there at `HEIGHT_OFF_MM_S`.
    HeightOff {
        /// When it begins.
        when: When,
        /// How much higher, µm.
        by_um: i32,
    },
    /// The tip stays where it is, whatever the robot is told; its pose stream goes on.
    IndenterStuck(When),
    /// For `SPIKE_NS` the robot reports `SPIKE_N` more than it feels.
    ForceSpike(When),
    /// No pose sample comes any more, and no error either.
    PosesStale(When),
    /// A limit reads back with another value than written. Seen as
    /// [`skinrig_device::DeviceError::ReadBack`].
    IndenterReadBack,
    /// A camera is unplugged. What it had sent is still delivered; then
    /// [`skinrig_device::DeviceError::Lost`].
    CameraUnplugged {
        /// Which.
        camera: CameraId,
        /// When.
        when: When,
    },
    /// The next `words` 32-bit words of a camera are lost; seen in `lost_before` of the next chunk.
    CameraBytesLost {
        /// Which.
        camera: CameraId,
        /// When.
        when: When,
        /// How many words.
        words: u64,
    },
    /// A camera sends nothing any more, and no error either.
    CameraStalled {
        /// Which.
        camera: CameraId,
        /// When.
        when: When,
    },
    /// [`STORM_PIXELS`] pixels of a camera send [`STORM_PER_MS`] events per millisecond each, for `STORM_NS`.
    HotPixelStorm {
        /// Which.
        camera: CameraId,
        /// When.
        when: When,
    },
    /// The camera's clock is set forward.
    ClockStep {
        /// Which.
        camera: CameraId,
        /// When.
        when: When,
        /// By how much, µs.
        by_us: u32,
    },
    /// A camera grows hotter by `HOT_C` within `HOT_RISE_NS`, stays so for `HOT_NS`, and cools down as fast.
    CameraHot {
        /// Which.
        camera: CameraId,
        /// When it begins.
        when: When,
    },
    /// A bias reads back with another value than written. Seen as
    /// [`skinrig_device::DeviceError::ReadBack`].
    CameraReadBack(CameraId),
    /// A pulse of a mark never reaches a camera. Seen as lost edges; the start pulse's loss as stray edges and a missing
    /// mark.
    PulseLost {
        /// Which camera.
        camera: CameraId,
        /// Which of the marks sent, from 0.
        train: u32,
        /// Which pulse of it, from 0.
        pulse: u32,
    },
    /// A camera's trigger input loses, doubles and invents edges, each with this share of the edges sent, in percent.
    NoisyLine {
        /// Which camera.
        camera: CameraId,
        /// Edges that never arrive.
        lost_percent: u8,
        /// Edges that arrive twice, within 10 µs.
        doubled_percent: u8,
        /// Edges that nobody sent, anywhere within a train.
        spurious_percent: u8,
    },
    /// The next mark reaches no camera, reaches both twice, or late; the box tells that it was sent as ever.
    Mark {
        /// What becomes of it.
        fate: MarkFate,
        /// From when on the next mark is meant.
        when: When,
    },
    /// From then on the trigger inputs of both cameras lose, double and invent edges, a fifth of each, and what the box sends to the
    /// host is unreadable every now and then. Seen as [`skinrig_device::DeviceError::State`] when it is polled.
    TriggerBoxNoisy(When),
    /// The program is held up so long, as by a recorder that is slow: nobody looks at any device meanwhile.
    HostHeldUp {
        /// When.
        when: When,
        /// For so long, ms.
        for_ms: u32,
    },
    /// The trigger box answers no more. Seen as [`skinrig_device::DeviceError::Lost`].
    TriggerBoxLost(When),
    /// The n-th contact, counted from 0, gives no events in a camera (geometric level).
    DeadPress {
        /// Which camera.
        camera: CameraId,
        /// Which contact.
        contact: u32,
    },
}

/// What becomes of a mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MarkFate {
    /// No pulse of it arrives.
    Lost,
    /// It arrives twice, one after the other.
    Doubled,
    /// It arrives `DELAY_NS` late.
    Delayed,
}

/// How late a delayed mark arrives, ns.
pub(crate) const DELAY_NS: i64 = 20_000_000;
/// How long a force spike lasts, ns.
pub(crate) const SPIKE_NS: i64 = 50_000_000;
/// How high it is, N: more than the robot can push.
pub(crate) const SPIKE_N: f64 = 20.0;
/// How fast the true height leaves the reported one, mm/s: slow enough for the skin's viscous force to stay small.
pub(crate) const HEIGHT_OFF_MM_S: f64 = 10.0;
/// How many pixels take part in a storm.
pub const STORM_PIXELS: u16 = 40;
/// Events of each of them per millisecond.
pub const STORM_PER_MS: i64 = 20;
/// How long a storm lasts, ns.
pub(crate) const STORM_NS: i64 = 300_000_000;
/// How much hotter a camera grows, °C.
pub(crate) const HOT_C: f64 = 40.0;
/// How long it takes to grow so hot, and to cool down again, ns.
pub(crate) const HOT_RISE_NS: i64 = 1_000_000_000;
/// How long it stays so hot, ns.
pub(crate) const HOT_NS: i64 = 6_000_000_000;
