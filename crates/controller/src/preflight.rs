//! Checks that plan, header and rig fit together before anything is armed.

use skinrig_device::{IndenterCapabilities, MotionLimits};
use skinrig_model::{
    Point2, Point3, PressHistory, PressId, RigidTransform, Robot, RunFault, RunHeader, Skin,
};
use skinrig_protocol::plan::{Plan, PressStep, RunLimits, Step};
use skinrig_protocol::{Surface, SurfaceCheck, TouchSearch};

use crate::guard::check_target;

/// Largest distance of a press from the end of the previous travel, mm: rounding of a plan stored as text.
const SAME_PLACE_MM: f64 = 1e-6;

fn plan_error(
    place: impl Into<String>,
    expected: impl Into<String>,
    found: impl Into<String>,
) -> RunFault {
    RunFault::Plan {
        place: place.into(),
        expected: expected.into(),
        found: found.into(),
    }
}

/// Checks that `plan` is executable: every press exactly once (in a further leg, exactly those that the `histories` leave
/// open), each from above its location, every target and speed within the plan's own limits, and the same presses in
/// the header.
pub(crate) fn check_plan(
    plan: &Plan,
    header: &RunHeader,
    histories: Option<&[PressHistory]>,
) -> Result<(), RunFault> {
    if header.presses != plan.presses {
        return Err(plan_error(
            "header",
            format!("the plan's {} presses", plan.presses.len()),
            format!("{} different presses", header.presses.len()),
        ));
    }
    check_limits(&plan.limits)?;
    for (i, press) in plan.presses.iter().enumerate() {
        if press.id.index() as usize != i {
            let found = press.id.to_string();
            let expected = PressId::from_index(i as u32).to_string();
            return Err(plan_error("presses", expected, found));
        }
    }
    let pending = match histories {
        None => vec![true; plan.presses.len()],
        Some(histories) if histories.len() == plan.presses.len() => plan.pending(histories),
        Some(histories) => {
            return Err(plan_error(
                "histories",
                format!("those of {} presses", plan.presses.len()),
                format!("{}", histories.len()),
            ));
        }
    };
    let mut steps = StepChecks::new(plan);
    for (n, step) in (1..).zip(&plan.steps) {
        steps.check(n, step)?;
    }
    if let Some(check) = &plan.surface_check {
        check_surface(plan, check)?;
    }
    let has_step = steps.has_step;
    if let Some(i) = (0..has_step.len()).find(|i| has_step[*i] != pending[*i]) {
        let step = |exists: bool| if exists { "a step" } else { "no step" };
        return Err(plan_error(
            "steps",
            format!("{} for {}", step(pending[i]), PressId::from_index(i as u32)),
            step(has_step[i]),
        ));
    }
    Ok(())
}

fn check_limits(limits: &RunLimits) -> Result<(), RunFault> {
    let positive = [
        ("max_speed_mm_s", limits.max_speed_mm_s),
        ("max_force_n", limits.max_force_n),
        ("max_depth_mm", limits.max_depth_mm),
        ("clearance_mm", limits.clearance_mm),
        ("position_tolerance_mm", limits.position_tolerance_mm),
    ];
    let bad = |(_, value): &(&str, f64)| !(value.is_finite() && *value > 0.0);
    match positive.into_iter().find(bad) {
        Some((name, value)) => Err(plan_error(
            format!("limits.{name}"),
            "a finite number above 0",
            value.to_string(),
        )),
        None => Ok(()),
    }
}

/// Checks the steps of a plan in order.
struct StepChecks<'a> {
    plan: &'a Plan,
    /// For each press: whether a step makes it.
    has_step: Vec<bool>,
    /// Where the tip is at or above clearance height; `None` before the first travel.
    above: Option<Point3<Skin>>,
}

impl<'a> StepChecks<'a> {
    fn new(plan: &'a Plan) -> Self {
        Self {
            plan,
            has_step: vec![false; plan.presses.len()],
            above: None,
        }
    }

