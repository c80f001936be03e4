//! Checks every segment of a plan before any device is opened.

use std::fmt;

use serde::Serialize;
use skinrig_model::{HostDuration, Point2, Point3, PressId, Skin};

use crate::area::Surroundings;
use crate::plan::{Plan, PressStep, Step};
use crate::surface::{Surface, TouchSearch};
use crate::timing;

/// A segment of motion that breaks a limit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Violation {
    /// Press that the segment belongs or leads to; `None` if no press follows.
    pub press: Option<PressId>,
    /// Index into [`Plan::steps`].
    pub step: usize,
    /// Part of the motion.
    pub segment: Segment,
    /// The rule that it breaks.
    pub rule: PlanRule,
    /// Accepted values.
    pub expected: String,
    /// Value in the plan.
    pub found: String,
    /// Distance past the limit, in the limit's unit; 0 if it has no measure.
    pub excess: f64,
    /// Key of the protocol to change.
    pub key: &'static str,
}

/// A rule for the segments of a plan. Its text says how a segment breaks it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
pub enum PlanRule {
    /// Times are 0 or more.
    #[error("a negative time")]
    Time,
    /// Pauses are 0 or more.
    #[error("a pause of negative length")]
    Pause,
    /// This limit of the plan is finite and above 0.
    #[error("{0} is invalid")]
    Limit(&'static str),
    /// The settling tolerance is less than the clearance height.
    #[error("a tip on the surface would count as clear")]
    ToleranceBelowClearance,
    /// Presses are numbered in order.
    #[error("presses are not numbered in order")]
    PressOrder,
    /// This axis stays inside the workspace.
    #[error("{0} leaves the workspace")]
    Workspace(&'static str),
    /// The speed limit.
    #[error("the speed is outside its limit")]
    Speed,
    /// The tip moves sideways at clearance height.
    #[error("lateral motion below clearance height")]
    LateralClearance,
    /// The deadline leaves time for the motion.
    #[error("the deadline is too short")]
    Deadline,
    /// The distance to this keep-out.
    #[error("comes too close to `{0}`")]
    KeepOut(String),
    /// The surface search stays between clearance height and the depth limit.
    #[error("the surface search starts or ends too far from the surface")]
    SearchBand,
    /// The contact force of a surface search.
    #[error("the contact force is outside its limit")]
    ContactForce,
    /// Presses stay inside the outline by its margin.
    #[error("not on the skin")]
    OnSkin,
    /// Steps have the location and depth of their planned press.
    #[error("the step is not the planned press")]
    PlannedPress,
    /// Presses start above their location.
    #[error("the press starts away from its location")]
    PressStart,
    /// The depth limit.
    #[error("the depth is outside its limit")]
    Depth,
}

/// A part of the motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Segment {
    /// From the home position to the first location.
    FromHome,
    /// Lateral motion.
    Travel,
    /// Down to the surface.
    Approach,
    /// From the surface to depth.
    Press,
    /// Back to clearance height.
    Retract,
    /// The plan as a whole.
    Plan,
}

impl Segment {
    /// Name for messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::FromHome => "travel from home",
            Self::Travel => "travel",
            Self::Approach => "approach",
            Self::Press => "press",
            Self::Retract => "retract",
            Self::Plan => "plan",
        }
    }
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.press {
            Some(press) => write!(f, "{press}, {}: ", self.segment.name())?,
            None => write!(f, "step {}, {}: ", self.step, self.segment.name())?,
        }
        write!(
            f,
            "{}: expected {}, found {}; change `{}`",
            self.rule, self.expected, self.found, self.key
        )
    }
}

