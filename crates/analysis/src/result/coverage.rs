//! Owns the results on areas, taxels, contact maps and data rates.

use serde::{Deserialize, Serialize};
use skinrig_model::{CameraId, CmreSettings, Point2};

use super::Estimate;

/// Visible area, probed area, and number of distinguishable locations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Coverage {
    /// Area of the outline, mm².
    pub skin_mm2: f64,
    /// Area of the outline in the field of view of both cameras, mm².
    pub seen_by_both_mm2: f64,
    /// Probed area, mm²: the union of one cell per location, clipped to the outline; `None` with fewer than two locations.
    pub probed_mm2: Option<f64>,
    /// Side of a cell, mm: the median distance between nearest neighbours.
    pub cell_mm: Option<f64>,
    /// Number of locations with an attempted scored press.
    pub locations: u32,
    /// Their distinct positions.
    pub places: Vec<Point2>,
    /// Field of view of each camera within the outline, mm: convex polygons that touch but do not overlap, a single one for
    /// a field of view below 180°.
    pub views: [Vec<Vec<Point2>>; 2],
    /// Overlap of the fields of view, in the same form.
    pub overlap: Vec<Vec<Point2>>,
    /// Number of circles of radius RMSE that fill the skin's area: area / (pi RMSE²).
    pub taxels_skin: Estimate,
    /// Same for the probed area, the only area in which the RMSE was measured.
    pub taxels_probed: Estimate,
}

/// Contact map reconstruction error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cmre {
    /// The parameters.
    pub settings: CmreSettings,
    /// Cells along x and y.
    pub cells: (u32, u32),
    /// Mean score over the counting scored presses, percent.
    pub percent: Estimate,
    /// Presses with a truth outside the map, which have no score.
    pub without_score: u32,
}

/// Data rates of both cameras together, rows of the crop only.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BitRates {
    /// Bits per event assumed for byte rates.
    pub bits_per_event: f64,
    /// Mean events per second in the press windows.
    pub press_events_per_s: Estimate,
    /// Mean events per second in the idle time before presses.
    pub idle_events_per_s: Estimate,
    /// Bytes per second in the press windows.
    pub press_bytes_per_s: Estimate,
    /// Bytes per second while idle.
    pub idle_bytes_per_s: Estimate,
    /// Mean length of a press, contact to release, s.
    pub press_s: Estimate,
}

/// Events of a camera per pixel over the whole recording, whole sensor.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Activity {
    /// Camera.
    pub camera: CameraId,
    /// Side of a cell of the image, px.
    pub cell_px: u16,
    /// Cells along u.
    pub width: u16,
    /// Cells along v.
    pub height: u16,
    /// Events per cell, row by row. Serialised as one text per row, with the numbers of its cells separated by spaces.
    #[serde(with = "rows")]
    pub counts: Vec<u64>,
}

/// Compact serialisation of an image's counts, a line per 320 cells (the width of an image).
mod rows {
    use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

    const CELLS: usize = 320;

    pub(super) fn serialize<S: Serializer>(counts: &[u64], to: S) -> Result<S::Ok, S::Error> {
        let line = |row: &[u64]| row.iter().map(u64::to_string).collect::<Vec<_>>().join(" ");
        counts
            .chunks(CELLS)
            .map(line)
            .collect::<Vec<_>>()
            .serialize(to)
    }

    pub(super) fn deserialize<'a, D: Deserializer<'a>>(from: D) -> Result<Vec<u64>, D::Error> {
        let lines = Vec::<String>::deserialize(from)?;
        let numbers = lines
            .iter()
            .flat_map(|l| l.split(' '))
            .filter(|n| !n.is_empty());
        numbers
            .map(|n| n.parse().map_err(D::Error::custom))
            .collect()
    }
}

/// Events outside the sensor in a camera's stream; none of them is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct OffSensor {
    /// Events outside the sensor.
    pub events: u64,
    /// All events of the stream, including these.
    pub of: u64,
}

impl OffSensor {
    /// A larger share gives a warning.
    pub(crate) const WARNING_SHARE: f64 = 1e-4;
    /// A larger share prevents the analysis: the stream is from another sensor, or broken.
    pub(crate) const MAX_SHARE: f64 = 0.01;

    /// The share of the events outside the sensor, 0 to 1.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.events as f64 / self.of.max(1) as f64
    }
}
