//! Faults: scheduling, and their effect on reported values.

use super::vector::{Vector, add};
use crate::config::{Fault, Setting, When};

/// Scheduled and active faults.
#[derive(Debug, Default)]
pub struct Faults {
    waiting: Vec<PendingFault>,
    active: Vec<Fault>,
    /// Last reported pose before it froze.
    frozen: Option<(u64, Vector, Vector)>,
    drift_since_ns: Option<u64>,
    noise: Noise,
}

#[derive(Debug, Clone, Copy)]
enum PendingFault {
    At(u64, Fault),
    IntoMove(f64, Fault),
    Below(f64, Fault),
    Contact(Fault),
}

/// Pose and force as reported by the library.
#[derive(Debug, Clone, Copy)]
pub struct ReportedState {
    pub tick: u64,
    pub position: Vector,
    pub velocity: Vector,
    pub force: Vector,
}

/// Whether a fault is an event instead of a state.
fn is_event(fault: Fault) -> bool {
    matches!(
        fault,
        Fault::RegulationDies
            | Fault::PowerLost
            | Fault::Button
            | Fault::VelocityTrip
            | Fault::WatchdogTrip
    )
}

impl Faults {
    /// Schedules a fault.
    pub fn inject(&mut self, now_ns: u64, when: When, fault: Fault) {
        self.waiting.push(match when {
            When::Now => PendingFault::At(now_ns, fault),
            When::After(s) => PendingFault::At(later(now_ns, s), fault),
            When::IntoMove(s) => PendingFault::IntoMove(s, fault),
            When::Below(z_m) => PendingFault::Below(z_m, fault),
            When::Contact => PendingFault::Contact(fault),
        });
    }

    /// Removes all faults.
    pub fn clear(&mut self) {
        *self = Self {
            noise: self.noise,
            ..Self::default()
        };
    }

    /// Handles an accepted move or tracked target.
    pub(crate) fn move_began(&mut self, now_ns: u64) {
        for waiting in &mut self.waiting {
            if let PendingFault::IntoMove(s, fault) = *waiting {
                *waiting = PendingFault::At(later(now_ns, s), fault);
            }
        }
    }

    /// Takes the faults that are due; those that are states become active.
    pub fn due(&mut self, now_ns: u64, z_m: f64, touching: bool) -> Vec<Fault> {
        if self.waiting.is_empty() {
            return Vec::new();
        }
        let mut due = Vec::new();
        self.waiting.retain(|waiting| {
            let (come, fault) = match *waiting {
                PendingFault::At(t, fault) => (now_ns >= t, fault),
                PendingFault::IntoMove(_, fault) => (false, fault),
                PendingFault::Below(z, fault) => (z_m < z, fault),
                PendingFault::Contact(fault) => (touching, fault),
            };
            if come {
                due.push(fault);
            }
            !come
        });
        self.active
            .extend(due.iter().copied().filter(|f| !is_event(*f)));
        due
    }

    /// First result of `pick` among the active faults.
    pub fn find<T>(&self, pick: impl FnMut(&Fault) -> Option<T>) -> Option<T> {
        self.active.iter().find_map(pick)
    }

    /// Whether a fault is active.
    pub fn any(&self, which: impl FnMut(&Fault) -> bool) -> bool {
        self.active.iter().any(which)
    }

    /// Whether a setting ignores writes.
    pub(crate) fn ignores(&self, setting: Setting) -> bool {
        self.any(|f| matches!(f, Fault::SettingIgnored(s) if *s == setting))
    }

    /// Whether a stop fails; counts the failure.
    pub fn stop_fails(&mut self) -> bool {
        self.active.iter_mut().any(|f| match f {
            Fault::StopFails(left) => count_down(left),
            _ => false,
        })
    }

    /// Whether a close fails; counts the failure.
    pub(crate) fn close_fails(&mut self) -> bool {
        self.active.iter_mut().any(|f| match f {
            Fault::CloseFails(left) => count_down(left),
            _ => false,
        })
    }

    /// Reported values of a pose and a force.
    pub fn report(
        &mut self,
        now_ns: u64,
        tick: u64,
        position: Vector,
        velocity: Vector,
        force: Vector,
    ) -> ReportedState {
        let mut reported = ReportedState {
            tick,
            position,
            velocity,
            force,
        };
        for fault in &self.active {
            match *fault {
                Fault::PositionNan => reported.position = [f64::NAN; 3],
                Fault::PositionOffset(by) => reported.position = add(reported.position, by),
                Fault::PositionStale => {
                    let (tick, position, velocity) =
                        *self.frozen.get_or_insert((tick, position, velocity));
                    reported = ReportedState {
                        tick,
                        position,
                        velocity,
                        ..reported
                    };
                }
                Fault::ForceOffset(by) => reported.force = add(reported.force, by),
                Fault::ForceDrift(n_per_s) => {
                    let since = *self.drift_since_ns.get_or_insert(now_ns);
                    reported.force[2] += n_per_s * seconds(now_ns - since);
                }
                Fault::ForceNoise(n) => {
                    reported.force = reported.force.map(|f| f + n * self.noise.next());
                }
                _ => {}
            }
        }
        reported
    }
}

fn count_down(left: &mut u32) -> bool {
    let some = *left > 0;
    *left = left.saturating_sub(1);
    some
}

#[expect(clippy::cast_precision_loss, reason = "a duration in ns")]
fn seconds(ns: u64) -> f64 {
    ns as f64 * 1e-9
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a float cast saturates"
)]
fn later(now_ns: u64, s: f64) -> u64 {
    now_ns.saturating_add((s * 1e9) as u64)
}

/// Reproducible noise with mean 0 and standard deviation 1.
#[derive(Debug, Clone, Copy)]
struct Noise(u64);

impl Default for Noise {
    fn default() -> Self {
        Self(0x9e37_79b9_7f4a_7c15)
    }
}

impl Noise {
    /// Sum of twelve uniform numbers, xorshift64.
    fn next(&mut self) -> f64 {
        let mut sum = -6.0;
        for _ in 0..12 {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            sum += f64::from(u32::try_from(self.0 >> 32).unwrap_or(0)) / f64::from(u32::MAX);
        }
        sum
    }
}