/// Checks every segment of `plan`: travel, approach, press and retract, and the travel from `home` if it is known.
///
/// Compares each with the workspace, the true outline and its margin, the keep-outs, the clearance height for
/// lateral motion, and the limits of speed, depth and force. An empty list means that the plan may run.
#[must_use]
pub fn check(plan: &Plan, around: &Surroundings, home: Option<Point3<Skin>>) -> Vec<Violation> {
    let mut checker = Checker {
        plan,
        around,
        found: Vec::new(),
        step: 0,
        press: None,
    };
    checker.limits();
    checker.surface_check(home);
    let mut position = home;
    for (index, step) in plan.steps.iter().enumerate() {
        checker.step = index;
        match step {
            Step::Travel {
                to,
                speed_mm_s,
                deadline,
            } => {
                checker.press =
                    plan.steps
                        .get(index..)
                        .unwrap_or(&[])
                        .iter()
                        .find_map(|s| match s {
                            Step::Press(p) => Some(p.press),
                            _ => None,
                        });
                let first = !plan
                    .steps
                    .iter()
                    .take(index)
                    .any(|s| matches!(s, Step::Travel { .. } | Step::Press(_)));
                let segment = if first {
                    Segment::FromHome
                } else {
                    Segment::Travel
                };
                checker.travel(segment, position, *to, *speed_mm_s, *deadline);
                position = Some(*to);
            }
            Step::Press(press) => {
                checker.press = Some(press.press);
                checker.press(press, position);
                position = Some(press.at.at_height(plan.limits.clearance_mm));
            }
            Step::Begin { .. } | Step::Look { .. } | Step::Learn => {}
            Step::Pause { duration } => {
                if duration.0 < 0 {
                    checker.add(
                        Segment::Plan,
                        PlanRule::Pause,
                        "0 s or more",
                        duration,
                        "repetitions.between.pause",
                    );
                }
            }
        }
    }
    checker.found
}

struct Checker<'a> {
    plan: &'a Plan,
    around: &'a Surroundings,
    found: Vec<Violation>,
    step: usize,
    press: Option<PressId>,
}

/// Tolerance for rounding of coordinates, mm.
const TINY_MM: f64 = 1e-9;

