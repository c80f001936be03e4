//! Whether the tip goes in or out: the polarity of recent events, beside that of earlier ones in the same blocks of pixels.

use skinrig_analysis::press_events::PackedEvent;

use crate::regions::{REGIONS, block};

/// Number of blocks.
const BLOCKS: usize = REGIONS / 2;

/// Agreement of recent events with earlier ones.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Agreement {
    /// Sum over blocks of ON minus OFF events, earlier times recent.
    sum: f64,
    /// Its variance if the recent polarities were fair coins.
    variance: f64,
}

impl Agreement {
    /// Of the events of one camera.
    pub(crate) fn of(earlier: &[PackedEvent], recent: &[PackedEvent]) -> Self {
        let mut went = [0_i32; BLOCKS];
        for (block, sign) in earlier.iter().filter_map(signed) {
            went[block] += sign;
        }
        let (mut sum, mut variance) = (0.0, 0.0);
        for (block, sign) in recent.iter().filter_map(signed) {
            let earlier = f64::from(went[block]);
            sum += earlier * f64::from(sign);
            variance += earlier * earlier;
        }
        Self { sum, variance }
    }

    /// Of both cameras.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            sum: self.sum + other.sum,
            variance: self.variance + other.variance,
        }
    }

    /// Standard deviations by which the recent events are those of the opposite motion.
    pub(crate) fn reversal(self) -> f64 {
        if self.variance > 0.0 {
            -self.sum / libm::sqrt(self.variance)
        } else {
            0.0
        }
    }
}

fn signed(event: &PackedEvent) -> Option<(usize, i32)> {
    let sign = if event.is_on() { 1 } else { -1 };
    Some((block(event.x(), event.y())?, sign))
}

#[cfg(test)]
mod tests {
    use skinrig_model::{CdEvent, Polarity};

    use super::*;

    fn events(n: u64, at: [u16; 2], polarity: Polarity) -> Vec<PackedEvent> {
        let [x, y] = at;
        let event = |t_us| CdEvent {
            t_us,
            x,
            y,
            polarity,
        };
        let packed = (0..n).filter_map(|t_us| PackedEvent::pack(&event(t_us), 0));
        packed.collect()
    }

    #[test]
    fn the_opposite_polarity_in_the_same_place_is_the_way_back() {
        use Polarity::{Off, On};
        let bright = events(60, [100, 100], On);
        let dark = events(60, [300, 200], Off);
        let down = [bright.clone(), dark.clone()].concat();
        let back = [events(10, [100, 100], Off), events(10, [300, 200], On)].concat();
        let reversal = |recent: &[PackedEvent]| Agreement::of(&down, recent).reversal();
        assert!(reversal(&back) > 4.0);
        assert!(reversal(&down) < -4.0);
        // Elsewhere, or of both polarities: no direction.
        assert_eq!(reversal(&events(50, [600, 400], Off)), 0.0);
        assert_eq!(
            reversal(&[&back[..], &down[..10], &dark[..10]].concat()),
            0.0
        );
        assert_eq!(Agreement::default().reversal(), 0.0);
    }
}
