//! The error of a motion that did not reach its target.

use skinrig_model::{HostDuration, Point3, Skin};

/// The tip did not settle at its target in time.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{what}: expected to settle within {tolerance_mm} mm of {} in {allowed}, found {}", point(.target), .found.as_ref().map_or_else(|| "no pose".to_owned(), point))]
pub struct NotArrived {
    /// Name of the motion.
    pub what: String,
    /// Largest allowed distance, mm.
    pub tolerance_mm: f64,
    /// Commanded position.
    pub target: Point3<Skin>,
    /// Time allowed.
    pub allowed: HostDuration,
    /// Measured position at the end of that time.
    pub found: Option<Point3<Skin>>,
}

/// `(x, y, z) mm` to the micrometre.
pub(crate) fn point(p: &Point3<Skin>) -> String {
    format!("({:.3}, {:.3}, {:.3}) mm", p.x_mm, p.y_mm, p.z_mm)
}
