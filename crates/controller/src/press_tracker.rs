//! Determines the phase times of a press from the pose stream alone.

use skinrig_model::{
    HostDuration, HostTime, Point2, Point3, PoseSample, PressMoment, PressTiming, Skin, TimingFault,
};
use skinrig_protocol::plan::RunLimits;

/// A set point that changes by more than this has begun to move, mm.
const MOVED_MM: f64 = 1e-3;

/// Share of the declared tolerance within which a motion counts as settled if the guard checks the next motion against the whole
/// tolerance. The margin is one encoder step: 0.01 mm (omega.3, a reseller's figure for its resolution, < 0.01 mm) of the
/// default tolerance of 0.05 mm.
pub(crate) const SETTLED_SHARE: f64 = 0.8;

/// Waits until the tip stays close to a target.
#[derive(Debug, Clone)]
pub(crate) struct Settling {
    target: Point3<Skin>,
    tolerance_mm: f64,
    time: HostDuration,
    after: HostTime,
    since: Option<HostTime>,
    settled: Option<HostTime>,
    near: bool,
}

impl Settling {
    /// Settled once samples after `after` stay within the limits' tolerance of `target` for their settle
    /// time.
    #[must_use]
    pub(crate) const fn new(target: Point3<Skin>, limits: &RunLimits, after: HostTime) -> Self {
        Self {
            target,
            tolerance_mm: limits.position_tolerance_mm,
            time: limits.settle_time,
            after,
            since: None,
            settled: None,
            near: false,
        }
    }

    /// Settles within the narrower band that the guard requires before the next motion ([`SETTLED_SHARE`]).
    #[must_use]
    pub(crate) fn before_a_motion(
        target: Point3<Skin>,
        limits: &RunLimits,
        after: HostTime,
    ) -> Self {
        Self {
            tolerance_mm: SETTLED_SHARE * limits.position_tolerance_mm,
            ..Self::new(target, limits, after)
        }
    }

    /// Processes the next sample.
    pub(crate) fn feed(&mut self, sample: &PoseSample) {
        if sample.t <= self.after {
            return;
        }
        self.near = sample.measured.distance_mm(self.target) <= self.tolerance_mm;
        if !self.near {
            self.since = None;
            return;
        }
        let since = *self.since.get_or_insert(sample.t);
        if sample.t - since >= self.time && self.settled.is_none() {
            self.settled = Some(sample.t);
        }
    }

    /// True if the newest sample is within the tolerance.
    #[must_use]
    pub(crate) const fn is_near(&self) -> bool {
        self.near
    }

    /// Time of the first sample at which the tip had been within the tolerance for the whole settle time.
    #[must_use]
    pub(crate) const fn settled(&self) -> Option<HostTime> {
        self.settled
    }
}

/// Tracks one press through the pose stream.
#[derive(Debug, Clone)]
pub(crate) struct PressTracker {
    at: Point2,
    depth_mm: f64,
    limits: RunLimits,
    /// True while the press searches for the surface by touch.
    searching: bool,
    /// Height of the touched surface, mm.
    touched_mm: Option<f64>,
    down: Settling,
    depth: Option<Settling>,
    up: Option<Settling>,
    down_from: HostTime,
    braking_from: Option<HostTime>,
    up_from: Option<HostTime>,
    previous: Option<PoseSample>,
    start_set_point_mm: Option<f64>,
    hold_set_point_mm: Option<f64>,
    approach: Option<HostTime>,
    contact: Option<HostTime>,
    at_depth: Option<HostTime>,
    retract: Option<HostTime>,
    release: Option<HostTime>,
    clear: Option<HostTime>,
    hold_sum: [f64; 3],
    hold_samples: u64,
    worst: Option<(f64, Point3<Skin>)>,
    peak_force_n: Option<f64>,
}

impl PressTracker {
    /// Tracks a press at `at` with depth `depth_mm`, whose downward motion was commanded at `down_from` from the pose
    /// `last`.
    #[must_use]
    pub(crate) fn new(
        at: Point2,
        depth_mm: f64,
        limits: &RunLimits,
        down_from: HostTime,
        last: Option<PoseSample>,
    ) -> Self {
        Self {
            at,
            depth_mm,
            limits: *limits,
            searching: false,
            touched_mm: None,
            down: Settling::new(at.at_height(0.0), limits, down_from),
            depth: None,
            up: None,
            down_from,
            braking_from: None,
            up_from: None,
            previous: last,
            start_set_point_mm: last.map(|p| p.commanded.z_mm),
            hold_set_point_mm: None,
            approach: None,
            contact: None,
            at_depth: None,
            retract: None,
            release: None,
            clear: None,
            hold_sum: [0.0; 3],
            hold_samples: 0,
            worst: None,
            peak_force_n: None,
        }
    }

