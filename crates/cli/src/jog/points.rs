//! Formats touched points as a block for the rig file.

use skinrig_model::{Point3, Robot};

/// A touched point.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NamedPoint {
    /// Name given by the operator.
    pub name: String,
    /// Position on the skin, mm, if the operator gave it.
    pub skin: Option<[f64; 3]>,
    /// Position of the tip.
    pub robot: Point3<Robot>,
}

/// The key `frame` of a rig file with these points, to be pasted.
#[must_use]
pub(super) fn block(points: &[NamedPoint], date: &str) -> String {
    let mut out = format!("frame:\n  touch_off:\n    date: {date}\n    points:\n");
    for p in points {
        let [x, y, z] = p.robot.to_array();
        let skin = match p.skin {
            Some([a, b, c]) => format!("[{a} mm, {b} mm, {c} mm]"),
            None => "[FILL IN mm, FILL IN mm, 0 mm]".to_owned(),
        };
        out.push_str(&format!(
            "      - {{name: {}, skin: {skin}, robot: [{x:.3} mm, {y:.3} mm, {z:.3} mm]}}\n",
            p.name
        ));
    }
    if points.len() < 3 {
        out.push_str("    # a frame needs at least three points that are not on one line\n");
    }
    out
}
