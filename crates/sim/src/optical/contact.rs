//! Depth of one indentation over time, with creep and latency.

use super::config::OpticalConfig;
use crate::scene::GRID_NS;

/// Depth below which a relaxing dent counts as gone, mm: no pixel can detect it.
const GONE_MM: f64 = 1e-5;

/// The part of the creep and of the latency that fall into one grid step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Relaxation {
    creep: f64,
    step: f64,
    late: f64,
}

impl Relaxation {
    pub(super) fn new(config: &OpticalConfig) -> Self {
        Self {
            creep: config.creep_fraction,
            step: -libm::expm1(-(GRID_NS as f64 * 1e-6) / config.creep_time_ms),
            late: f64::from(config.latency_us) / (GRID_NS as f64 * 1e-3),
        }
    }
}

/// Depth of an indentation. The optical effect of a held depth `d` is `(1 - creep) d + creep m` with
/// `m' = (d - m) / tau`: the standard linear solid, driven by depth.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Contact {
    /// Depth of the tip, mm.
    depth_mm: f64,
    /// The creeping part `m`, mm.
    memory_mm: f64,
    /// The effective depth, mm.
    effect_mm: f64,
    /// The effective depth as pixels see it, after their latency, mm: before and after the step.
    pub(super) seen_mm: [f64; 2],
}

impl Contact {
    /// Moves the tip to `depth_mm` during one grid step.
    pub(super) fn follow(&mut self, depth_mm: f64, relaxation: Relaxation) {
        let Relaxation { creep, step, late } = relaxation;
        self.depth_mm = depth_mm;
        self.memory_mm += (depth_mm - self.memory_mm) * step;
        if depth_mm == 0.0 && self.memory_mm < GONE_MM {
            self.memory_mm = 0.0;
        }
        let effect_mm = (1.0 - creep) * depth_mm + creep * self.memory_mm;
        let seen_mm = effect_mm - (effect_mm - self.effect_mm) * late;
        self.seen_mm = [self.seen_mm[1], seen_mm];
        self.effect_mm = effect_mm;
    }

    /// Whether the tip is on the skin.
    pub(super) const fn is_held(&self) -> bool {
        self.depth_mm > 0.0
    }

    /// Whether pixels see nothing of the dent before and after the step.
    pub(super) fn is_unseen(&self) -> bool {
        self.seen_mm == [0.0; 2]
    }

    /// Whether the tip has left and nothing of the dent remains.
    pub(super) fn is_gone(&self) -> bool {
        self.depth_mm == 0.0 && self.memory_mm == 0.0 && self.is_unseen()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dent_that_is_left_relaxes_until_it_is_gone() {
        let config = OpticalConfig::default();
        let relaxation = Relaxation::new(&config);
        let mut contact = Contact::default();
        for _ in 0..20_000 {
            contact.follow(2.0, relaxation);
        }
        assert!((contact.seen_mm[1] - 2.0).abs() < 1e-9 && contact.is_held());
        // Released: the creeping part remains and decays with its time constant.
        for _ in 0..700 {
            contact.follow(0.0, relaxation);
        }
        let expected = 2.0 * config.creep_fraction * libm::exp(-1.0);
        assert!((contact.seen_mm[1] / expected - 1.0).abs() < 1e-3);
        for _ in 0..20_000 {
            assert!(!contact.is_held());
            contact.follow(0.0, relaxation);
        }
        assert!(contact.is_gone());
    }
}