    /// The surface is not at z = 0 but where [`touched`](Self::touched) reports it.
    pub(crate) const fn search_surface(&mut self) {
        self.searching = true;
    }

    /// Sets contact and surface height from the sample of the touch; the depth counts from there.
    pub(crate) const fn touched(&mut self, sample: &PoseSample) {
        self.contact = Some(sample.t);
        self.touched_mm = Some(sample.measured.z_mm);
    }

    /// Depth of the press, mm: as planned, or where it came to rest because it braked.
    pub(crate) const fn depth_mm(&self) -> f64 {
        self.depth_mm
    }

    /// Height of the surface, touched or assumed, mm.
    #[must_use]
    pub(crate) fn surface_mm(&self) -> f64 {
        self.touched_mm.unwrap_or(0.0)
    }

    /// Height of the touched surface, mm.
    #[must_use]
    pub(crate) const fn touched_mm(&self) -> Option<f64> {
        self.touched_mm
    }

    /// Target at full depth.
    fn bottom(&self) -> Point3<Skin> {
        self.at.at_height(self.surface_mm() - self.depth_mm)
    }

    /// Processes the next sample.
    pub(crate) fn feed(&mut self, s: &PoseSample) {
        if s.force_n.is_finite() {
            let peak = self.peak_force_n.unwrap_or(s.force_n);
            self.peak_force_n = Some(peak.max(s.force_n));
        }
        let rising = self.up_from.is_some_and(|t| s.t > t);
        if let Some(p) = self.previous {
            let surface_mm = self.surface_mm();
            let (from, to) = (p.measured.z_mm - surface_mm, s.measured.z_mm - surface_mm);
            let known = !self.searching && s.t > self.down_from;
            if known && self.contact.is_none() && from > 0.0 && to <= 0.0 {
                self.contact = Some(crossing(&p, s, surface_mm));
            }
            if rising && self.release.is_none() && from <= 0.0 && to > 0.0 {
                self.release = Some(crossing(&p, s, surface_mm));
            }
        }
        if s.t > self.down_from && self.approach.is_none() && !rising {
            let start = *self.start_set_point_mm.get_or_insert(s.commanded.z_mm);
            if s.commanded.z_mm < start - MOVED_MM {
                self.approach = Some(s.t);
            }
        }
        let brakes = self.braking_from.is_some_and(|t| s.t > t) && !rising;
        if brakes && (s.commanded.z_mm - self.bottom().z_mm).abs() > MOVED_MM {
            self.depth_mm = self.surface_mm() - s.commanded.z_mm;
            self.indent_from(s.t);
        }
        self.settle(s, rising);
        if self.at_depth.is_some() {
            if !rising {
                self.hold(s);
            } else if rising && self.retract.is_none() {
                let hold_mm = *self.hold_set_point_mm.get_or_insert(s.commanded.z_mm);
                if s.commanded.z_mm > hold_mm + MOVED_MM {
                    self.retract = Some(s.t);
                }
            }
        }
        self.previous = Some(*s);
    }

    fn hold(&mut self, s: &PoseSample) {
        let m = s.measured;
        for (sum, v) in self.hold_sum.iter_mut().zip(m.to_array()) {
            *sum += v;
        }
        self.hold_samples += 1;
        self.hold_set_point_mm = Some(s.commanded.z_mm);
        let off = m.distance_mm(self.bottom());
        if self.worst.is_none_or(|(worst, _)| off > worst) {
            self.worst = Some((off, m));
        }
    }

    fn settle(&mut self, s: &PoseSample, rising: bool) {
        self.down.feed(s);
        if let (Some(depth), false) = (&mut self.depth, rising) {
            depth.feed(s);
            self.at_depth = depth.settled();
        }
        if let Some(up) = &mut self.up {
            up.feed(s);
            self.clear = up.settled();
        }
    }

    /// Sets the time of the command from the surface to full depth.
    pub(crate) fn indent_from(&mut self, t: HostTime) {
        let target = self.bottom();
        self.depth = Some(Settling::new(target, &self.limits, t));
    }

