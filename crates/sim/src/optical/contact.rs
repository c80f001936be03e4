//! Depth of one indentation over time, with creep and latency.

use super::config::OpticalConfig;
use crate::scene::GRID_NS;

/// Depth below which a relaxing dent counts as gone, mm: no pixel can detect it.
const GONE_MM: f64 = 1e-5;
/// The same for its slow part, of which each dent would otherwise be followed for ten time constants.
const SLOWLY_GONE_MM: f64 = 1e-3;

/// The part of the creep and of the latency that fall into one grid step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Relaxation {
    creep: f64,
    step: f64,
    slow: f64,
    slow_step: f64,
    late: f64,
}

impl Relaxation {
    pub(super) fn new(config: &OpticalConfig) -> Self {
        let step = |time_ms: f64| -libm::expm1(-(GRID_NS as f64 * 1e-6) / time_ms);
        let slow = config.parts.slow_recovery;
        Self {
            creep: config.creep_fraction,
            step: step(config.creep_time_ms),
            slow: slow.map_or(0.0, |s| s.fraction),
            slow_step: slow.map_or(0.0, |s| step(s.time_ms)),
            late: f64::from(config.latency_us) / (GRID_NS as f64 * 1e-3),
        }
    }
}

/// Depth of an indentation. The optical effect of a held depth `d` is `(1 - creep) d + creep m` with
/// `m' = (d - m) / tau`: the standard linear solid, driven by depth. After that, a slow
/// part of the deepest dent remains and fades.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Contact {
    /// Depth of the tip, mm.
    depth_mm: f64,
    /// The creeping part `m`, mm.
    memory_mm: f64,
    /// The dent that remains, mm.
    slow_mm: f64,
    /// The effective depth, mm.
    effect_mm: f64,
    /// The effective depth as pixels see it, after their latency, mm: before and after the step.
    pub(super) seen_mm: [f64; 2],
}

impl Contact {
    /// Moves the tip to `depth_mm` during one grid step.
    pub(super) fn follow(&mut self, depth_mm: f64, relaxation: Relaxation) {
        let Relaxation {
            creep,
            step,
            slow,
            slow_step,
            late,
        } = relaxation;
        self.depth_mm = depth_mm;
        self.memory_mm += (depth_mm - self.memory_mm) * step;
        if depth_mm == 0.0 && self.memory_mm < GONE_MM {
            self.memory_mm = 0.0;
        }
        let mut effect_mm = (1.0 - creep) * depth_mm + creep * self.memory_mm;
        if slow > 0.0 {
            // The skin follows the tip down at once, and the rest of the dent recovers slowly.
            self.slow_mm -= self.slow_mm * slow_step;
            self.slow_mm = self.slow_mm.max(slow * depth_mm);
            if depth_mm == 0.0 && self.slow_mm < SLOWLY_GONE_MM {
                self.slow_mm = 0.0;
            }
            effect_mm = effect_mm.max(self.slow_mm);
        }
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
        self.depth_mm == 0.0 && self.memory_mm == 0.0 && self.slow_mm == 0.0 && self.is_unseen()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optical::Parts;

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
    #[test]
    fn a_slow_part_of_the_deepest_dent_remains_and_fades() {
        let config = OpticalConfig {
            parts: Parts::PAPER,
            ..OpticalConfig::default()
        };
        let slow = config.parts.slow_recovery.unwrap();
        let relaxation = Relaxation::new(&config);
        let mut contact = Contact::default();
        (0..200).for_each(|_| contact.follow(2.0, relaxation));
        let held_mm = contact.seen_mm[1];
        (0..4_000).for_each(|_| contact.follow(0.0, relaxation));
        let expected = 2.0 * slow.fraction * libm::exp(-4_000.0 / slow.time_ms);
        assert!((contact.seen_mm[1] / expected - 1.0).abs() < 1e-2);
        // The skin follows the tip as before.
        let mut plain = Contact::default();
        let relaxation = Relaxation::new(&OpticalConfig::default());
        (0..200).for_each(|_| plain.follow(2.0, relaxation));
        assert!((plain.seen_mm[1] - held_mm).abs() < 1e-12);
        assert!(!contact.is_gone());
        (0..30_000).for_each(|_| contact.follow(0.0, Relaxation::new(&config)));
        assert!(contact.is_gone());
    }
}
