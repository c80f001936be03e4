//! Lenses: how a column's distance from the middle of the sensor becomes an angle from the optical axis.
//!
//! The paper's lens (section "Geometric Triangulation", constants of the public code) is
//! `theta = s * H * exp(-W |s|)`. The others are the classical projections of fisheye and pinhole lenses, each with
//! one coefficient of radial distortion, `s' = s (1 + W (s² - 1))`: the sensor's edge keeps its angle, so that the
//! half field of view H and W describe different things.

use serde::{Deserialize, Serialize};
use skinrig_settings::Choice;

/// Projection from a column to an angle before distortion. See [`LensModel`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, Choice)]
#[serde(rename_all = "snake_case")]
pub enum LensKind {
    /// The paper's: equidistant with an exponential falloff.
    #[default]
    Exponential,
    /// Angle proportional to the distance from the middle (f-theta).
    Equidistant,
    /// Pinhole: tangent of the angle proportional to the distance.
    Rectilinear,
    /// Tangent of half the angle proportional to the distance.
    Stereographic,
    /// Sine of half the angle proportional to the distance.
    Equisolid,
}

/// A lens: its projection, half of its horizontal field of view and its distortion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "lens", rename_all = "snake_case")]
pub enum LensModel {
    /// The paper's: `theta = s * H * exp(-W |s|)`. Increasing on the sensor for `W < 1`; `|W| < 1` is the range of
    /// the public code. The sensor's edge is at `H * exp(-W)`.
    Exponential {
        /// The half field of view H of the undistorted lens, degrees (paper: 60).
        half_fov_deg: f64,
        /// Distortion `W`, dimensionless.
        w: f64,
    },
    /// f-theta: `theta = s' * H`.
    Equidistant {
        /// Angle of the sensor's edge, degrees, above 0 and below 180.
        half_fov_deg: f64,
        /// Distortion, dimensionless; increasing on the sensor for -0.5 < W < 1.
        w: f64,
    },
    /// Pinhole: `tan theta = s' * tan H`.
    Rectilinear {
        /// Angle of the sensor's edge, degrees, above 0 and below 90.
        half_fov_deg: f64,
        /// Distortion, as of [`Self::Equidistant`].
        w: f64,
    },
    /// `tan(theta / 2) = s' * tan(H / 2)`.
    Stereographic {
        /// Angle of the sensor's edge, degrees, above 0 and below 180.
        half_fov_deg: f64,
        /// Distortion, as of [`Self::Equidistant`].
        w: f64,
    },
    /// `sin(theta / 2) = s' * sin(H / 2)`.
    Equisolid {
        /// Angle of the sensor's edge, degrees, above 0 and below 180.
        half_fov_deg: f64,
        /// Distortion, as of [`Self::Equidistant`].
        w: f64,
    },
}

/// The angle of a column and its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LensAngle {
    /// Angle from the optical axis, degrees; NaN if undefined.
    pub deg: f64,
    /// By `s`, degrees.
    pub by_s: f64,
    /// By the distortion W, degrees.
    pub by_w: f64,
    /// By the half field of view, degrees per degree.
    pub by_half_fov: f64,
}

impl LensModel {
    /// The lens of this kind.
    #[must_use]
    pub const fn new(kind: LensKind, half_fov_deg: f64, w: f64) -> Self {
        match kind {
            LensKind::Exponential => Self::Exponential { half_fov_deg, w },
            LensKind::Equidistant => Self::Equidistant { half_fov_deg, w },
            LensKind::Rectilinear => Self::Rectilinear { half_fov_deg, w },
            LensKind::Stereographic => Self::Stereographic { half_fov_deg, w },
            LensKind::Equisolid => Self::Equisolid { half_fov_deg, w },
        }
    }

    /// Its projection.
    #[must_use]
    pub const fn kind(&self) -> LensKind {
        match self {
            Self::Exponential { .. } => LensKind::Exponential,
            Self::Equidistant { .. } => LensKind::Equidistant,
            Self::Rectilinear { .. } => LensKind::Rectilinear,
            Self::Stereographic { .. } => LensKind::Stereographic,
            Self::Equisolid { .. } => LensKind::Equisolid,
        }
    }

