//! The moments of a press relative to its press time.

use serde::Serialize;
use skinrig_model::{HostDuration, HostTime, PressTiming};
use skinrig_settings::{Collector, Field, Settings, ValueRange};

/// A moment relative to the press time, s; may be before it.
const MOMENT_S: ValueRange = ValueRange::between(-3600.0, 3600.0);

/// Least time at depth and of the way up: what tells these moments apart needs it.
const LEAST: HostDuration = HostDuration::from_millis(10);

/// The moments of a press relative to its press time, in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Settings)]
#[settings(name = "phases", parts = PhaseParts)]
pub struct PressPhases {
    /// The downward motion begins.
    #[setting(range = MOMENT_S, example = "-275 ms")]
    pub approach: HostDuration,
    /// The tip reaches the surface.
    #[setting(range = MOMENT_S, example = "-100 ms")]
    pub contact: HostDuration,
    /// The tip settled at its depth.
    #[setting(range = MOMENT_S, example = "0 ms")]
    pub at_depth: HostDuration,
    /// The upward motion begins.
    #[setting(range = MOMENT_S, example = "150 ms")]
    pub retract: HostDuration,
    /// The tip leaves the surface.
    #[setting(range = MOMENT_S, example = "250 ms")]
    pub release: HostDuration,
    /// The tip is back at clearance height.
    #[setting(range = MOMENT_S, example = "425 ms")]
    pub clear: HostDuration,
}

fn ms(moment: HostDuration) -> f64 {
    moment.0 as f64 / 1e6
}

impl PressPhases {
    /// The moments of a press from the start of its downward motion, as host times from 0.
    #[must_use]
    pub fn since_approach(&self) -> PressTiming {
        let at = |moment: HostDuration| HostTime(moment.0 - self.approach.0);
        PressTiming {
            approach: at(self.approach),
            contact: at(self.contact),
            at_depth: at(self.at_depth),
            retract: at(self.retract),
            release: at(self.release),
            clear: at(self.clear),
        }
    }

    /// From the start of the downward motion to the return to clearance height, s.
    pub(crate) fn length_s(&self) -> f64 {
        self.clear.as_secs_f64() - self.approach.as_secs_f64()
    }

    /// The moments of the press at `t`.
    #[must_use]
    pub fn at(&self, t: HostTime) -> PressTiming {
        PressTiming {
            approach: t + self.approach,
            contact: t + self.contact,
            at_depth: t + self.at_depth,
            retract: t + self.retract,
            release: t + self.release,
            clear: t + self.clear,
        }
    }

    /// Checks that the moments of the mapping `field` are in order.
    pub(crate) fn check_order(field: &Field, out: &mut Collector) {
        let parts = Self::read_parts(field, &mut Collector::default());
        let moments = [
            ("approach", parts.approach),
            ("contact", parts.contact),
            ("at_depth", parts.at_depth),
            ("retract", parts.retract),
            ("release", parts.release),
            ("clear", parts.clear),
        ];
        for pair in moments.windows(2) {
            if let [(earlier, Some(a)), (later, Some(b))] = pair
                && a >= b
            {
                let at = field.at(later);
                out.error(
                    at.span,
                    at.path.as_str(),
                    "the moments of a press are out of order",
                )
                .expected(format!("after `{earlier}`, {} s", a.as_secs_f64()))
                .found(format!("{} s", b.as_secs_f64()));
            } else if let [
                (earlier @ ("at_depth" | "retract"), Some(a)),
                (later, Some(b)),
            ] = pair
                && b.0 - a.0 < LEAST.0
            {
                let at = field.at(later);
                out.error(
                    at.span,
                    at.path.as_str(),
                    "the moments of a press are too close together",
                )
                .expected(format!(
                    "at least {} ms, {} ms after `{earlier}`",
                    ms(*a + LEAST),
                    ms(LEAST)
                ))
                .found(format!("{} ms", ms(*b)));
            }
        }
    }
}
