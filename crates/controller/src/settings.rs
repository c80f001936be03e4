//! Constants of the controller that a plan does not set.

use skinrig_model::HostDuration;

/// How often the controller looks, and how long it waits for a device before it calls it silent.
///
/// The defaults are our own choices, not a vendor's figures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControllerSettings {
    /// Longest time between two looks at the devices and the operator's requests; 1 to 10 ms.
    pub tick: HostDuration,
    /// A newest pose sample older than this is stale: no motion is commanded and the run ends.
    pub stale_after: HostDuration,
    /// The tip is low and nobody looked for longer than this: the run ends.
    pub late_after: HostDuration,
    /// The time over which the watchdog takes a speed: long enough that the noise of positions and of their times is no speed,
    /// at most a tick, so that it trips within two.
    pub speed_over: HostDuration,
    /// Longest time from arming the robot to the first sample of its pose stream.
    pub first_pose_within: HostDuration,
    /// How far a camera's time may step away from the host's; its stream is not watched when absent.
    pub camera_lag: Option<HostDuration>,
    /// How long the verdict on a press may wait for what both cameras saw of it; then its data are late, and it is invalid.
    pub data_within: HostDuration,
    /// Speed of motions that are not in the plan (rising from an unknown start, retracting after a
    /// fault), mm/s; never more than the plan's own limit.
    pub rise_speed_mm_s: f64,
    /// What a motion that is not in the plan may take beyond twice its length divided by its speed.
    pub rise_allowance: HostDuration,
    /// How long a motion may be asked for again that the guard refused because of where the tip was last measured.
    pub steady_within: HostDuration,
    /// Longest time for which a trigger box may stay busy.
    pub mark_within: HostDuration,
    /// Pose samples per record, at least 1.
    pub pose_block: usize,
    /// How often the consumer of records is asked whether it still has them.
    pub check_sink_every: HostDuration,
}

impl Default for ControllerSettings {
    fn default() -> Self {
        Self {
            tick: HostDuration::from_millis(5),
            stale_after: HostDuration::from_millis(100),
            late_after: HostDuration::from_millis(1_000),
            speed_over: HostDuration::from_millis(5),
            first_pose_within: HostDuration::from_millis(2_000),
            camera_lag: Some(HostDuration::from_millis(250)),
            data_within: HostDuration::from_millis(1_000),
            rise_speed_mm_s: 20.0,
            rise_allowance: HostDuration::from_millis(3_000),
            steady_within: HostDuration::from_millis(500),
            mark_within: HostDuration::from_millis(1_000),
            pose_block: 256,
            check_sink_every: HostDuration::from_millis(500),
        }
    }
}
