//! Checks: drills: what must stop the arm stops it.

use skinrig_model::{HostDuration, HostTime, Point3, PoseSample, Skin};
use skinrig_nightly::{Evidence, EvidenceKind};
use skinrig_protocol::rig::Drill;
use skinrig_protocol::suite::Check;

use super::robot::{TRAVEL_MM_S, last, mean};
use crate::arm::{Arm, Reach, with_arm};
use crate::bench::{Bench, Trouble};
use crate::findings::Findings;

const ROBOT: &str = "robot";
/// The tip is stopped after this much of its way, mm.
const INTO_MM: f64 = 6.0;
/// It is looked at for so long after that.
const AFTER: HostDuration = HostDuration::from_millis(1_000);
/// A place is a mean over so long a time.
const MEAN_OVER: HostDuration = HostDuration::from_millis(100);
/// Nearer to where it ends than this it rests, mm.
const RESTS_MM: f64 = 0.1;

/// Makes the check.
pub fn watchdog(_: &Check, bench: &mut dyn Bench, found: &mut Findings) {
    if not_permitted(bench, Drill::Watchdog, "watchdog", found) {
        return;
    }
    match bench.watchdog_drill() {
        Ok(drilled) => {
            match drilled.braked_within_s {
                Some(seconds) => {
                    let value = found.value(ROBOT, "braked_within", seconds).of(1, 1);
                    value.note = drilled.note;
                    value
                }
                None => found.unmeasured(ROBOT, "braked_within").noting(
                    "the motors were still live when the robot was opened again; they are off now",
                ),
            };
            found.value(ROBOT, "drop", drilled.drop_mm).of(1, 1);
        }
        Err(why) => found.trouble(*why, ROBOT, &["braked_within", "drop"]),
    }
}

/// A bench of hardware says in its rig file which drills it permits.
fn not_permitted(bench: &dyn Bench, drill: Drill, name: &str, found: &mut Findings) -> bool {
    let permitted = bench.permits(drill);
    if !permitted {
        found.not_here = Some(format!(
            "the rig file does not permit it; `hil: {{drills: [{name}]}}` does"
        ));
    }
    !permitted
}

/// Makes the check.
pub fn stop(_: &Check, bench: &mut dyn Bench, found: &mut Findings) {
    if not_permitted(bench, Drill::Stop, "stop", found) {
        return;
    }
    let metrics = &["stopped_within", "distance"];
    with_arm(bench, Reach::Air, found, metrics, &mut |arm, found| {
        let [_, east, _, west, _] = arm.room.air();
        let held = stop_between(arm, west, east, |arm| arm.hold())?;
        // Motors off: what an operator's third ctrl-C does. The arm is armed no more after it.
        let halted = stop_between(arm, west, east, |arm| arm.halt())?;
        let words = format!(
            "held: {:.0} ms, {:.2} mm; motors off: {:.0} ms, {:.2} mm",
            held.within_s * 1e3,
            held.way_mm,
            halted.within_s * 1e3,
            halted.way_mm
        );
        let within_s = held.within_s.max(halted.within_s);
        found
            .value(ROBOT, "stopped_within", within_s)
            .of(2, 2)
            .noting(words.as_str());
        let way_mm = held.way_mm.max(halted.way_mm);
        found
            .value(ROBOT, "distance", way_mm)
            .of(2, 2)
            .noting(words);
        Ok(())
    });
}

/// How a stop went.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stopped {
    within_s: f64,
    way_mm: f64,
}

fn stop_between(
    arm: &mut Arm<'_>,
    from: Point3<Skin>,
    to: Point3<Skin>,
    order: impl FnOnce(&mut Arm<'_>) -> Result<HostTime, Trouble>,
) -> Result<Stopped, Trouble> {
    arm.go(from, TRAVEL_MM_S)?;
    let mut seen = Vec::new();
    arm.send(to, TRAVEL_MM_S)?;
    let into = |s: &PoseSample| s.measured.distance_mm(from) >= INTO_MM;
    arm.watch(HostDuration::from_millis(2_000), &mut seen, into)?;
    let Some(at) = seen.last().copied().filter(into) else {
        return Err(Box::new(
            Evidence::new(
                EvidenceKind::State,
                ROBOT,
                format!(
                    "expected the tip to be {INTO_MM} mm on its way within 2 s, found it nearer"
                ),
            )
            .next("look at the arm: is anything in its way, does it move freely by hand?"),
        ));
    };
    let ordered = order(arm)?;
    seen.clear();
    arm.watch(AFTER, &mut seen, |_| false)?;
    stopped(&seen, at.measured, ordered).ok_or_else(|| {
        let what = "expected samples of the tip after it was told to stop, found none";
        Box::new(Evidence::new(EvidenceKind::DeviceLost, ROBOT, what))
    })
}

/// When and where it came to rest: sideways, as it moved. Braked, it goes on to sink slowly.
fn stopped(seen: &[PoseSample], at: Point3<Skin>, ordered: HostTime) -> Option<Stopped> {
    let end = mean(last(seen, MEAN_OVER)).plane();
    let moves = |s: &PoseSample| s.measured.plane().distance_mm(end) > RESTS_MM;
    let rests = match seen.iter().rposition(moves) {
        Some(n) => seen.get(n + 1).or(seen.last())?,
        None => seen.first()?,
    };
    Some(Stopped {
        within_s: (rests.t - ordered).as_secs_f64().max(0.0),
        way_mm: end.distance_mm(at.plane()),
    })
}