    /// Checks step number `n`.
    fn check(&mut self, n: u32, step: &Step) -> Result<(), RunFault> {
        match step {
            Step::Begin { .. } | Step::Look { .. } | Step::Learn => Ok(()),
            Step::Pause { duration } if duration.0 < 0 => Err(plan_error(
                format!("step {n}, pause"),
                "0 s or more",
                duration.to_string(),
            )),
            Step::Pause { .. } => Ok(()),
            Step::Travel { to, speed_mm_s, .. } => {
                self.travel(&format!("step {n}, travel"), *to, *speed_mm_s)
            }
            Step::Press(press) => self.press(&format!("step {n}, {}", press.press), press),
        }
    }

    fn travel(&mut self, place: &str, to: Point3<Skin>, speed_mm_s: f64) -> Result<(), RunFault> {
        check_speed(self.plan, place, speed_mm_s)?;
        check_point(self.plan, place, to)?;
        let clearance_mm = self.plan.limits.clearance_mm;
        if to.z_mm < clearance_mm - SAME_PLACE_MM {
            return Err(plan_error(
                place,
                format!("a height of at least {clearance_mm} mm"),
                format!("{} mm", to.z_mm),
            ));
        }
        self.above = Some(to);
        Ok(())
    }

    fn press(&mut self, place: &str, press: &PressStep) -> Result<(), RunFault> {
        let plan = self.plan;
        let row = press.press.index() as usize;
        let planned = match (self.has_step.get_mut(row), plan.presses.get(row)) {
            (Some(done), Some(planned)) if !*done => {
                *done = true;
                planned
            }
            _ => {
                return Err(plan_error(
                    place,
                    "each press once",
                    "a repeated or unknown press",
                ));
            }
        };
        for speed in [
            press.approach_speed_mm_s,
            press.indent_speed_mm_s,
            press.retract_speed_mm_s,
        ] {
            check_speed(plan, place, speed)?;
        }
        if !(press.depth_mm.is_finite() && press.depth_mm > 0.0) {
            let found = press.depth_mm.to_string();
            return Err(plan_error(place, "a depth above 0 mm", found));
        }
        let clearance_mm = plan.limits.clearance_mm;
        for z_mm in [clearance_mm, 0.0, -press.depth_mm] {
            check_point(plan, place, press.at.at_height(z_mm))?;
        }
        if let Surface::Touch(search) = &press.surface {
            check_search(plan, place, press.at, search)?;
        }
        if planned.at != press.at || planned.depth_mm != press.depth_mm {
            return Err(plan_error(
                place,
                format!("location and depth of the press list ({planned:?})"),
                format!("{:?}, {} mm", press.at, press.depth_mm),
            ));
        }
        let from = self.above;
        if !from.is_some_and(|a| a.plane().distance_mm(press.at) <= SAME_PLACE_MM) {
            return Err(plan_error(
                place,
                "a travel to above the press first",
                from.map_or_else(|| "none".to_owned(), |a| skinrig_model::fault::point(&a)),
            ));
        }
        self.above = Some(press.at.at_height(clearance_mm));
        Ok(())
    }
}

fn check_surface(plan: &Plan, check: &SurfaceCheck) -> Result<(), RunFault> {
    let place = "surface_check";
    for at in &check.points {
        check_point(plan, place, at.at_height(plan.limits.clearance_mm))?;
        check_search(plan, place, *at, &check.search)?;
    }
    let (tolerance_mm, band_mm) = (check.tolerance_mm, check.search.band_mm);
    if check.points.is_empty() || !(tolerance_mm > 0.0 && tolerance_mm < band_mm) {
        return Err(plan_error(
            place,
            format!("points, and a tolerance above 0 and below {band_mm} mm"),
            format!("{} points, {tolerance_mm} mm", check.points.len()),
        ));
    }
    Ok(())
}

