//! Converts box times to host times with guaranteed bounds, from time exchanges.
//!
//! In each exchange the box's clock had the value `at` at some time between `sent` and `received` of the host. With a bound on the rate
//! of the box's clock, an exchange bounds the host time of any box time; the bounds widen with the distance. The bounds of all recent
//! exchanges hold together, so the tightest ones apply (Cristian, "Probabilistic clock synchronization", Distributed Computing 3, 1989).

use std::collections::VecDeque;

use skinrig_model::HostTime;

use crate::protocol::{TICKS_PER_US, Ticks};

/// Number of recent exchanges in use.
const WINDOW: usize = 32;

/// One exchange: `sent <= host time of at <= received`.
#[derive(Debug, Clone, Copy)]
pub struct Exchange {
    /// Before the request was sent.
    pub sent: HostTime,
    /// After the reply was received.
    pub received: HostTime,
    /// Value of the box's clock in between.
    pub at: Ticks,
}

/// An interval of host time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bounds {
    /// Lower bound.
    pub low: HostTime,
    /// Upper bound.
    pub high: HostTime,
}

impl Bounds {
    /// Middle and half width, rounded up, ns.
    #[must_use]
    pub fn middle(self) -> (HostTime, i64) {
        let width = self.high.0 - self.low.0;
        (
            HostTime(self.low.0 + width.div_euclid(2)),
            width - width.div_euclid(2),
        )
    }
}

/// Recent exchanges since the box's reset.
#[derive(Debug)]
pub struct HostFromBox {
    recent: VecDeque<Exchange>,
    max_drift_ppm: f64,
    contradictions: u64,
}

impl HostFromBox {
    /// For a box whose clock deviates by at most `max_drift_ppm` from the host's.
    #[must_use]
    pub fn new(max_drift_ppm: f64) -> Self {
        Self {
            recent: VecDeque::with_capacity(WINDOW),
            max_drift_ppm,
            contradictions: 0,
        }
    }

    /// Removes all exchanges: the box's clock was reset.
    pub fn clear(&mut self) {
        self.recent.clear();
    }

    /// Number of contradictions between exchanges: the clock drifts more than configured.
    #[must_use]
    pub(crate) fn contradictions(&self) -> u64 {
        self.contradictions
    }

    /// Adds an exchange.
    pub fn add(&mut self, exchange: Exchange) {
        if self.recent.len() == WINDOW {
            self.recent.pop_front();
        }
        self.recent.push_back(exchange);
    }

    /// Bounds of the host time of box time `at`, from the exchange `own` that reported it and the recent ones.
    ///
    /// On a contradiction `own` alone counts: the others are removed, and the contradiction is counted.
    pub fn bounds(&mut self, own: Exchange, at: Ticks) -> Bounds {
        let own_bounds = self.bounds_from(own, at);
        let all = self.recent.iter().fold(own_bounds, |b, &exchange| {
            let other = self.bounds_from(exchange, at);
            Bounds {
                low: b.low.max(other.low),
                high: b.high.min(other.high),
            }
        });
        if all.low <= all.high {
            return all;
        }
        self.contradictions += 1;
        self.recent.clear();
        own_bounds
    }

    fn bounds_from(&self, e: Exchange, at: Ticks) -> Bounds {
        let ticks = at.0 as f64 - e.at.0 as f64;
        let ns = ticks * (1_000.0 / TICKS_PER_US as f64);
        // A duration of the box's clock is 1 / (1 ± drift) of it on the host's, which is at most 1 ± drift / (1 - drift).
        let drift = self.max_drift_ppm * 1e-6;
        let slack = ns.abs() * drift / (1.0 - drift);
        Bounds {
            low: HostTime(e.sent.0 + (ns - slack).floor() as i64),
            high: HostTime(e.received.0 + (ns + slack).ceil() as i64),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// For any clock within the tolerance and any delays the truth is inside the bounds, which are never wider than the exchange itself.
        #[test]
        fn the_truth_is_inside(
            ppm in -5_000.0..5_000.0f64, start_ns in 0i64..1 << 40,
            exchanges in prop::collection::vec((1_000i64..300_000_000, 0i64..20_000_000, 0i64..20_000_000), 1..60),
            ahead_us in 0u64..9_000,
        ) {
            let ticks = |host_ns: i64| Ticks((host_ns as f64 * 0.016 * (1.0 + ppm * 1e-6)).round() as u64);
            let host = |t: Ticks| t.0 as f64 / (0.016 * (1.0 + ppm * 1e-6));
            let mut map = HostFromBox::new(5_001.0);
            let mut now = start_ns;
            let mut last = None;
            for (gap, there, back) in exchanges {
                now += gap;
                let own = Exchange { sent: HostTime(now), received: HostTime(now + there + back + 100), at: ticks(now + there + 50) };
                now += there + back + 100;
                map.add(own);
                last = Some(own);
            }
            let own = last.unwrap();
            let at = Ticks(own.at.0 + ahead_us * TICKS_PER_US);
            let b = map.bounds(own, at);
            let (middle, half) = b.middle();
            prop_assert_eq!(map.contradictions(), 0);
            prop_assert!((host(at) - middle.0 as f64).abs() <= half as f64 + 64.0, "{} not in {:?}", host(at), b);
            let alone = HostFromBox::new(5_001.0).bounds(own, at);
            prop_assert!(b.low >= alone.low && b.high <= alone.high);
        }
    }

    #[test]
    fn a_tight_exchange_narrows_a_loose_one() {
        let mut map = HostFromBox::new(100.0);
        let tight = Exchange {
            sent: HostTime(1_000_000),
            received: HostTime(1_001_000),
            at: Ticks(16_000),
        };
        map.add(tight);
        // 10 ms later, with a round trip of 5 ms.
        let loose = Exchange {
            sent: HostTime(9_000_000),
            received: HostTime(14_000_000),
            at: Ticks(16_000 + 160_000),
        };
        let (middle, half) = map.bounds(loose, loose.at).middle();
        assert_eq!(middle, HostTime(11_000_500));
        // 10 ms at 100 ppm, rounded up on both sides.
        assert_eq!(half, 500 + 1_001);
    }

    #[test]
    fn on_a_contradiction_the_latest_exchange_counts() {
        let mut map = HostFromBox::new(100.0);
        map.add(Exchange {
            sent: HostTime(0),
            received: HostTime(10),
            at: Ticks(0),
        });
        let own = Exchange {
            sent: HostTime(1_000_000),
            received: HostTime(1_000_100),
            at: Ticks(0),
        };
        let b = map.bounds(own, Ticks(0));
        assert_eq!((b.low, b.high), (own.sent, own.received));
        assert_eq!(map.contradictions(), 1);
    }
}
