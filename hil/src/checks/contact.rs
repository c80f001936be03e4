//! Checks: the robot against the skin.

use skinrig_model::{HostDuration, PoseSample};
use skinrig_nightly::{Evidence, EvidenceKind};
use skinrig_protocol::suite::{Check, Measure};

use super::robot::{last, mean};
use crate::arm::{Arm, Reach, with_arm};
use crate::bench::{Bench, Trouble};
use crate::findings::Findings;
use crate::room::refused;

const ROBOT: &str = "robot";
/// Down into the skin, mm/s.
const INDENT_MM_S: f64 = 2.0;
/// The tip stays down for so long before its depth is taken: what the driver corrects it has corrected by then.
const SETTLE: HostDuration = HostDuration::from_millis(1_000);
/// Over so long a time a depth and a force are means.
const MEAN_OVER: HostDuration = HostDuration::from_millis(200);
/// Under a new limit of its force the arm may sink so far in free air, mm; more, and it does not carry itself.
const SINKS_MM: f64 = 0.5;
/// A force of this share of the limit has reached it.
const REACHED: f64 = 0.9;

/// Makes the check.
pub fn depth(check: &Check, bench: &mut dyn Bench, found: &mut Findings) {
    let Measure::Depth { depth_mm, presses } = check.measure else {
        return;
    };
    if without_skin(bench, found) {
        return;
    }
    let metrics = &["surface", "error"];
    with_arm(bench, Reach::Skin, found, metrics, &mut |arm, found| {
        deep_enough(arm, depth_mm)?;
        let (mut surface_mm, mut squares, mut n) = (0.0_f64, 0.0, 0);
        for at in arm.room.presses.clone() {
            for _ in 0..presses {
                arm.above(at)?;
                let touched_mm = arm.touch()?;
                let mut seen = Vec::new();
                let bottom = at.at_height(touched_mm - depth_mm);
                arm.send(bottom, INDENT_MM_S)?;
                let down = HostDuration::from_secs_f64(
                    (arm.search.band_mm * 2.0 + depth_mm) / INDENT_MM_S,
                );
                arm.watch(HostDuration(down.0 + SETTLE.0), &mut seen, |_| false)?;
                arm.go(at.at_height(arm.search.band_mm), INDENT_MM_S)?;
                let reached_mm = touched_mm - mean(last(&seen, MEAN_OVER)).z_mm;
                squares += (reached_mm - depth_mm).powi(2);
                surface_mm = surface_mm.max(touched_mm.abs());
                n += 1;
            }
        }
        found.value(ROBOT, "surface", surface_mm).of(n, 3);
        let error_mm = (squares / n as f64).sqrt();
        found.value(ROBOT, "error", error_mm).of(n, 3);
        Ok(())
    });
}

/// Nothing to press.
fn without_skin(bench: &dyn Bench, found: &mut Findings) -> bool {
    let off = bench.rig().robot.sample_is_off;
    if off {
        found.not_here = Some("the rig file says `robot.sample_is_off: true`".to_owned());
    }
    off
}

/// A touch may lie at the lower end of the band.
fn deep_enough(arm: &Arm<'_>, depth_mm: f64) -> Result<(), Trouble> {
    let (need_mm, most_mm) = (depth_mm + arm.search.band_mm, arm.room.limits.max_depth_mm);
    if need_mm <= most_mm {
        return Ok(());
    }
    Err(refused(
        format!(
            "expected `limits.max_depth` of the rig file to be at least {need_mm} mm (depth and band of the touch), found {most_mm} mm"
        ),
        "make `depth` of the check smaller",
    ))
}

/// Makes the check.
pub fn force_ceiling(check: &Check, bench: &mut dyn Bench, found: &mut Findings) {
    let Measure::ForceCeiling { force_n, depth_mm } = check.measure else {
        return;
    };
    if without_skin(bench, found) {
        return;
    }
    let metrics = &["peak", "trips"];
    with_arm(bench, Reach::Skin, found, metrics, &mut |arm, found| {
        deep_enough(arm, depth_mm)?;
        let at = arm.room.middle;
        let [high, ..] = arm.room.air();
        arm.go(high, super::robot::TRAVEL_MM_S)?;
        let settings = arm.limit_force(Some(force_n))?;
        carries_itself(arm, force_n)?;
        arm.above(at)?;
        let mut seen = Vec::new();
        arm.send(at.at_height(-depth_mm), INDENT_MM_S)?;
        let down = HostDuration::from_secs_f64((depth_mm + arm.search.band_mm) / INDENT_MM_S);
        let pressed = arm.watch(HostDuration(down.0 + SETTLE.0), &mut seen, |_| false);
        let peak_n = peak_n(&seen);
        let trips = match pressed {
            // The robot took its own power away: that is one way to hold a limit.
            Err(why) if why.kind == EvidenceKind::State => {
                found.evidence.push(*why);
                1.0
            }
            Err(why) => return Err(why),
            Ok(()) => {
                arm.go(at.at_height(arm.search.band_mm), INDENT_MM_S)?;
                arm.limit_force(None)?;
                0.0
            }
        };
        let enough = peak_n >= REACHED * force_n;
        let read_back = settings.iter().find(|s| s.name == "max_force_n");
        let read_back = read_back.map_or("nothing", |s| s.read_back.as_str());
        let lowest_mm = seen.iter().map(|s| -s.measured.z_mm).fold(0.0, f64::max);
        found
            .value(ROBOT, "peak", peak_n)
            .of(usize::from(enough), 1)
            .noting(format!(
                "limit {force_n} N, read back {read_back}; sent {depth_mm} mm deep, came {lowest_mm:.2} mm"
            ));
        found.value(ROBOT, "trips", trips).of(1, 1);
        if !enough {
            let what = format!(
                "expected a force of about {force_n} N, found {peak_n:.2} N: the skin is too soft there for this depth"
            );
            let next = "make `depth` of the check larger, or `force` smaller";
            let few = Evidence::new(EvidenceKind::TooLittle, ROBOT, what);
            found.evidence.push(few.next(next));
        }
        Ok(())
    });
}

/// With too low a limit the motors do not carry the arm: that shows in free air, where sinking does no harm.
fn carries_itself(arm: &mut Arm<'_>, force_n: f64) -> Result<(), Trouble> {
    let from = arm.look()?.measured;
    let mut seen = Vec::new();
    let sinks = |s: &PoseSample| from.z_mm - s.measured.z_mm > SINKS_MM;
    arm.watch(SETTLE, &mut seen, sinks)?;
    if !seen.iter().any(sinks) {
        return Ok(());
    }
    arm.limit_force(None)?;
    Err(refused(
        format!(
            "expected the arm to carry itself with a limit of {force_n} N, found it sinking by more than {SINKS_MM} mm"
        ),
        "measure `robot.motor_force.gravity_ratio` of the rig file, or make `force` of the check larger",
    ))
}

fn peak_n(seen: &[PoseSample]) -> f64 {
    let told = seen.iter().map(|s| s.force_n.abs());
    told.filter(|f| f.is_finite()).fold(0.0, f64::max)
}