/// Checks that the surface search stays between clearance height and floor and can distinguish contact from free air.
fn check_search(
    plan: &Plan,
    place: &str,
    at: Point2,
    search: &TouchSearch,
) -> Result<(), RunFault> {
    let limits = &plan.limits;
    check_speed(plan, place, search.speed_mm_s)?;
    check_point(plan, place, at.at_height(-search.band_mm))?;
    let highest_mm = limits.clearance_mm - limits.position_tolerance_mm;
    let sound = search.band_mm > 0.0
        && search.band_mm < highest_mm
        && search.threshold_n > 0.0
        && search.threshold_n < limits.max_force_n
        && search.samples > 0
        && search.tare.0 > 0;
    if sound {
        return Ok(());
    }
    Err(plan_error(
        place,
        format!(
            "a search below {highest_mm} mm for a force above 0 and below {} N, with a tare",
            limits.max_force_n
        ),
        format!("{search:?}"),
    ))
}

fn check_speed(plan: &Plan, place: &str, speed_mm_s: f64) -> Result<(), RunFault> {
    let limit = plan.limits.max_speed_mm_s;
    if speed_mm_s.is_finite() && speed_mm_s > 0.0 && speed_mm_s <= limit {
        return Ok(());
    }
    Err(plan_error(
        place,
        format!("a speed above 0 and at most {limit} mm/s"),
        format!("{speed_mm_s} mm/s"),
    ))
}

fn check_point(plan: &Plan, place: &str, target: Point3<Skin>) -> Result<(), RunFault> {
    check_target(&plan.limits, target)
        .map_err(|e| plan_error(place, "a target within the limits", e.to_string()))
}

/// Limits for the robot itself, and remarks on what it cannot do.
///
/// The limits are the run's workspace with its floor at the deepest allowed press, widened by the position tolerance (a
/// settled pose may be that far off) and transformed to the robot frame. If the axes are rotated by anything but quarter
/// turns, they are the bounding box of the rotated box. Where the robot can do less, its own limits apply and a remark
/// states this; every target of the plan is then checked against the result.
pub(crate) fn motion_limits(
    plan: &Plan,
    robot_from_skin: &RigidTransform<Robot, Skin>,
    can: &IndenterCapabilities,
) -> Result<(MotionLimits, Vec<String>), RunFault> {
    let limits = &plan.limits;
    let margin = limits.position_tolerance_mm;
    let low_z = limits.workspace_min_mm[2].max(-limits.max_depth_mm);
    let [x0, y0, _] = limits.workspace_min_mm.map(|v| v - margin);
    let [x1, y1, z1] = limits.workspace_max_mm.map(|v| v + margin);
    let (mut min_mm, mut max_mm) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for x in [x0, x1] {
        for y in [y0, y1] {
            for z in [low_z - margin, z1] {
                let corner = robot_from_skin.apply(Point3::new(x, y, z)).to_array();
                for (i, c) in corner.into_iter().enumerate() {
                    min_mm[i] = min_mm[i].min(c);
                    max_mm[i] = max_mm[i].max(c);
                }
            }
        }
    }
    let mut remarks = Vec::new();
    for (i, axis) in ['x', 'y', 'z'].into_iter().enumerate() {
        let (low, high) = (can.workspace_min_mm[i], can.workspace_max_mm[i]);
        if min_mm[i] < low || max_mm[i] > high {
            remarks.push(format!(
                "workspace along the robot's {axis}: the plan allows {:.3} to {:.3} mm, the robot reaches {low} to {high} mm",
                min_mm[i], max_mm[i]
            ));
            min_mm[i] = min_mm[i].max(low);
            max_mm[i] = max_mm[i].min(high);
        }
    }
    if limits.max_force_n > can.max_force_n {
        remarks.push(format!(
            "force: the plan allows {} N, the robot can exert at most {} N",
            limits.max_force_n, can.max_force_n
        ));
    }
    if let Some(requested) = limits.max_acceleration_mm_s2
        && requested > can.max_acceleration_mm_s2
    {
        remarks.push(format!(
            "acceleration: the plan allows {requested} mm/s², the robot is set up for at most {} mm/s²",
            can.max_acceleration_mm_s2
        ));
    }
    let chosen = MotionLimits {
        min_mm,
        max_mm,
        max_speed_mm_s: limits.max_speed_mm_s.min(can.max_speed_mm_s),
        max_acceleration_mm_s2: limits
            .max_acceleration_mm_s2
            .map_or(can.max_acceleration_mm_s2, |a| {
                a.min(can.max_acceleration_mm_s2)
            }),
        max_force_n: limits.max_force_n.min(can.max_force_n),
    };
    check_reach(plan, robot_from_skin, &chosen)?;
    Ok((chosen, remarks))
}

