//! How the dent of one press differs from the tip's position and depth.

use skinrig_model::Point2;

use super::light::Vec2;
use super::optics::Optics;

/// Drawn per press, equal for both cameras.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Variation {
    /// Position of the dent from the tip, mm.
    pub(super) offset_mm: Vec2,
    /// Depth of the dent relative to the tip's.
    pub(super) depth: f64,
}

impl Variation {
    /// The dent follows the tip.
    pub(super) const NONE: Self = Self {
        offset_mm: [0.0, 0.0],
        depth: 1.0,
    };

    /// Of the next press at `place`.
    pub(super) fn draw(optics: &Optics, place: Vec2) -> Self {
        let parts = &optics.config.parts;
        if !parts.varies_presses() {
            return Self::NONE;
        }
        let contact = optics.scene.contacts.next(Point2::new(place[0], place[1]));
        let mut random = contact.random(optics.scene.skin_seed);
        // Everything is drawn, so that no part changes what another one draws.
        let [x, y, depth] = [0; 3].map(|_| random.gauss());
        let rank = random.unit();
        let mut found = Self::NONE;
        if let Some(scatter) = parts.press_scatter {
            found.offset_mm = [scatter.offset_mm * x, scatter.offset_mm * y];
            found.depth = (1.0 + scatter.depth * depth).max(0.0);
        }
        if let Some(weak) = parts.weak_presses
            && rank < weak.share
        {
            found.depth *= weak.depth;
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use skinrig_model::CameraId;

    use super::*;
    use crate::optical::tests::scene;
    use crate::optical::{OpticalConfig, Parts};

    fn optics(id: CameraId, parts: Parts) -> Optics {
        let config = OpticalConfig {
            parts,
            ..OpticalConfig::default()
        };
        Optics::new(&scene(id), config)
    }

    #[test]
    fn presses_differ_and_both_cameras_see_the_same_ones() {
        let [one, two] = CameraId::ALL.map(|id| optics(id, Parts::PAPER));
        let draws = |optics: &Optics| [0; 400].map(|_| Variation::draw(optics, [3.0, 4.0]));
        let (one, two) = (draws(&one), draws(&two));
        assert_eq!(one, two);
        assert_ne!(one[0], one[1]);
        let scatter = Parts::PAPER.press_scatter.unwrap();
        let square: f64 = one.iter().map(|v| v.offset_mm[0] * v.offset_mm[0]).sum();
        let sigma_mm = (square / one.len() as f64).sqrt();
        assert!(
            (sigma_mm / scatter.offset_mm - 1.0).abs() < 0.15,
            "{sigma_mm}"
        );
        let weak = one.iter().filter(|v| v.depth < 0.5).count();
        assert!((5..=30).contains(&weak), "{weak} of 400");
    }

    #[test]
    fn without_the_parts_the_dent_follows_the_tip() {
        let optics = optics(CameraId::One, Parts::default());
        assert_eq!(Variation::draw(&optics, [3.0, 4.0]), Variation::NONE);
    }
}
