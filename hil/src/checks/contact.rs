//! Checks `depth` and `force_ceiling`: the robot against the skin.

use skinrig_model::{HostDuration, PoseSample};
use skinrig_nightly::{Evidence, EvidenceKind};
use skinrig_protocol::suite::{Check, Measure};

use super::robot::{last, mean};
use crate::arm::{Arm, Reach, with_arm};
use crate::bench::{Bench, Problem};
use crate::findings::Findings;
use crate::test_volume::motion_refused;

const ROBOT: &str = "robot";
/// Indentation speed, mm/s.
const INDENTATION_MM_S: f64 = 2.0;
/// Hold time before the depth is measured. The driver's position correction finishes within it.
const SETTLE: HostDuration = HostDuration::from_millis(1_000);
/// Averaging time of depths and forces.
const AVERAGING: HostDuration = HostDuration::from_millis(200);
/// Largest sag in free air under a reduced force limit, mm. With more, the motors do not carry the
/// arm's weight.
const MAX_SAG_MM: f64 = 0.5;
/// Share of the force limit that counts as having reached it.
const LIMIT_SHARE: f64 = 0.9;

/// Runs the check.
pub(super) fn depth(check: &Check, bench: &mut dyn Bench, findings: &mut Findings) {
    let Measure::Depth { depth_mm, presses } = check.measure else {
        return;
    };
    if skip_without_skin(bench, findings) {
        return;
    }
    with_arm(
        bench,
        Reach::Skin,
        findings,
        &["height", "spread", "error"],
        &mut |arm, findings| press_to_depth(arm, findings, depth_mm, presses),
    );
}

fn press_to_depth(
    arm: &mut Arm<'_>,
    findings: &mut Findings,
    depth_mm: f64,
    presses: u32,
) -> Result<(), Problem> {
    check_depth_limit(arm, depth_mm)?;
    let (mut heights_mm, mut squares) = (Vec::new(), 0.0);
    for at in arm.volume.press_points.clone() {
        for _ in 0..presses {
            arm.go_above(at)?;
            let touched_mm = arm.touch()?;
            let mut samples = Vec::new();
            let bottom = at.at_height(touched_mm - depth_mm);
            arm.send(bottom, INDENTATION_MM_S)?;
            let down = HostDuration::from_secs_f64(
                (arm.search.band_mm * 2.0 + depth_mm) / INDENTATION_MM_S,
            );
            arm.watch(HostDuration(down.0 + SETTLE.0), &mut samples, |_| false)?;
            arm.go(at.at_height(arm.search.band_mm), INDENTATION_MM_S)?;
            let reached_mm = touched_mm - mean(last(&samples, AVERAGING)).z_mm;
            squares += (reached_mm - depth_mm).powi(2);
            heights_mm.push(touched_mm);
        }
    }
    let n = heights_mm.len();
    // Signed: a touch registers below the surface, and a wrong frame must not hide behind that.
    let height_mm = heights_mm.iter().sum::<f64>() / n as f64;
    let spread_mm = heights_mm.iter().copied().fold(f64::NEG_INFINITY, f64::max)
        - heights_mm.iter().copied().fold(f64::INFINITY, f64::min);
    findings
        .value(ROBOT, "height", height_mm)
        .with_samples(n, 3);
    findings
        .value(ROBOT, "spread", spread_mm)
        .with_samples(n, 3);
    let error_mm = (squares / n as f64).sqrt();
    findings.value(ROBOT, "error", error_mm).with_samples(n, 3);
    Ok(())
}

/// Marks the check as not applicable if the rig has no skin mounted.
fn skip_without_skin(bench: &dyn Bench, findings: &mut Findings) -> bool {
    let off = bench.rig().robot.sample_is_off;
    if off {
        findings.not_applicable = Some("the rig file says `robot.sample_is_off: true`".to_owned());
    }
    off
}

/// Verifies that the depth limit allows `depth_mm` below a surface at the lower end of the touch band.
fn check_depth_limit(arm: &Arm<'_>, depth_mm: f64) -> Result<(), Problem> {
    let (need_mm, most_mm) = (
        depth_mm + arm.search.band_mm,
        arm.volume.limits.max_depth_mm,
    );
    if need_mm <= most_mm {
        return Ok(());
    }
    Err(motion_refused(
        format!(
            "expected `limits.max_depth` of the rig file to be at least {need_mm} mm (depth plus touch band), found {most_mm} mm"
        ),
        "reduce `depth` of the check",
    ))
}

