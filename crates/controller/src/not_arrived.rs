//! A motion that did not end where it should.

use skinrig_model::{HostDuration, Point3, Skin};

/// A motion did not end where it should: the tip had not settled at its target in time.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{what}: expected to settle within {tolerance_mm} mm of {} in {allowed}, found {}", point(.target), .found.as_ref().map_or_else(|| "no pose".to_owned(), point))]
pub struct NotArrived {
    /// Which motion.
    pub what: String,
    /// mm.
    pub tolerance_mm: f64,
    /// Where to.
    pub target: Point3<Skin>,
    /// How long it was given.
    pub allowed: HostDuration,
    /// Where the tip was then.
    pub found: Option<Point3<Skin>>,
}

/// `(x, y, z) mm` to the micrometre.
pub(crate) fn point(p: &Point3<Skin>) -> String {
    format!("({:.3}, {:.3}, {:.3}) mm", p.x_mm, p.y_mm, p.z_mm)
}