    /// Half field of view, degrees, and distortion W.
    #[must_use]
    pub const fn coefficients(&self) -> (f64, f64) {
        match *self {
            Self::Exponential { half_fov_deg, w }
            | Self::Equidistant { half_fov_deg, w }
            | Self::Rectilinear { half_fov_deg, w }
            | Self::Stereographic { half_fov_deg, w }
            | Self::Equisolid { half_fov_deg, w } => (half_fov_deg, w),
        }
    }

    /// The same projection with other coefficients.
    #[must_use]
    pub const fn with(&self, half_fov_deg: f64, w: f64) -> Self {
        Self::new(self.kind(), half_fov_deg, w)
    }

    /// A lens of this kind: itself, or the undistorted one with the same angle at the sensor's edge.
    #[must_use]
    pub fn as_kind(&self, kind: LensKind) -> Self {
        if self.kind() == kind {
            *self
        } else {
            Self::new(kind, self.angle(1.0).deg, 0.0)
        }
    }

    /// True if the coefficients are within the range in which the angle grows with the column everywhere on the
    /// sensor, so that the lens can be inverted. The variants state their ranges.
    #[must_use]
    pub fn is_monotone(&self) -> bool {
        let (half_fov_deg, w) = self.coefficients();
        match self.kind() {
            LensKind::Exponential => {
                w.abs() < 1.0 && half_fov_deg > 0.0 && half_fov_deg.is_finite()
            }
            LensKind::Rectilinear => in_range(half_fov_deg, w, 90.0),
            LensKind::Equidistant | LensKind::Stereographic | LensKind::Equisolid => {
                in_range(half_fov_deg, w, 180.0)
            }
        }
    }

    /// Angle from the optical axis at `s` in -1..=1 (the sensor's edges), with its derivatives.
    #[must_use]
    pub fn angle(&self, s: f64) -> LensAngle {
        let (half_fov_deg, w) = self.coefficients();
        let kind = self.kind();
        if kind == LensKind::Exponential {
            let falloff = libm::exp(-w * s.abs());
            let deg = s * half_fov_deg * falloff;
            return LensAngle {
                deg,
                by_s: half_fov_deg * falloff * (1.0 - w * s.abs()),
                by_w: -s.abs() * deg,
                by_half_fov: s * falloff,
            };
        }
        // theta = f(s' g(H)): `slope` is f'(s' g), `scale` is g and `by_edge` its derivative by H.
        let bent = s * (1.0 + w * (s * s - 1.0));
        let half_fov = half_fov_deg.to_radians();
        let (theta, slope, scale, by_edge) = match kind {
            LensKind::Rectilinear => {
                let (sin, cos) = libm::sincos(half_fov);
                let x = bent * (sin / cos);
                let by_edge = 1.0 / (cos * cos);
                (libm::atan(x), 1.0 / (1.0 + x * x), sin / cos, by_edge)
            }
            LensKind::Stereographic => {
                let (sin, cos) = libm::sincos(0.5 * half_fov);
                let x = bent * (sin / cos);
                let by_edge = 0.5 / (cos * cos);
                (2.0 * libm::atan(x), 2.0 / (1.0 + x * x), sin / cos, by_edge)
            }
            LensKind::Equisolid => {
                let (sin, cos) = libm::sincos(0.5 * half_fov);
                let x = bent * sin;
                let slope = 2.0 / (1.0 - x * x).sqrt();
                (2.0 * libm::asin(x), slope, sin, 0.5 * cos)
            }
            LensKind::Equidistant | LensKind::Exponential => (bent * half_fov, 1.0, half_fov, 1.0),
        };
        LensAngle {
            deg: theta.to_degrees(),
            by_s: (slope * scale * (1.0 + w * (3.0 * s * s - 1.0))).to_degrees(),
            by_w: (slope * scale * s * (s * s - 1.0)).to_degrees(),
            by_half_fov: slope * by_edge * bent,
        }
    }

    /// Angle from the optical axis at `s` in -1..=1 (the sensor's edges), degrees, and its derivative by `s`.
    #[must_use]
    pub fn angle_deg(&self, s: f64) -> (f64, f64) {
        let angle = self.angle(s);
        (angle.deg, angle.by_s)
    }
}

