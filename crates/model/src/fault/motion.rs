//! The error of a motion that did not reach its target.

use serde::{Deserialize, Serialize};

use crate::frame::{Point3, Skin};
use crate::pose::PoseSample;
use crate::time::HostDuration;

/// The tip did not settle at its target in time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[error("{what}: expected to settle within {tolerance_mm} mm of {} in {allowed}, found {}", point(.target), self.found())]
pub struct NotArrived {
    /// Name of the motion.
    pub what: String,
    /// Largest allowed distance, mm.
    pub tolerance_mm: f64,
    /// Commanded position.
    pub target: Point3<Skin>,
    /// Time allowed.
    pub allowed: HostDuration,
    /// Largest force that the motors may apply, N. A tip that something holds back rests at about this force or stops below it.
    pub max_force_n: f64,
    /// Last sample of that time.
    pub found: Option<Box<PoseSample>>,
}

impl NotArrived {
    fn found(&self) -> String {
        let Some(found) = &self.found else {
            return "no pose".to_owned();
        };
        let at = point(&found.measured);
        if found.force_n.is_finite() {
            format!(
                "{at} and a force of {:.2} N of at most {} N",
                found.force_n, self.max_force_n
            )
        } else {
            at
        }
    }
}

/// `(x, y, z) mm` to the micrometre.
#[must_use]
pub fn point(p: &Point3<Skin>) -> String {
    format!("({:.3}, {:.3}, {:.3}) mm", p.x_mm, p.y_mm, p.z_mm)
}
