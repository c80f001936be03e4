//! Depth and position of one tip's indentation, with creep and latency.

use skinrig_model::Point2;

use super::config::OpticalConfig;
use super::light::Vec2;
use super::pixels::Ramp;
use crate::scene::{GRID_NS, SceneConfig};

/// Depth below which a relaxing dent is dropped, mm: no pixel can detect it.
const GONE_MM: f64 = 1e-5;

/// Depth and position of the indentation. The optical effect of a held depth `d` is
/// `(1 - creep) d + creep m` with `m' = (d - m) / tau`: the standard linear solid, driven by depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Contact {
    /// Position of first touch.
    pub(super) place: Vec2,
    /// Depth of the tip, mm.
    depth_mm: f64,
    /// The creeping part `m`, mm.
    memory_mm: f64,
    /// The effective depth, mm.
    effect_mm: f64,
    /// The effective depth as pixels see it, after their latency, mm.
    seen_mm: f64,
}

impl Contact {
    /// No indentation.
    pub(super) const fn none(scene: &SceneConfig) -> Self {
        Self {
            place: [scene.outline.centre.x_mm, scene.outline.centre.y_mm],
            depth_mm: 0.0,
            memory_mm: 0.0,
            effect_mm: 0.0,
            seen_mm: 0.0,
        }
    }

    /// Part of the creep that happens in one grid step.
    pub(super) fn creep_step(config: &OpticalConfig) -> f64 {
        -libm::expm1(-(GRID_NS as f64 * 1e-6) / config.creep_time_ms)
    }

    /// Moves the tip to `[x, y, z]` mm during the grid step from `t_ns`. Returns the depth that pixels see, and whether the
    /// dent is at a new place.
    pub(super) fn indent(
        &mut self,
        scene: &SceneConfig,
        config: &OpticalConfig,
        creep_step: f64,
        t_ns: i64,
        [x, y, z]: [f64; 3],
    ) -> (Ramp, bool) {
        // The base is rigid: the depth is limited to the skin's thickness.
        let on_skin = z < 0.0 && scene.outline.contains(Point2::new(x, y));
        let depth_mm = if on_skin {
            (-z).min(scene.skin_thickness_mm)
        } else {
            0.0
        };
        let (dx, dy) = (x - self.place[0], y - self.place[1]);
        let elsewhere = dx * dx + dy * dy > config.same_place_mm * config.same_place_mm;
        let moved = depth_mm > 0.0 && elsewhere;
        if moved {
            if self.depth_mm == 0.0 {
                // A new touch; the remainder of the previous dent is dropped.
                (self.memory_mm, self.effect_mm, self.seen_mm) = (0.0, 0.0, 0.0);
            }
            self.place = [x, y];
        }
        self.depth_mm = depth_mm;
        self.memory_mm += (depth_mm - self.memory_mm) * creep_step;
        if depth_mm == 0.0 && self.memory_mm < GONE_MM {
            self.memory_mm = 0.0;
        }
        let creep = config.creep_fraction;
        let effect_mm = (1.0 - creep) * depth_mm + creep * self.memory_mm;
        let late = f64::from(config.latency_us) / (GRID_NS as f64 * 1e-3);
        let seen_mm = effect_mm - (effect_mm - self.effect_mm) * late;
        let ramp = Ramp {
            t_ns,
            from_mm: self.seen_mm,
            to_mm: seen_mm,
        };
        (self.effect_mm, self.seen_mm) = (effect_mm, seen_mm);
        (ramp, moved)
    }
}