fn in_range(half_fov_deg: f64, w: f64, limit_deg: f64) -> bool {
    half_fov_deg > 0.0 && half_fov_deg < limit_deg && w > -0.5 && w < 1.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const KINDS: [LensKind; 5] = [
        LensKind::Exponential,
        LensKind::Equidistant,
        LensKind::Rectilinear,
        LensKind::Stereographic,
        LensKind::Equisolid,
    ];

    #[test]
    fn the_projections_match_the_textbook() {
        // Halfway to an edge of 60°: 60/2, atan(tan 60 / 2), 2 atan(tan 30 / 2), 2 asin(sin 30 / 2).
        let expected = [30.0, 30.0, 40.893_394_649, 32.204_227_504, 28.955_024_372];
        for (kind, expected) in KINDS.into_iter().zip(expected) {
            let lens = LensModel::new(kind, 60.0, 0.0);
            assert!((lens.angle(0.5).deg - expected).abs() < 1e-8, "{kind:?}");
            assert!((lens.angle(-1.0).deg + 60.0).abs() < 1e-12, "{kind:?}");
        }
    }

    #[test]
    fn the_stored_form_of_the_papers_lens_is_unchanged() {
        let lens = LensModel::new(LensKind::Exponential, 60.0, -0.17);
        let stored = r#"{"lens":"exponential","half_fov_deg":60.0,"w":-0.17}"#;
        assert_eq!(serde_json::to_string(&lens).unwrap(), stored);
        assert_eq!(serde_json::from_str::<LensModel>(stored).unwrap(), lens);
    }

    #[test]
    fn another_kind_keeps_the_edge() {
        let lens = LensModel::new(LensKind::Exponential, 60.0, 0.1);
        for kind in KINDS {
            let other = lens.as_kind(kind);
            assert_eq!(other.kind(), kind);
            assert!((other.angle(1.0).deg - lens.angle(1.0).deg).abs() < 1e-12);
        }
        assert_eq!(lens.as_kind(LensKind::Exponential), lens);
    }

    #[test]
    fn the_range_ends_where_the_angle_turns_back() {
        for kind in KINDS {
            let steep = |w: f64| {
                let lens = LensModel::new(kind, 60.0, w);
                let turns = (0..=1000).any(|i| lens.angle(f64::from(i) * 1e-3).by_s <= 0.0);
                (lens.is_monotone(), turns)
            };
            let low = if kind == LensKind::Exponential {
                -0.99
            } else {
                -0.49
            };
            assert_eq!(steep(0.99), (true, false), "{kind:?}");
            assert_eq!(steep(low), (true, false), "{kind:?}");
            assert_eq!(steep(1.01), (false, true), "{kind:?}");
            if kind != LensKind::Exponential {
                assert_eq!(steep(-0.51), (false, true), "{kind:?}");
            }
            assert!(!LensModel::new(kind, f64::NAN, 0.0).is_monotone());
            assert!(!LensModel::new(kind, 60.0, f64::NAN).is_monotone());
        }
        assert!(!LensModel::new(LensKind::Rectilinear, 90.0, 0.0).is_monotone());
    }

    proptest! {
        #[test]
        fn the_derivatives_are_the_slopes(
            s in -1.0f64..1.0, h in 20.0f64..80.0, w in -0.45f64..0.9, kind in 0usize..5,
        ) {
            let at = |s: f64, h: f64, w: f64| LensModel::new(KINDS[kind], h, w).angle(s);
            let value = at(s, h, w);
            let d = 1e-6;
            let slope = |up: LensAngle, down: LensAngle| (up.deg - down.deg) / (2.0 * d);
            // The exponential lens has a kink in its second derivative at 0, the others none.
            prop_assert!((slope(at(s + d, h, w), at(s - d, h, w)) - value.by_s).abs() < 1e-3);
            prop_assert!((slope(at(s, h, w + d), at(s, h, w - d)) - value.by_w).abs() < 1e-5);
            prop_assert!((slope(at(s, h + d, w), at(s, h - d, w)) - value.by_half_fov).abs() < 1e-6);
        }
    }
}
