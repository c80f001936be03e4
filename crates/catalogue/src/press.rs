//! Presses of an analysis, as results files have them and as the catalogue keeps them.

use serde::Deserialize;
use serde_json::Value;
use skinrig_model::{CameraId, PressRole, Verdict};

/// A press of an analysis. Positions are in the skin frame.
#[derive(Debug, Clone, PartialEq)]
pub struct PressEntry {
    /// Number in the plan, from 1.
    pub press: u32,
    /// Its role.
    pub role: PressRole,
    /// Number of the location, from 1.
    pub location: u32,
    /// Number of the repetition, from 1.
    pub repetition: u32,
    /// Planned x, mm.
    pub planned_x_mm: f64,
    /// Planned y, mm.
    pub planned_y_mm: f64,
    /// Planned depth, mm.
    pub planned_depth_mm: f64,
    /// Measured x, mm.
    pub measured_x_mm: Option<f64>,
    /// Measured y, mm.
    pub measured_y_mm: Option<f64>,
    /// Its verdict.
    pub verdict: Verdict,
    /// Kind of the cause, for example `no_cluster`; `None` if valid.
    pub cause: Option<String>,
    /// Camera of the cause, if it is in one of them.
    pub camera: Option<CameraId>,
    /// Estimated x, mm.
    pub estimate_x_mm: Option<f64>,
    /// Estimated y, mm.
    pub estimate_y_mm: Option<f64>,
    /// Distance of the estimate from the measured position, mm.
    pub error_mm: Option<f64>,
    /// Longer semi-axis of the 95 % region, mm.
    pub region_major_mm: Option<f64>,
    /// Shorter one, mm.
    pub region_minor_mm: Option<f64>,
    /// Direction of the longer one, degrees from the x axis, counter-clockwise.
    pub region_angle_deg: Option<f64>,
}

/// A press in a results file.
#[derive(Deserialize)]
pub(crate) struct Press {
    press: u32,
    role: PressRole,
    repetition: u32,
    location: u32,
    planned: Point,
    depth_mm: f64,
    truth: Option<Point>,
    verdict: Verdict,
    #[serde(default)]
    cause: Option<Value>,
    location_outcome: Outcome,
    #[serde(default)]
    region: Option<Region>,
}

#[derive(Deserialize, Clone, Copy)]
struct Point {
    x_mm: f64,
    y_mm: f64,
}

#[derive(Deserialize)]
struct Outcome {
    #[serde(default)]
    at: Option<Point>,
}

#[derive(Deserialize)]
struct Region {
    semi_axes_mm: [f64; 2],
    angle_deg: f64,
}

/// Kind and camera of a cause: `{"no_cluster": {"camera": "camera1"}}`, or a word alone. `None`: not a cause.
fn kind_of(cause: &Value) -> Option<(&str, Option<CameraId>)> {
    let (kind, fields) = match cause {
        Value::String(kind) => (kind.as_str(), &Value::Null),
        Value::Object(one) if one.len() == 1 => one.iter().next().map(|(k, v)| (k.as_str(), v))?,
        _ => return None,
    };
    let is_word = kind.bytes().all(|c| c.is_ascii_lowercase() || c == b'_');
    let camera = match fields.get("camera") {
        None => None,
        Some(camera) => Some(CameraId::deserialize(camera).ok()?),
    };
    (is_word && !kind.is_empty()).then_some((kind, camera))
}

/// The camera as in results files.
pub(crate) const fn camera_word(camera: CameraId) -> &'static str {
    match camera {
        CameraId::One => "camera1",
        CameraId::Two => "camera2",
    }
}

impl Press {
    /// The entry; `None` if the cause is none.
    fn entry(self) -> Option<PressEntry> {
        let (cause, camera) = match self.cause.as_ref().map(kind_of) {
            None => (None, None),
            Some(found) => found.map(|(kind, camera)| (Some(kind.to_owned()), camera))?,
        };
        let (truth, at) = (self.truth, self.location_outcome.at);
        let error = |t: Point, e: Point| libm::hypot(e.x_mm - t.x_mm, e.y_mm - t.y_mm);
        let region = self.region.as_ref();
        Some(PressEntry {
            press: self.press,
            role: self.role,
            location: self.location,
            repetition: self.repetition,
            planned_x_mm: self.planned.x_mm,
            planned_y_mm: self.planned.y_mm,
            planned_depth_mm: self.depth_mm,
            measured_x_mm: truth.map(|p| p.x_mm),
            measured_y_mm: truth.map(|p| p.y_mm),
            verdict: self.verdict,
            cause,
            camera,
            estimate_x_mm: at.map(|p| p.x_mm),
            estimate_y_mm: at.map(|p| p.y_mm),
            error_mm: truth
                .zip(at)
                .map(|(t, e)| error(t, e))
                .filter(|e| e.is_finite()),
            region_major_mm: region.map(|r| r.semi_axes_mm[0]),
            region_minor_mm: region.map(|r| r.semi_axes_mm[1]),
            region_angle_deg: region.map(|r| r.angle_deg),
        })
    }
}

/// The entries of all presses; `None` if a cause is none, or a press is there twice.
pub(crate) fn entries(presses: Vec<Press>) -> Option<Vec<PressEntry>> {
    let all: Option<Vec<PressEntry>> = presses.into_iter().map(Press::entry).collect();
    all.filter(|all| all.is_sorted_by(|a, b| a.press < b.press))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_cause_has_a_kind_and_perhaps_a_camera() {
        let two = Some(CameraId::Two);
        for (cause, expected) in [
            (json!("no_times"), Some(("no_times", None))),
            (
                json!({"no_response": {"camera": "camera2", "found": 3}}),
                Some(("no_response", two)),
            ),
            (json!({"missed": "never_attempted"}), Some(("missed", None))),
            (json!({"invalid": {"faults": []}}), Some(("invalid", None))),
            (json!({"no_cluster": {"camera": "camera3"}}), None),
            (json!({"a": 1, "b": 2}), None),
            (json!("a\u{0}b"), None),
            (json!(""), None),
            (json!(7), None),
        ] {
            assert_eq!(kind_of(&cause), expected, "{cause}");
        }
    }
}
