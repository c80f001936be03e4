//! The remaining plan: the steps for the wanted presses, and nothing else.

use skinrig_model::{HostDuration, Point3, PressHistory, PressId, PressRole, PressVerdict, Skin};

use crate::plan::{Plan, Step};
use crate::timing;

/// Path of the tip between two wanted presses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Route {
    /// Straight, at clearance height: a new path that [`crate::check()`] must compare with the keep-outs.
    Straight,
    /// Along every travel of the plan: longer, and already checked with the plan.
    AsPlanned,
}

/// Whether the run ended because its question was decided: then the presses after it are not missing.
fn is_decided(histories: &[PressHistory]) -> bool {
    let mut verdicts = histories.iter().filter_map(|h| h.verdict.as_ref());
    verdicts.any(PressVerdict::is_unneeded)
}

impl Plan {
    /// Presses of a resumed run, given their histories: those selected by [`Retakes::should_retake`](crate::Retakes::should_retake), and
    /// before them all sync presses. Empty if only sync presses are left, and if the question of the campaign is decided.
    #[must_use]
    pub fn pending(&self, histories: &[PressHistory]) -> Vec<bool> {
        let unknown = PressHistory::default();
        let wants = |i: usize| {
            let history = histories.get(i).unwrap_or(&unknown);
            self.retakes.should_retake(history)
        };
        let is_sync = |i: usize| {
            self.presses
                .get(i)
                .is_some_and(|p| p.role == PressRole::Sync)
        };
        let n = self.presses.len();
        let any = !is_decided(histories) && (0..n).any(|i| !is_sync(i) && wants(i));
        (0..n).map(|i| any && (is_sync(i) || wants(i))).collect()
    }

    /// The same plan with only the steps that `pending` presses need, in their order. The first press of a repetition starts at
    /// once, and omitted presses leave no time between the others. All presses stay listed.
    #[must_use]
    pub fn remaining(&self, pending: impl Fn(PressId) -> bool, route: Route) -> Self {
        let is_pending = |step: &Step| matches!(step, Step::Press(p) if pending(p.press));
        let first = self.steps.iter().position(is_pending);
        let last = self.steps.iter().rposition(is_pending);
        let looks_from = self.looks_from(&pending);
        let mut steps = Vec::new();
        if let (Some(first), Some(last)) = (first, last) {
            for (n, step) in self.steps.iter().enumerate().take(self.end_after(last)) {
                // Whether a wanted press follows before the next step of the same kind.
                let leads = |same: fn(&Step) -> bool| {
                    let rest = self.steps.iter().skip(n + 1);
                    rest.take_while(|s| !same(s)).any(is_pending)
                };
                let is_kept = match step {
                    Step::Begin { .. } => leads(|s| matches!(s, Step::Begin { .. })),
                    Step::Pause { .. } => n > first && leads(|s| matches!(s, Step::Pause { .. })),
                    Step::Travel { .. } => {
                        route == Route::AsPlanned || leads(|s| matches!(s, Step::Travel { .. }))
                    }
                    Step::Press(p) => pending(p.press),
                    Step::Look { .. } => n > looks_from,
                    // Only what this leg presses can teach it: its clocks are new.
                    Step::Learn => self.presses.iter().all(|p| pending(p.id)),
                };
                if is_kept {
                    steps.push(step.clone());
                }
            }
        }
        let mut rest = Self {
            steps,
            ..self.clone()
        };
        self.close_gaps(&mut rest, pending);
        rest.allow_time();
        rest
    }

    /// The step before the looks of a further leg: those after its first press, and the last one before, which the earlier leg
    /// may not have lived to take. Sync presses do not count.
    fn looks_from(&self, pending: impl Fn(PressId) -> bool) -> usize {
        let is_sync = |id: PressId| {
            let press = self.presses.get(id.index() as usize);
            press.is_some_and(|p| p.role == PressRole::Sync)
        };
        let is_first =
            |s: &Step| matches!(s, Step::Press(p) if pending(p.press) && !is_sync(p.press));
        let first = self.steps.iter().position(is_first).unwrap_or(0);
        let mut before = self.steps.iter().take(first);
        let last = before.rposition(|s| matches!(s, Step::Look { .. }));
        last.map_or(first, |n| n.saturating_sub(1))
    }

    /// Number of steps up to step `last`, with the look that follows it.
    fn end_after(&self, last: usize) -> usize {
        let follows = matches!(self.steps.get(last + 1), Some(Step::Look { .. }));
        last + 1 + usize::from(follows)
    }

    /// Moves presses forward by the slots of the omitted presses before them.
    fn close_gaps(&self, rest: &mut Self, pending: impl Fn(PressId) -> bool) {
        let mut earlier = vec![HostDuration::ZERO; self.presses.len()];
        // Start of the last omitted slot, and the total time omitted in the block.
        let mut open: Option<HostDuration> = None;
        let mut omitted = HostDuration::ZERO;
        for step in &self.steps {
            match step {
                Step::Begin { .. } => (open, omitted) = (None, HostDuration::ZERO),
                Step::Press(p) => {
                    let Some(start) = p.start_after_begin else {
                        continue;
                    };
                    if let Some(from) = open.take() {
                        omitted = omitted + HostDuration(start.0 - from.0);
                    }
                    if !pending(p.press) {
                        open = Some(start);
                    }
                    if let Some(earlier) = earlier.get_mut(p.press.index() as usize) {
                        *earlier = omitted;
                    }
                }
                Step::Travel { .. } | Step::Pause { .. } | Step::Look { .. } | Step::Learn => {}
            }
        }
        for step in &mut rest.steps {
            if let Step::Press(p) = step
                && let (Some(start), Some(omitted)) = (
                    &mut p.start_after_begin,
                    earlier.get(p.press.index() as usize).copied(),
                )
            {
                start.0 -= omitted.0;
            }
        }
    }

    /// Extends the deadlines of travels that became longer; the first one begins anywhere in the workspace.
    fn allow_time(&mut self) {
        let limits = self.limits;
        let corner = |[x, y, z]: [f64; 3]| Point3::<Skin>::new(x, y, z);
        let widest_mm =
            corner(limits.workspace_min_mm).distance_mm(corner(limits.workspace_max_mm));
        let mut position: Option<Point3<Skin>> = None;
        for step in &mut self.steps {
            match step {
                Step::Travel {
                    to,
                    speed_mm_s,
                    deadline,
                } => {
                    let distance_mm = position.map_or(widest_mm, |p| p.distance_mm(*to));
                    let estimate = timing::travel_s(&limits, distance_mm, *speed_mm_s);
                    *deadline = (*deadline).max(timing::deadline(estimate));
                    position = Some(*to);
                }
                Step::Press(p) => position = Some(p.at.at_height(limits.clearance_mm)),
                Step::Begin { .. } | Step::Pause { .. } | Step::Look { .. } | Step::Learn => {}
            }
        }
    }
}
