//! Owns the known ways to write a table of positions in another frame or unit than the skin frame in mm.

use skinrig_model::{Point2, SkinOutline};

use crate::result::{Corner, Fault, FrameChange, Origin, Turn};

/// Factors between common units of length: m and cm for mm, inches, and the reverse.
const FACTORS: [f64; 6] = [1e-3, 0.1, 1.0 / 25.4, 1e3, 10.0, 25.4];

/// A transform from positions of the table to the skin frame.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Frame {
    /// Fault of the table.
    pub fault: Fault,
    /// What it is.
    pub change: FrameChange,
    /// `[[xx, xy], [yx, yy]]`: rotation, mirroring and scale about `about`.
    matrix: [[f64; 2]; 2],
    about: Point2,
    /// Offset added afterwards, mm.
    by: [f64; 2],
}

impl Frame {
    /// Transforms a position to the skin frame.
    pub(super) fn skin(&self, p: Point2) -> Point2 {
        let (x, y) = (p.x_mm - self.about.x_mm, p.y_mm - self.about.y_mm);
        let [[xx, xy], [yx, yy]] = self.matrix;
        Point2::new(
            self.about.x_mm + xx * x + xy * y + self.by[0],
            self.about.y_mm + yx * x + yy * y + self.by[1],
        )
    }

    /// A table displaced by this offset.
    pub(super) fn displaced(by: [f64; 2]) -> Self {
        Self {
            fault: Fault::PositionsDisplaced,
            change: FrameChange::Displaced { by_mm: by },
            matrix: [[1.0, 0.0], [0.0, 1.0]],
            about: Point2::default(),
            by,
        }
    }

    /// A table to be multiplied by these factors along x and y about a point.
    pub(super) fn stretched([x, y]: [f64; 2], about: Origin, point: Point2) -> Self {
        Self {
            fault: Fault::UnitOfPositions,
            change: FrameChange::Stretched {
                factors: [x, y],
                about,
            },
            matrix: [[x, 0.0], [0.0, y]],
            about: point,
            by: [0.0; 2],
        }
    }

    /// All known transforms, about 0 and about the middle of the skin.
    pub(super) fn all(outline: &SkinOutline) -> Vec<Self> {
        let centre = outline.centre;
        let mut all = Vec::new();
        for (about, origin) in [(Point2::default(), Origin::Zero), (centre, Origin::Centre)] {
            for (fault, turn, matrix) in TURNS {
                all.push(Self {
                    fault,
                    change: FrameChange::Turned {
                        turn,
                        about: origin,
                    },
                    matrix,
                    about,
                    by: [0.0; 2],
                });
            }
        }
        for factor in FACTORS {
            all.push(Self {
                fault: Fault::UnitOfPositions,
                change: FrameChange::Scaled { factor },
                matrix: [[factor, 0.0], [0.0, factor]],
                about: Point2::default(),
                by: [0.0; 2],
            });
        }
        let corner = Point2::new(
            centre.x_mm - 0.5 * outline.width_mm,
            centre.y_mm - 0.5 * outline.height_mm,
        );
        for (at, origin) in [(centre, Corner::Centre), (corner, Corner::LowerLeft)] {
            for (sign, is_added) in [(1.0, true), (-1.0, false)] {
                let by = [sign * at.x_mm, sign * at.y_mm];
                all.push(Self {
                    change: FrameChange::OtherOrigin { origin, is_added },
                    ..Self::displaced(by)
                });
            }
        }
        all
    }
}

/// Reflections and rotations among the eight symmetries of the square.
const TURNS: [(Fault, Turn, [[f64; 2]; 2]); 7] = [
    (
        Fault::AxisMirrored,
        Turn::XMirrored,
        [[-1.0, 0.0], [0.0, 1.0]],
    ),
    (
        Fault::AxisMirrored,
        Turn::YMirrored,
        [[1.0, 0.0], [0.0, -1.0]],
    ),
    (
        Fault::AxisMirrored,
        Turn::BothMirrored,
        [[-1.0, 0.0], [0.0, -1.0]],
    ),
    (
        Fault::AxesExchanged,
        Turn::Exchanged,
        [[0.0, 1.0], [1.0, 0.0]],
    ),
    (
        Fault::AxesExchanged,
        Turn::ExchangedMirrored,
        [[0.0, -1.0], [-1.0, 0.0]],
    ),
    (
        Fault::AxesExchanged,
        Turn::Quarter,
        [[0.0, -1.0], [1.0, 0.0]],
    ),
    (
        Fault::AxesExchanged,
        Turn::QuarterBack,
        [[0.0, 1.0], [-1.0, 0.0]],
    ),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_way_but_the_displaced_leaves_its_fixed_point_and_none_is_the_table_itself() {
        let all = Frame::all(&SkinOutline::PAPER);
        let at = Point2::new(-13.0, 7.0);
        for frame in &all {
            assert!(frame.skin(at).distance_mm(at) > 1.0, "{frame:?}");
            if frame.fault != Fault::PositionsDisplaced {
                assert!(frame.skin(frame.about).distance_mm(frame.about) < 1e-12);
            }
        }
        let turned = Frame {
            about: Point2::default(),
            ..all[5].clone()
        };
        assert_eq!(turned.skin(Point2::new(1.0, 0.0)), Point2::new(0.0, 1.0));
    }
}