    /// The tip was told at `t` to brake: its depth is that at which the set point comes to rest.
    pub(crate) const fn brake_from(&mut self, t: HostTime) {
        self.braking_from = Some(t);
    }

    /// True while the set point is above full depth.
    #[must_use]
    pub(crate) fn goes_down(&self) -> bool {
        let set_point = self.previous.map(|p| p.commanded.z_mm);
        set_point.is_some_and(|z_mm| z_mm > self.bottom().z_mm + MOVED_MM)
    }

    /// Sets target and command time of the upward motion.
    pub(crate) fn rise_to(&mut self, target: Point3<Skin>, t: HostTime) {
        self.up_from = Some(t);
        self.up = Some(Settling::new(target, &self.limits, t));
    }

    /// True if the tip is, or was, at the surface.
    #[must_use]
    pub(crate) fn at_surface(&self) -> bool {
        self.down.is_near() || self.contact.is_some()
    }

    /// Time at which the tip settled at clearance height.
    #[must_use]
    pub(crate) const fn clear(&self) -> Option<HostTime> {
        self.clear
    }

    /// Time at which the set point began to move down.
    #[must_use]
    pub(crate) const fn approach(&self) -> Option<HostTime> {
        self.approach
    }

    /// First crossing of the surface downwards, interpolated.
    #[must_use]
    pub(crate) const fn contact(&self) -> Option<HostTime> {
        self.contact
    }

    /// Time at which the tip settled at depth.
    #[must_use]
    pub(crate) const fn at_depth(&self) -> Option<HostTime> {
        self.at_depth
    }

    /// Time at which the set point began to move up.
    #[must_use]
    pub(crate) const fn retract(&self) -> Option<HostTime> {
        self.retract
    }

    /// First crossing of the surface upwards after the upward command, interpolated.
    #[must_use]
    pub(crate) const fn release(&self) -> Option<HostTime> {
        self.release
    }

    /// All six phase times.
    ///
    /// # Errors
    /// The first phase time that is missing or out of order.
    pub(crate) fn timing(&self) -> Result<PressTiming, TimingFault> {
        let need = |t: Option<HostTime>, what: PressMoment| t.ok_or(TimingFault::Missing(what));
        let timing = PressTiming {
            approach: need(self.approach, PressMoment::Approach)?,
            contact: need(self.contact, PressMoment::Contact)?,
            at_depth: need(self.at_depth, PressMoment::AtDepth)?,
            retract: need(self.retract, PressMoment::Retract)?,
            release: need(self.release, PressMoment::Release)?,
            clear: need(self.clear, PressMoment::Clear)?,
        };
        let order = [
            timing.approach,
            timing.contact,
            timing.at_depth,
            timing.retract,
            timing.release,
            timing.clear,
        ];
        if order.is_sorted() {
            Ok(timing)
        } else {
            Err(TimingFault::OutOfOrder(order))
        }
    }

    /// Mean measured tip position during the hold.
    #[must_use]
    pub(crate) fn mean(&self) -> Option<Point3<Skin>> {
        if self.hold_samples == 0 {
            return None;
        }
        let [x, y, z] = self.hold_sum.map(|s| s / self.hold_samples as f64);
        Some(Point3::new(x, y, z))
    }

    /// Largest measured force, N.
    #[must_use]
    pub(crate) const fn peak_force_n(&self) -> Option<f64> {
        self.peak_force_n
    }

    /// Checks the hold position against the plan.
    ///
    /// # Errors
    /// The deviation.
    pub(crate) fn check_hold(&self) -> Result<(), TimingFault> {
        match self.worst {
            None => Err(TimingFault::NoHold),
            Some((off, found)) if off > self.limits.position_tolerance_mm => {
                Err(TimingFault::Hold {
                    tolerance_mm: self.limits.position_tolerance_mm,
                    target: self.bottom(),
                    found,
                })
            }
            Some(_) => Ok(()),
        }
    }
}

