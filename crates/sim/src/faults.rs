//! Fault injection: what goes wrong in a simulated rig, as data.

use skinrig_model::{CameraId, HostTime};

/// When a fault strikes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum When {
    /// At this instant.
    At(HostTime),
    /// When the tip touches the skin for the n-th time, counted from 0.
    Contact(u32),
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
