//! Checks `watchdog_drill` and `stop_drill`: does everything that must stop the arm stop it?

use skinrig_model::{HostDuration, HostTime, Point3, PoseSample, Skin};
use skinrig_nightly::{Evidence, EvidenceKind};
use skinrig_protocol::rig::Drill;
use skinrig_protocol::suite::Check;

use super::robot::{TRAVEL_MM_S, last, mean};
use crate::arm::{Arm, Reach, with_arm};
use crate::bench::{Bench, Problem};
use crate::findings::Findings;

const ROBOT: &str = "robot";
/// Distance from the start at which the tip is told to stop, mm.
const STOP_AFTER_MM: f64 = 6.0;
/// Observation time after the stop.
const OBSERVATION: HostDuration = HostDuration::from_millis(1_000);
/// Averaging time of a position.
const AVERAGING: HostDuration = HostDuration::from_millis(100);
/// Distance from the final position within which the tip counts as at rest, mm.
const REST_TOLERANCE_MM: f64 = 0.1;

/// Runs the check.
pub(super) fn watchdog(_: &Check, bench: &mut dyn Bench, found: &mut Findings) {
    if skip_unless_permitted(bench, Drill::Watchdog, "watchdog", found) {
        return;
    }
    match bench.watchdog_drill() {
        Ok(result) => {
            match result.braked_within_s {
                Some(seconds) => {
                    let value = found
                        .value(ROBOT, "braked_within", seconds)
                        .with_samples(1, 1);
                    value.note = result.note;
                    value
                }
                None => found.unmeasured(ROBOT, "braked_within").with_note(
                    "the motors were still live when the robot was reopened; they are off now",
                ),
            };
            found
                .value(ROBOT, "drop", result.drop_mm)
                .with_samples(1, 1);
        }
        Err(why) => found.failed(*why, ROBOT, &["braked_within", "drop"]),
    }
}

/// Marks the check as not applicable unless the rig file permits the drill.
fn skip_unless_permitted(
    bench: &dyn Bench,
    drill: Drill,
    name: &str,
    found: &mut Findings,
) -> bool {
    let permitted = bench.permits(drill);
    if !permitted {
        found.not_applicable = Some(format!(
            "the rig file does not permit this drill; add `hil: {{drills: [{name}]}}`"
        ));
    }
    !permitted
}

/// Runs the check.
pub(super) fn stop(_: &Check, bench: &mut dyn Bench, found: &mut Findings) {
    if skip_unless_permitted(bench, Drill::Stop, "stop", found) {
        return;
    }
    let metrics = &["stopped_within", "distance"];
    with_arm(bench, Reach::Air, found, metrics, &mut |arm, found| {
        let [_, east, _, west, _] = arm.volume.air_points();
        let held = stop_between(arm, west, east, |arm| arm.hold())?;
        // Motors off, like an operator's third ctrl-C. The arm cannot be armed after it.
        let halted = stop_between(arm, west, east, |arm| arm.halt())?;
        let note = format!(
            "held: {:.0} ms, {:.2} mm; motors off: {:.0} ms, {:.2} mm",
            held.within_s * 1e3,
            held.distance_mm,
            halted.within_s * 1e3,
            halted.distance_mm
        );
        let within_s = held.within_s.max(halted.within_s);
        found
            .value(ROBOT, "stopped_within", within_s)
            .with_samples(2, 2)
            .with_note(note.as_str());
        let distance_mm = held.distance_mm.max(halted.distance_mm);
        found
            .value(ROBOT, "distance", distance_mm)
            .with_samples(2, 2)
            .with_note(note);
        Ok(())
    });
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
    order: impl FnOnce(&mut Arm<'_>) -> Result<HostTime, Problem>,
) -> Result<StopResponse, Problem> {
    arm.go(from, TRAVEL_MM_S)?;
    let mut seen = Vec::new();
    arm.send(to, TRAVEL_MM_S)?;
    let into = |s: &PoseSample| s.measured.distance_mm(from) >= STOP_AFTER_MM;
    arm.watch(HostDuration::from_millis(2_000), &mut seen, into)?;
    let Some(at) = seen.last().copied().filter(into) else {
        return Err(Box::new(
            Evidence::new(
                EvidenceKind::State,
                ROBOT,
                format!("expected the tip to move {STOP_AFTER_MM} mm within 2 s, found less"),
            )
            .next("check the arm: is anything in its way, does it move freely by hand?"),
        ));
    };
    let ordered = order(arm)?;
    seen.clear();
    arm.watch(OBSERVATION, &mut seen, |_| false)?;
    stop_response(&seen, at.measured, ordered).ok_or_else(|| {
        let what = "expected samples of the tip after the stop command, found none";
        Box::new(Evidence::new(EvidenceKind::DeviceLost, ROBOT, what))
    })
}

/// When and where the tip came to rest in the plane of its motion. A braked arm keeps sinking slowly.
fn stop_response(seen: &[PoseSample], at: Point3<Skin>, ordered: HostTime) -> Option<StopResponse> {
    let end = mean(last(seen, AVERAGING)).plane();
    let moves = |s: &PoseSample| s.measured.plane().distance_mm(end) > REST_TOLERANCE_MM;
    let rests = match seen.iter().rposition(moves) {
        Some(n) => seen.get(n + 1).or(seen.last())?,
        None => seen.first()?,
    };
    Some(StopResponse {
        within_s: (rests.t - ordered).as_secs_f64().max(0.0),
        distance_mm: end.distance_mm(at.plane()),
    })
}