/// Checks every target and speed of the plan against the limits of the robot.
fn check_reach(
    plan: &Plan,
    robot_from_skin: &RigidTransform<Robot, Skin>,
    limits: &MotionLimits,
) -> Result<(), RunFault> {
    let reach = |n: usize, target: Point3<Skin>, speed_mm_s: f64| {
        let place = format!("indenter, step {n} of the plan");
        within(limits, robot_from_skin, place, target, speed_mm_s)
    };
    for (n, step) in plan.steps.iter().enumerate() {
        match step {
            Step::Travel { to, speed_mm_s, .. } => reach(n, *to, *speed_mm_s)?,
            Step::Press(p) => {
                reach(
                    n,
                    p.at.at_height(plan.limits.clearance_mm),
                    p.retract_speed_mm_s,
                )?;
                reach(n, p.at.at_height(0.0), p.approach_speed_mm_s)?;
                reach(n, p.at.at_height(-deepest_mm(plan, p)), p.indent_speed_mm_s)?;
                if let Surface::Touch(search) = p.surface {
                    reach(n, p.at.at_height(-search.band_mm), search.speed_mm_s)?;
                }
            }
            Step::Begin { .. } | Step::Pause { .. } | Step::Look { .. } | Step::Learn => {}
        }
    }
    if let Some(check) = &plan.surface_check {
        for (i, at) in check.points.iter().enumerate() {
            for z_mm in [plan.limits.clearance_mm, -check.search.band_mm] {
                let place = format!("indenter, point {} of `surface_check`", i + 1);
                within(
                    limits,
                    robot_from_skin,
                    place,
                    at.at_height(z_mm),
                    check.search.speed_mm_s,
                )?;
            }
        }
    }
    Ok(())
}

/// Lowest height below the frame's surface that a press may reach, mm. With a surface search, the lowest accepted surface
/// and the floor set it.
fn deepest_mm(plan: &Plan, press: &PressStep) -> f64 {
    match press.surface {
        Surface::Known => press.depth_mm,
        Surface::Touch(search) => (press.depth_mm + search.band_mm).min(plan.limits.max_depth_mm),
    }
}

/// Checks a target and speed against the limits of the robot.
fn within(
    limits: &MotionLimits,
    robot_from_skin: &RigidTransform<Robot, Skin>,
    place: String,
    target: Point3<Skin>,
    speed_mm_s: f64,
) -> Result<(), RunFault> {
    let p = robot_from_skin.apply(target).to_array();
    let inside = (0..3).all(|i| (limits.min_mm[i]..=limits.max_mm[i]).contains(&p[i]));
    if inside && speed_mm_s <= limits.max_speed_mm_s {
        return Ok(());
    }
    Err(RunFault::Rig {
        place,
        expected: format!(
            "a target from {:?} to {:?} mm (robot frame) and at most {} mm/s",
            limits.min_mm, limits.max_mm, limits.max_speed_mm_s
        ),
        found: format!("{p:?} mm at {speed_mm_s} mm/s"),
    })
}
