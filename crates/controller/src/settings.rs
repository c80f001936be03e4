//! Constants of the controller that a plan does not set.

use skinrig_model::HostDuration;

/// Polling intervals and timeouts of the controller.
///
/// The defaults are our own choices, not vendor figures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControllerSettings {
    /// Longest time between two polls of devices and requests; 1 to 10 ms.
    pub tick: HostDuration,
    /// Age at which the newest pose sample is stale: no motion is commanded and the run ends.
    pub stale_after: HostDuration,
    /// Longest time between two polls while the tip is low; beyond it the run ends.
    pub late_after: HostDuration,
    /// Time over which the watchdog measures speed: long enough to average out noise of positions and times, and
    /// at most a tick, so that it trips within two.
    pub speed_over: HostDuration,
    /// Longest time from arming the robot to the first sample of its pose stream.
    pub first_pose_within: HostDuration,
    /// Largest deviation of a camera's time from the host's; `None` disables the check.
    pub camera_lag: Option<HostDuration>,
    /// How long the verdict on a press waits for the data of both cameras; after that they are late, and the press is invalid.
    pub data_within: HostDuration,
    /// Speed of motions outside the plan (rising from an unknown start, retracting after a
    /// fault), mm/s; limited by the plan's maximum.
    pub rise_speed_mm_s: f64,
    /// Time allowed for a motion outside the plan, in addition to twice its nominal duration.
    pub rise_allowance: HostDuration,
    /// How long to repeat a motion that the guard rejected because of the measured position.
    pub steady_within: HostDuration,
    /// Longest time that a trigger box may stay busy.
    pub mark_within: HostDuration,
    /// Pose samples per record, at least 1.
    pub pose_block: usize,
    /// How often to check that the sink still has its records.
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