impl Checker<'_> {
    fn add(
        &mut self,
        segment: Segment,
        rule: PlanRule,
        expected: impl fmt::Display,
        found: impl fmt::Display,
        key: &'static str,
    ) {
        self.found.push(Violation {
            press: self.press,
            step: self.step,
            segment,
            rule,
            expected: expected.to_string(),
            found: found.to_string(),
            excess: 0.0,
            key,
        });
    }

    /// Sets the excess of the last violation over its limit.
    fn excess(&mut self, excess: f64) {
        if let Some(last) = self.found.last_mut() {
            last.excess = excess;
        }
    }

    fn limits(&mut self) {
        let l = self.plan.limits;
        let positive = |v: f64| v.is_finite() && v > 0.0;
        for (value, name, key) in [
            (l.clearance_mm, "the clearance height", "motion.clearance"),
            (l.max_depth_mm, "the depth limit", "limits.max_depth"),
            (l.max_speed_mm_s, "the speed limit", "limits.max_speed"),
            (l.max_force_n, "the force limit", "limits.max_force"),
            (
                l.position_tolerance_mm,
                "the settling tolerance",
                "motion.settle.tolerance",
            ),
        ] {
            if !positive(value) {
                self.add(
                    Segment::Plan,
                    PlanRule::Limit(name),
                    "a value above 0",
                    value,
                    key,
                );
            }
        }
        if l.position_tolerance_mm >= l.clearance_mm {
            self.add(
                Segment::Plan,
                PlanRule::ToleranceBelowClearance,
                format!("a tolerance below {} mm", l.clearance_mm),
                format!("{} mm", l.position_tolerance_mm),
                "motion.settle.tolerance",
            );
        }
        for (k, press) in self.plan.presses.iter().enumerate() {
            if press.id.index() as usize != k {
                self.press = Some(press.id);
                self.add(
                    Segment::Plan,
                    PlanRule::PressOrder,
                    PressId::from_index(k as u32),
                    press.id,
                    "path",
                );
                break;
            }
        }
        self.press = None;
    }

    fn workspace(&mut self, segment: Segment, p: Point3<Skin>, key: &'static str) {
        let l = &self.plan.limits;
        let (min, max) = (l.workspace_min_mm, l.workspace_max_mm);
        for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let v = p.to_array()[k];
            if !(v >= min[k] - TINY_MM && v <= max[k] + TINY_MM) {
                let key = if axis == "z" && segment != Segment::FromHome {
                    "limits.workspace"
                } else {
                    key
                };
                self.add(
                    segment,
                    PlanRule::Workspace(axis),
                    format!("{} to {} mm", min[k], max[k]),
                    format!("{v:.3} mm"),
                    key,
                );
                self.excess((min[k] - v).max(v - max[k]));
            }
        }
    }

    fn speed(&mut self, segment: Segment, v: f64, key: &'static str) {
        let max = self.plan.limits.max_speed_mm_s;
        if !(v > 0.0 && v <= max + TINY_MM) {
            self.add(
                segment,
                PlanRule::Speed,
                format!("more than 0 and at most {max} mm/s"),
                format!("{v} mm/s"),
                key,
            );
            self.excess(v - max);
        }
    }

    fn travel(
        &mut self,
        segment: Segment,
        from: Option<Point3<Skin>>,
        to: Point3<Skin>,
        speed: f64,
        deadline: HostDuration,
    ) {
        let clearance = self.plan.limits.clearance_mm;
        let planned = self
            .press
            .and_then(|p| self.plan.presses.get(p.index() as usize));
        let sync = planned.is_some_and(|p| p.role == skinrig_model::PressRole::Sync);
        let key = if sync { "sync.at" } else { "path" };
        self.workspace(segment, to, key);
        if let Some(from) = from.filter(|_| segment == Segment::FromHome) {
            self.workspace(segment, from, "motion.home");
        }
        self.speed(segment, speed, "motion.travel");
        let start = from.unwrap_or(to);
        let lateral = start.plane().distance_mm(to.plane()) > TINY_MM;
        let lowest = start.to_array()[2].min(to.to_array()[2]);
        if !(to.to_array()[2] >= clearance - TINY_MM && (!lateral || lowest >= clearance - TINY_MM))
        {
            self.add(
                segment,
                PlanRule::LateralClearance,
                format!("{clearance} mm or higher"),
                format!("{lowest:.3} mm"),
                "motion.clearance",
            );
        }
        self.keep_outs(segment, start.plane(), to.plane(), lowest, key);
        let distance = start.distance_mm(to);
        self.deadline(segment, deadline, distance / speed);
    }

    fn deadline(&mut self, segment: Segment, deadline: HostDuration, least_s: f64) {
        if least_s.is_nan() || deadline.as_secs_f64() <= least_s {
            self.add(
                segment,
                PlanRule::Deadline,
                format!("more than {least_s:.3} s"),
                deadline,
                "motion",
            );
        }
    }

    fn keep_outs(
        &mut self,
        segment: Segment,
        a: Point2,
        b: Point2,
        height_mm: f64,
        key: &'static str,
    ) {
        for keep_out in &self.around.keep_outs {
            if let Some(distance) = keep_out.too_close_mm(a, b, height_mm, 0.0) {
                self.add(
                    segment,
                    PlanRule::KeepOut(keep_out.name.clone()),
                    format!("more than {} mm away", keep_out.margin_mm),
                    format!(
                        "{distance:.3} mm between ({:.3}, {:.3}) and ({:.3}, {:.3}) mm",
                        a.x_mm, a.y_mm, b.x_mm, b.y_mm
                    ),
                    key,
                );
                self.excess(keep_out.margin_mm - distance);
            }
        }
    }

    /// Checks that the surface search stays below clearance height, in the workspace and above the floor.
    fn search(&mut self, at: Point2, search: &TouchSearch) {
        let limits = self.plan.limits;
        let room = limits
            .max_depth_mm
            .min(limits.clearance_mm - limits.position_tolerance_mm);
        let band = search.band_mm;
        if !(band > 0.0 && band < room) {
            self.add(
                Segment::Approach,
                PlanRule::SearchBand,
                format!("a band above 0 and below {room} mm"),
                format!("{band} mm"),
                "press.band",
            );
            self.excess(band - room);
        }
        self.workspace(Segment::Approach, at.at_height(-band), "press.band");
        self.speed(Segment::Approach, search.speed_mm_s, "press.speed");
        if !(search.threshold_n > 0.0 && search.threshold_n < limits.max_force_n) {
            self.add(
                Segment::Approach,
                PlanRule::ContactForce,
                format!("more than 0 and less than {} N", limits.max_force_n),
                format!("{} N", search.threshold_n),
                "press.threshold",
            );
        }
    }

    /// Checks that a location is inside the outline by the margin.
    fn on_skin(&mut self, at: Point2, key: &'static str) {
        let inside = self.around.outline.clearance_mm(at);
        let margin = self.around.margin_mm;
        if inside.is_nan() || inside < margin - TINY_MM {
            let found = if inside < 0.0 {
                format!("({:.3}, {:.3}) mm, outside", at.x_mm, at.y_mm)
            } else {
                format!("({:.3}, {:.3}) mm, {inside:.3} mm inside", at.x_mm, at.y_mm)
            };
            self.add(
                Segment::Press,
                PlanRule::OnSkin,
                format!("at least {margin} mm inside the outline"),
                found,
                key,
            );
            self.excess(margin - inside);
        }
    }

    /// Checks the points of the surface check and the paths between them.
    fn surface_check(&mut self, home: Option<Point3<Skin>>) {
        let Some(check) = &self.plan.surface_check else {
            return;
        };
        const KEY: &str = "surface_check.points";
        let clearance = self.plan.limits.clearance_mm;
        let mut from = home.map(|p| p.plane());
        for at in &check.points {
            self.workspace(Segment::Travel, at.at_height(clearance), KEY);
            self.keep_outs(Segment::Travel, from.unwrap_or(*at), *at, clearance, KEY);
            self.on_skin(*at, KEY);
            self.keep_outs(Segment::Press, *at, *at, -check.search.band_mm, KEY);
            self.search(*at, &check.search);
            from = Some(*at);
        }
    }

    fn press(&mut self, press: &PressStep, position: Option<Point3<Skin>>) {
        let limits = self.plan.limits;
        let at = press.at;
        let planned = self.plan.presses.get(press.press.index() as usize);
        let sync = planned.is_some_and(|p| p.role == skinrig_model::PressRole::Sync);
        let key = if sync { "sync.at" } else { "path" };
        if planned.is_none_or(|p| p.at != at || p.depth_mm != press.depth_mm) {
            self.add(
                Segment::Plan,
                PlanRule::PlannedPress,
                "the same location and depth",
                format!("({}, {}) mm", at.x_mm, at.y_mm),
                key,
            );
        }
        let above = at.at_height(limits.clearance_mm);
        if position.is_none_or(|p| p.distance_mm(above) > TINY_MM) {
            self.add(
                Segment::Approach,
                PlanRule::PressStart,
                format!(
                    "the tip above ({}, {}) mm at clearance height",
                    at.x_mm, at.y_mm
                ),
                position.map_or("an unknown position".to_owned(), |p| {
                    format!("{:?} mm", p.to_array())
                }),
                key,
            );
        }
        self.workspace(Segment::Approach, above, key);
        self.workspace(Segment::Press, at.at_height(-press.depth_mm), key);
        if let Surface::Touch(search) = &press.surface {
            self.search(at, search);
        }
        self.speed(
            Segment::Approach,
            press.approach_speed_mm_s,
            "motion.approach",
        );
        self.speed(Segment::Press, press.indent_speed_mm_s, "motion.indent");
        self.speed(Segment::Retract, press.retract_speed_mm_s, "motion.retract");
        let depth = press.depth_mm;
        if !(depth > 0.0 && depth <= limits.max_depth_mm + TINY_MM) {
            self.add(
                Segment::Press,
                PlanRule::Depth,
                format!("more than 0 and at most {} mm", limits.max_depth_mm),
                format!("{depth} mm"),
                if sync { "sync.depth" } else { "depth" },
            );
            self.excess(depth - limits.max_depth_mm);
        }
        self.on_skin(at, key);
        self.keep_outs(Segment::Press, at, at, -depth, key);
        if press.hold.0 < 0 || press.start_after_begin.is_some_and(|s| s.0 < 0) {
            self.add(
                Segment::Press,
                PlanRule::Time,
                "0 s or more",
                press.hold,
                "motion.hold",
            );
        }
        let (moving, still) = timing::press_s(&limits, press);
        self.deadline(Segment::Press, press.deadline, moving + still);
    }
}
