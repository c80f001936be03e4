//! Checks `watchdog_drill` and `stop_drill`: verify that a killed program and a stop command really
//! stop the arm.

use skinrig_model::{HostDuration, HostTime, Point3, PoseSample, Skin};
use skinrig_nightly::{Evidence, EvidenceKind};
use skinrig_protocol::rig::Drill;
use skinrig_protocol::suite::Check;

use super::robot::{TRAVEL_MM_S, last, mean};
use crate::arm::{Arm, Reach, with_arm};
use crate::bench::{Bench, Problem};
use crate::findings::Findings;

const ROBOT: &str = "robot";
/// Distance from the start at which the stop command is sent, mm.
const STOP_AFTER_MM: f64 = 6.0;
/// Observation time after the stop.
const OBSERVATION: HostDuration = HostDuration::from_millis(1_000);
/// Averaging time of a position.
const AVERAGING: HostDuration = HostDuration::from_millis(100);
/// Largest distance from the final position at which the tip counts as resting, mm.
const REST_TOLERANCE_MM: f64 = 0.1;

/// Runs the check.
pub(super) fn watchdog(_: &Check, bench: &mut dyn Bench, findings: &mut Findings) {
    if skip_unless_permitted(bench, Drill::Watchdog, "watchdog", findings) {
        return;
    }
    match bench.watchdog_drill() {
        Ok(result) => {
            match result.braked_within_s {
                Some(seconds) => {
                    let value = findings
                        .value(ROBOT, "braked_within", seconds)
                        .with_samples(1, 1);
                    value.note = result.note;
                    value
                }
                None => findings.unmeasured(ROBOT, "braked_within").with_note(
                    "the motors were still live when the robot was reopened; they are off now",
                ),
            };
            findings
                .value(ROBOT, "drop", result.drop_mm)
                .with_samples(1, 1);
        }
        Err(why) => findings.failed(*why, ROBOT, &["braked_within", "drop"]),
    }
}

/// Marks the check as not applicable unless the rig file permits the drill.
fn skip_unless_permitted(
    bench: &dyn Bench,
    drill: Drill,
    name: &str,
    findings: &mut Findings,
) -> bool {
    let permitted = bench.permits(drill);
    if !permitted {
        findings.not_applicable = Some(format!(
            "the rig file does not permit this drill; add `hil: {{drills: [{name}]}}`"
        ));
    }
    !permitted
}

/// Runs the check.
pub(super) fn stop(_: &Check, bench: &mut dyn Bench, findings: &mut Findings) {
    if skip_unless_permitted(bench, Drill::Stop, "stop", findings) {
        return;
    }
    with_arm(
        bench,
        Reach::Air,
        findings,
        &["stopped_within", "distance"],
        &mut stop_twice,
    );
}

/// Holds the arm in motion, then switches the motors off in motion.
fn stop_twice(arm: &mut Arm<'_>, findings: &mut Findings) -> Result<(), Problem> {
    let [_, east, _, west, _] = arm.volume.air_points();
    let held = stop_between(arm, west, east, |arm| arm.hold())?;
    // Switch the motors off, as an operator's third ctrl-C does. The arm cannot be armed afterwards.
    let halted = stop_between(arm, west, east, |arm| arm.halt())?;
    let note = format!(
        "at {} mm/s; held: {:.0} ms, {:.2} mm; motors off: {:.0} ms, {:.2} mm",
        arm.speed_mm_s(TRAVEL_MM_S),
        held.within_s * 1e3,
        held.distance_mm,
        halted.within_s * 1e3,
        halted.distance_mm
    );
    let within_s = held.within_s.max(halted.within_s);
    findings
        .value(ROBOT, "stopped_within", within_s)
        .with_samples(2, 2)
        .with_note(note.as_str());
    let distance_mm = held.distance_mm.max(halted.distance_mm);
    findings
        .value(ROBOT, "distance", distance_mm)
        .with_samples(2, 2)
        .with_note(note);
    Ok(())
}

/// Response to a stop command.
#[derive(Debug, Clone, Copy, PartialEq)]
struct StopResponse {
    within_s: f64,
    distance_mm: f64,
}

fn stop_between(
    arm: &mut Arm<'_>,
    from: Point3<Skin>,
    to: Point3<Skin>,
    stop_command: impl FnOnce(&mut Arm<'_>) -> Result<HostTime, Problem>,
) -> Result<StopResponse, Problem> {
    arm.go(from, TRAVEL_MM_S)?;
    let mut samples = Vec::new();
    arm.send(to, TRAVEL_MM_S)?;
    let has_moved = |s: &PoseSample| s.measured.distance_mm(from) >= STOP_AFTER_MM;
    arm.watch(HostDuration::from_millis(2_000), &mut samples, has_moved)?;
    let Some(at) = samples.last().copied().filter(has_moved) else {
        return Err(Box::new(
            Evidence::new(
                EvidenceKind::State,
                ROBOT,
                format!("expected the tip to move {STOP_AFTER_MM} mm within 2 s, found less"),
            )
            .next("check the arm: is anything in its way, does it move freely by hand?"),
        ));
    };
    let commanded_at = stop_command(arm)?;
    samples.clear();
    arm.watch(OBSERVATION, &mut samples, |_| false)?;
    stop_response(&samples, at.measured, commanded_at).ok_or_else(|| {
        let what = "expected samples of the tip after the stop command, found none";
        Box::new(Evidence::new(EvidenceKind::DeviceLost, ROBOT, what))
    })
}

/// Time and distance until the tip rests in the plane of its motion; vertical motion is ignored,
/// because a braked arm keeps sinking slowly.
fn stop_response(
    samples: &[PoseSample],
    at: Point3<Skin>,
    commanded_at: HostTime,
) -> Option<StopResponse> {
    let end = mean(last(samples, AVERAGING)).plane();
    let is_moving = |s: &PoseSample| s.measured.plane().distance_mm(end) > REST_TOLERANCE_MM;
    let at_rest = match samples.iter().rposition(is_moving) {
        Some(n) => samples.get(n + 1).or(samples.last())?,
        None => samples.first()?,
    };
    Some(StopResponse {
        within_s: (at_rest.t - commanded_at).as_secs_f64().max(0.0),
        distance_mm: end.distance_mm(at.plane()),
    })
}
