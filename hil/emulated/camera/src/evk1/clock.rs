//! Camera time: an oscillator, and the sync line that transmits a master's time to its slaves.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// An oscillator with a constant rate deviation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Oscillator {
    /// Rate deviation, parts per billion; positive is fast.
    drift_ppb: i64,
}

impl Oscillator {
    pub(crate) fn new(drift_ppm: f64) -> Self {
        Self {
            drift_ppb: (drift_ppm * 1e3).round() as i64,
        }
    }

    /// Whole microseconds counted in `ns` of true time.
    pub(crate) const fn count_us(self, ns: i64) -> u64 {
        // Separate whole seconds and fraction, so that no product exceeds 64 bits in any run.
        let (whole, rest) = (ns / 1_000_000_000, ns % 1_000_000_000);
        let drift = whole * self.drift_ppb + rest * self.drift_ppb / 1_000_000_000;
        let counted = ns + drift;
        if counted < 0 {
            0
        } else {
            counted as u64 / 1_000
        }
    }
}

/// A run of a master's time base.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pulses {
    oscillator: Oscillator,
    from_ns: i64,
    /// End of the run.
    to_ns: Option<i64>,
    /// Number of the run.
    run: u64,
}

/// The line with a master's 1 MHz pulses to its slaves.
#[derive(Debug, Default)]
pub(crate) struct SyncLine(Mutex<Option<Pulses>>);

impl SyncLine {
    fn lock(&self) -> MutexGuard<'_, Option<Pulses>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Starts the master's time base at `from_ns`.
    pub(crate) fn begin(&self, oscillator: Oscillator, from_ns: i64) {
        let mut line = self.lock();
        let run = line.map_or(1, |before| before.run + 1);
        *line = Some(Pulses {
            oscillator,
            from_ns,
            to_ns: None,
            run,
        });
    }

    /// Stops the master's time base.
    pub(crate) fn end(&self, at_ns: i64) {
        if let Some(pulses) = self.lock().as_mut() {
            pulses.to_ns.get_or_insert(at_ns);
        }
    }
}

/// The time of a camera from a start of its time base to the stop.
#[derive(Debug)]
pub(crate) enum TimeBase {
    /// Its own clock.
    Own {
        oscillator: Oscillator,
        /// True time at the start, ns.
        from_ns: i64,
        /// Camera time at the start, µs.
        base_us: u64,
    },
    /// Pulses on the sync line, counted since its own start.
    Counted {
        from_ns: i64,
        /// Pulses of the master's earlier runs.
        base_us: u64,
        /// The current run, and its count when this camera started counting it.
        current: Option<(Pulses, u64)>,
    },
}

impl TimeBase {
    /// Camera time at true time `t_ns`, µs. Requested times must not decrease.
    pub(crate) fn at(&mut self, t_ns: i64, line: &SyncLine) -> u64 {
        match self {
            Self::Own {
                oscillator,
                from_ns,
                base_us,
            } => *base_us + oscillator.count_us(t_ns - *from_ns),
            Self::Counted {
                from_ns,
                base_us,
                current,
            } => {
                let counted = |(pulses, before): (Pulses, u64), t_ns: i64| {
                    let until = pulses.to_ns.map_or(t_ns, |end| end.min(t_ns));
                    pulses.oscillator.count_us((until - pulses.from_ns).max(0)) - before
                };
                let Some(now) = *line.lock() else {
                    return *base_us;
                };
                match *current {
                    Some((pulses, before)) if pulses.run == now.run => {
                        *current = Some((now, before));
                    }
                    _ if t_ns < now.from_ns => {}
                    other => {
                        if let Some(ended) = other {
                            *base_us += counted(ended, i64::MAX);
                        }
                        let missed = (*from_ns - now.from_ns).max(0);
                        *current = Some((now, now.oscillator.count_us(missed)));
                    }
                }
                *base_us + current.map_or(0, |c| counted(c, t_ns))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: i64 = 1_000_000_000;

    fn slave(from_ns: i64) -> TimeBase {
        TimeBase::Counted {
            from_ns,
            base_us: 0,
            current: None,
        }
    }

    #[test]
    fn a_slave_stands_still_until_its_master_runs_and_then_shares_its_time() {
        let line = SyncLine::default();
        let fast = Oscillator::new(100.0);
        let mut slave = slave(0);
        assert_eq!(slave.at(SECOND, &line), 0);
        line.begin(fast, 2 * SECOND);
        let mut master = TimeBase::Own {
            oscillator: fast,
            from_ns: 2 * SECOND,
            base_us: 0,
        };
        assert_eq!(slave.at(SECOND + 1, &line), 0);
        for t in [2 * SECOND, 2 * SECOND + 1_234_567, 12 * SECOND] {
            assert_eq!(slave.at(t, &line), master.at(t, &line), "{t}");
        }
        assert_eq!(slave.at(12 * SECOND, &line), 10_001_000);
        line.end(12 * SECOND);
        assert_eq!(slave.at(20 * SECOND, &line), 10_001_000);
        line.begin(fast, 30 * SECOND);
        assert_eq!(slave.at(31 * SECOND, &line), 11_001_100);
    }

    #[test]
    fn a_slave_that_starts_late_is_behind_by_that_much() {
        let line = SyncLine::default();
        line.begin(Oscillator::new(0.0), 0);
        let mut slave = slave(3 * SECOND);
        assert_eq!(slave.at(5 * SECOND, &line), 2_000_000);
    }
}