/// Runs the check.
pub(super) fn force_ceiling(check: &Check, bench: &mut dyn Bench, findings: &mut Findings) {
    let Measure::ForceCeiling { force_n, depth_mm } = check.measure else {
        return;
    };
    if skip_without_skin(bench, findings) {
        return;
    }
    with_arm(
        bench,
        Reach::Skin,
        findings,
        &["peak", "trips"],
        &mut |arm, findings| press_to_force_limit(arm, findings, force_n, depth_mm),
    );
}

fn press_to_force_limit(
    arm: &mut Arm<'_>,
    findings: &mut Findings,
    force_n: f64,
    depth_mm: f64,
) -> Result<(), Problem> {
    check_depth_limit(arm, depth_mm)?;
    let at = arm.volume.centre;
    let [high, ..] = arm.volume.air_points();
    arm.go(high, super::robot::TRAVEL_MM_S)?;
    let settings = arm.limit_force(Some(force_n))?;
    check_carries_arm(arm, force_n)?;
    arm.go_above(at)?;
    let mut samples = Vec::new();
    arm.send(at.at_height(-depth_mm), INDENTATION_MM_S)?;
    let down = HostDuration::from_secs_f64((depth_mm + arm.search.band_mm) / INDENTATION_MM_S);
    let pressed = arm.watch(HostDuration(down.0 + SETTLE.0), &mut samples, |_| false);
    let peak_n = peak_n(&samples);
    let trips = match pressed {
        // The robot enforced the limit by switching its motors off.
        Err(problem) if problem.kind == EvidenceKind::State => {
            findings.evidence.push(*problem);
            1.0
        }
        Err(problem) => return Err(problem),
        Ok(()) => {
            arm.go(at.at_height(arm.search.band_mm), INDENTATION_MM_S)?;
            arm.limit_force(None)?;
            0.0
        }
    };
    let enough = peak_n >= LIMIT_SHARE * force_n;
    let read_back = settings.iter().find(|s| s.name == "max_force_n");
    let read_back = read_back.map_or("nothing", |s| s.read_back.as_str());
    let lowest_mm = samples.iter().map(|s| -s.measured.z_mm).fold(0.0, f64::max);
    findings
    .value(ROBOT, "peak", peak_n)
    .with_samples(usize::from(enough), 1)
    .with_note(format!(
        "limit {force_n} N, read back {read_back}; commanded {depth_mm} mm, reached {lowest_mm:.2} mm"
    ));
    findings.value(ROBOT, "trips", trips).with_samples(1, 1);
    if !enough {
        let what = format!(
            "expected a force of about {force_n} N, found {peak_n:.2} N: the skin is too soft at this depth"
        );
        let next = "increase `depth` of the check, or reduce `force`";
        let few = Evidence::new(EvidenceKind::TooLittle, ROBOT, what);
        findings.evidence.push(few.next(next));
    }
    Ok(())
}

/// Verifies in free air, where sagging is harmless, that the motors carry the arm under the force limit.
fn check_carries_arm(arm: &mut Arm<'_>, force_n: f64) -> Result<(), Problem> {
    let from = arm.pose()?.measured;
    let mut samples = Vec::new();
    let is_sinking = |s: &PoseSample| from.z_mm - s.measured.z_mm > MAX_SAG_MM;
    arm.watch(SETTLE, &mut samples, is_sinking)?;
    if !samples.iter().any(is_sinking) {
        return Ok(());
    }
    arm.limit_force(None)?;
    Err(motion_refused(
        format!(
            "expected the arm to hold its position with a limit of {force_n} N, found it sinking by more than {MAX_SAG_MM} mm"
        ),
        "measure `robot.motor_force.gravity_ratio` of the rig file, or increase `force` of the check",
    ))
}

fn peak_n(samples: &[PoseSample]) -> f64 {
    let forces = samples.iter().map(|s| s.force_n.abs());
    forces.filter(|f| f.is_finite()).fold(0.0, f64::max)
}
