//! Polarity of the events around the contact and the lift of presses.

use serde::Serialize;
use skinrig_model::CdEvent;

/// Events count from the contact or the lift on for this long, µs.
const AFTER_US: u64 = 200_000;

/// Events in the 200 ms from each contact, and from each start of the upward motion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PressPolarity {
    /// Presses.
    pub presses: u64,
    /// Events from a contact on.
    pub at_press: u64,
    /// Share of ON events among them.
    pub on_at_press: Option<f64>,
    /// Events from a lift on.
    pub at_lift: u64,
    /// Share of ON events among them.
    pub on_at_lift: Option<f64>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Count {
    events: u64,
    on: u64,
}

impl Count {
    fn share(self) -> Option<f64> {
        (self.events > 0).then(|| self.on as f64 / self.events as f64)
    }
}

/// Counts them.
#[derive(Debug)]
pub(super) struct PolarityCounter {
    /// Start of each window on the clock of the camera, µs, in order; true at a lift.
    starts: Vec<(u64, bool)>,
    presses: u64,
    /// From contacts, and from lifts.
    counts: [Count; 2],
}

impl PolarityCounter {
    pub(super) fn new(presses: &[(f64, f64)]) -> Self {
        let mut starts: Vec<(u64, bool)> = presses
            .iter()
            .flat_map(|(contact_us, lift_us)| {
                [(contact_us, false), (lift_us, true)]
                    .map(|(us, is_lift)| (us.max(0.0) as u64, is_lift))
            })
            .collect();
        starts.sort_unstable();
        Self {
            starts,
            presses: presses.len() as u64,
            counts: [Count::default(); 2],
        }
    }

    pub(super) fn add(&mut self, event: &CdEvent) {
        // The last window that began; most events lie in none, or in the same as the one before.
        let next = self.starts.partition_point(|(us, _)| *us <= event.t_us);
        let Some((start_us, is_lift)) = next.checked_sub(1).map(|at| self.starts[at]) else {
            return;
        };
        if event.t_us - start_us < AFTER_US {
            let count = &mut self.counts[usize::from(is_lift)];
            count.events += 1;
            count.on += u64::from(event.polarity.bit());
        }
    }

    /// `None` without presses.
    pub(super) fn polarity(&self) -> Option<PressPolarity> {
        let [press, lift] = self.counts;
        (self.presses > 0).then(|| PressPolarity {
            presses: self.presses,
            at_press: press.events,
            on_at_press: press.share(),
            at_lift: lift.events,
            on_at_lift: lift.share(),
        })
    }
}
