//! The indenter's tip.

use serde::Serialize;
use skinrig_settings::{Choice, Collector, Field, Settings, ValueRange};

/// The indenter's tip.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tip {
    /// Shape of the contact end.
    pub shape: TipShape,
    /// Side of a cube, diameter of the others, mm.
    pub size_mm: f64,
    /// With its holder, kg.
    pub mass_kg: Option<f64>,
}

/// Shape of the contact end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Choice)]
#[serde(rename_all = "snake_case")]
pub enum TipShape {
    /// A flat square end.
    Cube,
    /// A ball.
    Sphere,
    /// A flat round end.
    Cylinder,
}

const SIZE: ValueRange = ValueRange::above_zero(1000.0);

/// The indenter's tip.
#[derive(Settings)]
#[settings(
    name = "tip",
    exactly_one("side", "diameter"),
    builds(Tip, TipKeys::tip)
)]
struct TipKeys {
    /// Shape of the contact end.
    shape: TipShape,
    /// Side of a cube.
    #[setting(range = SIZE, example = "10 mm")]
    side_mm: Option<f64>,
    /// Diameter of a sphere or a cylinder.
    #[setting(range = SIZE)]
    diameter_mm: Option<f64>,
    /// Mass of the tip and its holder. Stored with the session; the robot carries `robot.effector_mass`.
    #[setting(above = 0, max = 1)]
    mass_kg: Option<f64>,
}

impl TipKeys {
    fn tip(self, field: &Field, out: &mut Collector) -> Option<Tip> {
        let (size_mm, right, wrong) = match self.shape {
            TipShape::Cube => (self.side_mm, "side", "diameter"),
            TipShape::Sphere | TipShape::Cylinder => (self.diameter_mm, "diameter", "side"),
        };
        if let Some(other) = field.get(wrong) {
            let message = "the size does not fit the shape";
            out.error(other.span, other.path.as_str(), message)
                .expected(format!("`{right}` for a {}", self.shape.word()))
                .found(format!("`{wrong}`"));
        }
        Some(Tip {
            shape: self.shape,
            size_mm: size_mm?,
            mass_kg: self.mass_kg,
        })
    }
}