/// Time at which the straight line from `a` to `b` crosses the height `z_mm`.
fn crossing(a: &PoseSample, b: &PoseSample, z_mm: f64) -> HostTime {
    let (za, zb) = (a.measured.z_mm - z_mm, b.measured.z_mm - z_mm);
    let share = za / (za - zb);
    a.t + HostDuration((share * (b.t - a.t).0 as f64).round() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: RunLimits = RunLimits {
        workspace_min_mm: [-50.0; 3],
        workspace_max_mm: [50.0; 3],
        clearance_mm: 1.0,
        max_depth_mm: 3.0,
        max_speed_mm_s: 100.0,
        max_force_n: 8.0,
        position_tolerance_mm: 0.1,
        settle_time: HostDuration::from_millis(2),
        max_acceleration_mm_s2: None,
        on_trip: skinrig_protocol::TripReaction::Retract,
    };

    /// Samples with these heights, one per millisecond from 1 ms on; the set point equals the tip.
    fn samples(heights: &[f64]) -> impl Iterator<Item = PoseSample> {
        heights.iter().enumerate().map(|(i, z_mm)| PoseSample {
            t: HostTime((i as i64 + 1) * 1_000_000),
            commanded: Point3::new(0.0, 0.0, *z_mm),
            measured: Point3::new(0.0, 0.0, *z_mm),
            force_n: f64::NAN,
        })
    }

    #[test]
    fn settling_restarts_when_the_tip_leaves() {
        let target = Point3::new(0.0, 0.0, 0.0);
        let settled = |after: i64, heights: &[f64]| {
            let mut settling = Settling::new(target, &LIMITS, HostTime(after));
            samples(heights).for_each(|s| settling.feed(&s));
            settling.settled()
        };
        assert_eq!(settled(0, &[0.0, 0.05, 0.2, 0.0, 0.1]), None);
        let found = settled(0, &[0.0, 0.05, 0.2, 0.0, 0.1, -0.1, 0.3]);
        assert_eq!(found, Some(HostTime(6_000_000)));
        // Samples up to the command are ignored.
        assert_eq!(settled(1_000_000, &[0.0, 0.0, 0.0]), None);
        assert_eq!(settled(0, &[0.0, 0.0, 0.0]), Some(HostTime(3_000_000)));
        // Before another motion, the band is narrower.
        let before = |z_mm: f64| {
            let mut settling = Settling::before_a_motion(target, &LIMITS, HostTime(0));
            samples(&[z_mm; 3]).for_each(|s| settling.feed(&s));
            settling.settled()
        };
        assert_eq!(
            (before(0.09), before(0.08)),
            (None, Some(HostTime(3_000_000)))
        );
    }

    #[test]
    fn phase_times_are_interpolated_and_the_hold_is_averaged() {
        // Down at 2 mm per ms, settled at -2 after 6 ms, held to 8 ms, up again.
        let heights = [
            1.0, 0.5, -1.5, -2.0, -2.02, -1.98, -2.04, -2.0, -0.6, 0.2, 1.0, 1.0, 1.0,
        ];
        let at = Point2::new(0.0, 0.0);
        let mut tracker = PressTracker::new(at, 2.0, &LIMITS, HostTime(0), None);
        for s in samples(&heights) {
            if s.t == HostTime(4_000_000) {
                tracker.indent_from(HostTime(3_000_000));
            }
            if s.t == HostTime(9_000_000) {
                tracker.rise_to(at.at_height(1.0), HostTime(8_000_000));
            }
            tracker.feed(&s);
        }
        let us = |t: HostTime| t.0 / 1000;
        let t = tracker.timing().map(|t| {
            [
                t.approach, t.contact, t.at_depth, t.retract, t.release, t.clear,
            ]
            .map(us)
        });
        assert_eq!(t, Ok([2000, 2250, 6000, 9000, 9750, 13000]));
        let depth = tracker.mean().map(|m| -m.z_mm).unwrap_or_default();
        assert!((depth - (1.98 + 2.04 + 2.0) / 3.0).abs() < 1e-12, "{depth}");
        assert_eq!(tracker.check_hold(), Ok(()));
        assert_eq!(tracker.peak_force_n(), None);
    }

    #[test]
    fn a_missing_phase_is_named() {
        let at = Point2::new(0.0, 0.0);
        let mut tracker = PressTracker::new(at, 2.0, &LIMITS, HostTime(0), None);
        samples(&[1.0, 0.9, 0.5]).for_each(|s| tracker.feed(&s));
        let found = tracker.timing();
        assert_eq!(found, Err(TimingFault::Missing(PressMoment::Contact)));
        assert_eq!(tracker.check_hold(), Err(TimingFault::NoHold));
    }
}
