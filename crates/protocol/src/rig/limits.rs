//! Limits of a bench, and checks before a run on it.

use serde::Serialize;
use skinrig_model::HostDuration;
use skinrig_settings::{Collector, Field, Settings};

use super::frame::COORDINATE;

/// Limits of this bench. The tighter of these and the protocol's limits applies.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Settings)]
#[settings(name = "rig_limits")]
pub struct BenchLimits {
    /// Box that the tip never leaves, robot frame. The robot's true workspace is narrower away from its axes.
    #[serde(flatten)]
    pub workspace: Workspace,
    /// Fastest motion. The omega.3's driver commands set points at 2 kHz, at most 0.1 mm apart even when every other one is lost.
    #[setting(above = 0, max = 100)]
    pub max_speed_mm_s: f64,
    /// A measured force above this ends the run.
    #[setting(above = 0, max = 12)]
    pub max_force_n: f64,
    /// How far the robot's target may run ahead of the tip: bounds the force that builds up in contact.
    #[setting(default = "2 mm", above = 0, max = 4)]
    pub max_lead_mm: f64,
    /// Deepest indentation below the surface of the frame.
    #[setting(above = 0, max = 50, example = "3 mm")]
    pub max_depth_mm: f64,
}

/// A box in the robot's frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Settings)]
#[settings(
    name = "robot_workspace",
    check(Self::is_not_empty, "min_mm", "max_mm")
)]
pub struct Workspace {
    /// Lowest x, y and z.
    #[serde(rename = "workspace_min_mm")]
    #[setting(range = COORDINATE, example = "[-50 mm, -60 mm, -25 mm]")]
    pub min_mm: [f64; 3],
    /// Highest x, y and z.
    #[serde(rename = "workspace_max_mm")]
    #[setting(range = COORDINATE, example = "[60 mm, 60 mm, 30 mm]")]
    pub max_mm: [f64; 3],
}

impl Workspace {
    /// True for a point inside the box or on its faces.
    #[must_use]
    pub fn contains(&self, point_mm: [f64; 3]) -> bool {
        (0..3).all(|i| (self.min_mm[i]..=self.max_mm[i]).contains(&point_mm[i]))
    }

    fn is_not_empty(min: &[f64; 3], max: &[f64; 3], field: &Field, out: &mut Collector) {
        for ((axis, low), high) in ["x", "y", "z"].iter().zip(min).zip(max) {
            if low >= high {
                out.error(field.span, field.path.as_str(), "the workspace is empty")
                    .expected(format!("`min` smaller than `max` in {axis}"))
                    .found(format!("{low} mm and {high} mm"));
            }
        }
    }
}

/// Checks before arming. A failed check ends the run before the robot is powered.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Settings)]
#[settings(name = "preflight")]
pub struct PreflightLimits {
    /// A frame measured longer ago than this fails.
    #[setting(default = "168 h", above = 0, max = 31_536_000)]
    pub touch_off_max_age: HostDuration,
    /// Expected data rate of both cameras together: with the plan's length it gives the disk space that a session needs.
    #[setting(default = "20 MB/s", above = 0, max = 1e9)]
    pub data_rate_b_s: f64,
    /// Free space that must be left after the session.
    #[setting(default = "2 GB", max = 1e15)]
    pub min_free_disk_b: f64,
    /// A mark sent by the box must reach both cameras, under its own name, within this time.
    #[setting(default = "2 s", above = 0, max = 60)]
    pub loopback_within: HostDuration,
    /// Both cameras' clocks must advance within this time.
    #[setting(default = "2 s", above = 0, max = 60)]
    pub clocks_within: HostDuration,
}
