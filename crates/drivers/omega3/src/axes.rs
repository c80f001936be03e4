//! Mapping between the axes of the robot frame and of the device: a right-handed signed permutation.

use skinrig_model::{Point3, Robot};

/// An axis of the device: x out of the base toward the operator, y to the operator's right, z up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// Along +x.
    PlusX,
    /// Along -x.
    MinusX,
    /// Along +y.
    PlusY,
    /// Along -y.
    MinusY,
    /// Along +z.
    PlusZ,
    /// Along -z.
    MinusZ,
}

impl Axis {
    const fn index_and_sign(self) -> (usize, f64) {
        match self {
            Self::PlusX => (0, 1.0),
            Self::MinusX => (0, -1.0),
            Self::PlusY => (1, 1.0),
            Self::MinusY => (1, -1.0),
            Self::PlusZ => (2, 1.0),
            Self::MinusZ => (2, -1.0),
        }
    }
}

/// Device axis of each robot axis. Robot +z points away from the sample, so pressing is -z.
///
/// An omega.3 that stands on the table and presses down has the identity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Axes([Axis; 3]);

impl Axes {
    /// Robot frame and device frame agree.
    pub const IDENTITY: Self = Self([Axis::PlusX, Axis::PlusY, Axis::PlusZ]);

    /// The device axes of robot x, y and z; `None` unless they are distinct and right-handed.
    #[must_use]
    pub fn new(axes: [Axis; 3]) -> Option<Self> {
        let mut m = [[0.0; 3]; 3];
        for (row, axis) in m.iter_mut().zip(axes) {
            let (i, sign) = axis.index_and_sign();
            row[i] = sign;
        }
        let [a, b, c] = m;
        let det = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
            + a[2] * (b[0] * c[1] - b[1] * c[0]);
        (det > 0.5).then_some(Self(axes))
    }

    /// Converts a device vector to the robot frame.
    #[must_use]
    pub(crate) fn robot_from_device(self, v: [f64; 3]) -> [f64; 3] {
        self.0.map(|axis| {
            let (i, sign) = axis.index_and_sign();
            sign * v[i]
        })
    }

    /// Converts a robot vector to the device axes.
    #[must_use]
    pub(crate) fn device_from_robot(self, v: [f64; 3]) -> [f64; 3] {
        let mut out = [0.0; 3];
        for (axis, value) in self.0.into_iter().zip(v) {
            let (i, sign) = axis.index_and_sign();
            out[i] = sign * value;
        }
        out
    }

    /// Converts a device position, m, to a point of the robot frame, mm.
    #[must_use]
    pub(crate) fn point_from_metres(self, position_m: [f64; 3]) -> Point3<Robot> {
        let [x, y, z] = self.robot_from_device(position_m).map(|c| c * 1e3);
        Point3::new(x, y, z)
    }

    /// Converts a point of the robot frame, mm, to a device position, m.
    #[must_use]
    pub(crate) fn metres_from_point(self, point: Point3<Robot>) -> [f64; 3] {
        self.device_from_robot(point.to_array()).map(|c| c * 1e-3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_right_handed_mappings_exist_and_they_round_trip() {
        let all = [
            Axis::PlusX,
            Axis::MinusX,
            Axis::PlusY,
            Axis::MinusY,
            Axis::PlusZ,
            Axis::MinusZ,
        ];
        let v = [1.0, -2.0, 5.0];
        let mut found = 0;
        for a in all {
            for b in all {
                for c in all {
                    let Some(axes) = Axes::new([a, b, c]) else {
                        continue;
                    };
                    found += 1;
                    assert_eq!(axes.device_from_robot(axes.robot_from_device(v)), v);
                }
            }
        }
        assert_eq!(found, 24, "rotations of a cube");
        // A device that presses to its front: robot z is its -x.
        let front = Axes::new([Axis::PlusZ, Axis::PlusY, Axis::MinusX]).unwrap();
        assert_eq!(
            front.point_from_metres([0.01, 0.0, 0.002]).to_array(),
            [2.0, 0.0, -10.0]
        );
    }
}
