//! Points and rigid transforms that carry their coordinate frame in their type.
//!
//! *Skin* frame: millimetres, x and y in the plane of the skin, z out of the skin (up); z = 0 is the
//! touched surface, an indentation of 2 mm ends at z = -2. *Robot* frame: millimetres in the robot's own
//! axes. A conversion reads `skin_from_robot`: it converts robot coordinates to skin coordinates.

use std::marker::PhantomData;

use serde::{Deserialize, Serialize};
use skinrig_settings::{Collector, Dimension, Field, Setting, Shape, ValueRange};

/// Marker of the skin frame.
#[derive(Debug)]
pub enum Skin {}

/// Marker of the robot frame.
#[derive(Debug)]
pub enum Robot {}

/// A point of the skin's plane in millimetres.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Point2 {
    /// Along the skin's x axis, mm.
    pub x_mm: f64,
    /// Along the skin's y axis, mm.
    pub y_mm: f64,
}

impl Point2 {
    /// The point (x, y) in mm.
    #[must_use]
    pub const fn new(x_mm: f64, y_mm: f64) -> Self {
        Self { x_mm, y_mm }
    }

    /// Euclidean distance to `other` in mm.
    #[must_use]
    pub fn distance_mm(self, other: Self) -> f64 {
        libm::hypot(self.x_mm - other.x_mm, self.y_mm - other.y_mm)
    }

    /// The point `z_mm` above this one (negative: below the surface).
    #[must_use]
    pub const fn at_height(self, z_mm: f64) -> Point3<Skin> {
        Point3::new(self.x_mm, self.y_mm, z_mm)
    }
}

/// A coordinate in a file, mm: everything on a bench is within a metre.
const COORDINATE: Shape =
    Shape::Quantity(&[Dimension::Length], ValueRange::between(-1000.0, 1000.0));

impl Setting for Point2 {
    const SHAPE: Shape = Shape::Tuple(&COORDINATE, &["x", "y"]);

    fn from_field(field: &Field, _: &mut Collector) -> Option<Self> {
        field.as_quantities().map(|[x, y]| Self::new(x, y))
    }

    fn text(&self) -> String {
        format!("[{} mm, {} mm]", self.x_mm, self.y_mm)
    }
}

impl<F> Setting for Point3<F> {
    const SHAPE: Shape = Shape::Tuple(&COORDINATE, &["x", "y", "z"]);

    fn from_field(field: &Field, _: &mut Collector) -> Option<Self> {
        field.as_quantities().map(|[x, y, z]| Self::new(x, y, z))
    }

    fn text(&self) -> String {
        format!("[{} mm, {} mm, {} mm]", self.x_mm, self.y_mm, self.z_mm)
    }
}

/// A point in frame `F`, millimetres.
#[derive(Debug, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Point3<F> {
    /// mm.
    pub x_mm: f64,
    /// mm.
    pub y_mm: f64,
    /// mm.
    pub z_mm: f64,
    #[serde(skip)]
    frame: PhantomData<fn() -> F>,
}

impl<F> Clone for Point3<F> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<F> Copy for Point3<F> {}
impl<F> PartialEq for Point3<F> {
    fn eq(&self, o: &Self) -> bool {
        self.x_mm == o.x_mm && self.y_mm == o.y_mm && self.z_mm == o.z_mm
    }
}

impl<F> Point3<F> {
    /// The point (x, y, z) in mm.
    #[must_use]
    pub const fn new(x_mm: f64, y_mm: f64, z_mm: f64) -> Self {
        Self {
            x_mm,
            y_mm,
            z_mm,
            frame: PhantomData,
        }
    }

    /// The coordinates as an array, mm.
    #[must_use]
    pub const fn to_array(self) -> [f64; 3] {
        [self.x_mm, self.y_mm, self.z_mm]
    }

    /// Euclidean distance to `other` in mm.
    #[must_use]
    pub fn distance_mm(self, other: Self) -> f64 {
        let dx = self.x_mm - other.x_mm;
        let dy = self.y_mm - other.y_mm;
        let dz = self.z_mm - other.z_mm;
        (dx * dx + dy * dy + dz * dz).sqrt()
    }

    /// True if no coordinate is NaN or infinite.
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.to_array().iter().all(|c| c.is_finite())
    }
}

impl Point3<Skin> {
    /// The point projected onto the skin's plane.
    #[must_use]
    pub const fn plane(self) -> Point2 {
        Point2::new(self.x_mm, self.y_mm)
    }
}

/// A rotation followed by a translation: `p_to = rotation * p_from + translation`.
#[derive(Debug, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct RigidTransform<To, From> {
    /// Row-major rotation matrix, orthonormal with determinant +1.
    pub rotation: [[f64; 3]; 3],
    /// Translation in mm, in the `To` frame.
    pub translation_mm: [f64; 3],
    #[serde(skip)]
    frames: PhantomData<fn(From) -> To>,
}

impl<To, From> Clone for RigidTransform<To, From> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<To, From> Copy for RigidTransform<To, From> {}
impl<To, From> PartialEq for RigidTransform<To, From> {
    fn eq(&self, o: &Self) -> bool {
        self.rotation == o.rotation && self.translation_mm == o.translation_mm
    }
}

impl<To, From> RigidTransform<To, From> {
    /// The transform between coinciding frames.
    #[must_use]
    pub const fn identity() -> Self {
        Self::translation(0.0, 0.0, 0.0)
    }

    /// Axes parallel, origin of `From` at (x, y, z) mm of `To`.
    #[must_use]
    pub const fn translation(x_mm: f64, y_mm: f64, z_mm: f64) -> Self {
        Self {
            rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            translation_mm: [x_mm, y_mm, z_mm],
            frames: PhantomData,
        }
    }

    /// The transform with this row-major rotation and translation in mm.
    #[must_use]
    pub const fn new(rotation: [[f64; 3]; 3], translation_mm: [f64; 3]) -> Self {
        Self {
            rotation,
            translation_mm,
            frames: PhantomData,
        }
    }

    /// The same point in the other frame.
    #[must_use]
    pub fn apply(&self, p: Point3<From>) -> Point3<To> {
        let v = p.to_array();
        let row = |i: usize| {
            let r = self.rotation[i];
            r[0] * v[0] + r[1] * v[1] + r[2] * v[2] + self.translation_mm[i]
        };
        Point3::new(row(0), row(1), row(2))
    }

    /// The transform in the other direction.
    #[must_use]
    pub fn inverse(&self) -> RigidTransform<From, To> {
        let r = self.rotation;
        let t = self.translation_mm;
        let rt = [
            [r[0][0], r[1][0], r[2][0]],
            [r[0][1], r[1][1], r[2][1]],
            [r[0][2], r[1][2], r[2][2]],
        ];
        let back = |i: usize| -(rt[i][0] * t[0] + rt[i][1] * t[1] + rt[i][2] * t[2]);
        RigidTransform::new(rt, [back(0), back(1), back(2)])
    }
}
