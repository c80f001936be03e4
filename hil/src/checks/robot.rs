//! Checks: the robot in free air.

use skinrig_model::{HostDuration, Point3, PoseSample, Skin};
use skinrig_nightly::EvidenceKind;
use skinrig_protocol::suite::{Check, Measure};

use crate::arm::{Arm, Reach, with_arm};
use crate::bench::{Bench, Trouble};
use crate::findings::Findings;

const ROBOT: &str = "robot";
/// Between two points in free air, where the check itself says no speed, mm/s.
pub(super) const TRAVEL_MM_S: f64 = 40.0;
/// Held still for so long.
const STILL: HostDuration = HostDuration::from_millis(1_000);
/// Over so long a time a place is a mean.
const MEAN_OVER: HostDuration = HostDuration::from_millis(100);
/// A point is approached from this far aside, mm.
const FROM_MM: f64 = 4.0;
/// A tip this near its target has settled, mm.
const SETTLED_MM: f64 = 0.1;
/// A set point this near its target is there, mm.
const THERE_MM: f64 = 1e-3;

/// Makes the check.
pub fn robot_state(_: &Check, bench: &mut dyn Bench, found: &mut Findings) {
    with_arm(bench, Reach::Air, found, &["creep"], &mut |arm, found| {
        let mut seen = Vec::new();
        arm.watch(STILL, &mut seen, |_| false)?;
        if let Some(creep_mm) = creep_mm(&seen) {
            found
                .value(ROBOT, "creep", creep_mm)
                .of(seen.len(), ENOUGH_SAMPLES);
        }
        Ok(())
    });
    let faults = |kind: &EvidenceKind| {
        use EvidenceKind as K;
        matches!(kind, K::State | K::ReadBack | K::Refused | K::Trip)
    };
    let n = found.evidence.iter().filter(|e| faults(&e.kind)).count();
    // Nothing is known of a robot that is not there.
    if n == found.evidence.len() {
        found.value(ROBOT, "faults", n as f64);
    } else {
        found.unmeasured(ROBOT, "faults");
    }
}

/// So many samples tell where a tip is that stands still.
const ENOUGH_SAMPLES: u64 = 50;

/// How far the mean place moved away from the first, mm.
fn creep_mm(seen: &[PoseSample]) -> Option<f64> {
    let begin = seen.first()?.t;
    let window = |s: &PoseSample| (s.t - begin).0 / MEAN_OVER.0;
    let places = seen.chunk_by(|a, b| window(a) == window(b)).map(mean);
    let places: Vec<Point3<Skin>> = places.collect();
    let first = *places.first()?;
    Some(
        places
            .iter()
            .map(|p| p.distance_mm(first))
            .fold(0.0, f64::max),
    )
}

/// The mean place of a non-empty list.
pub(super) fn mean(samples: &[PoseSample]) -> Point3<Skin> {
    let n = samples.len() as f64;
    let mut sum = [0.0; 3];
    for s in samples {
        for (sum, x) in sum.iter_mut().zip(s.measured.to_array()) {
            *sum += x / n;
        }
    }
    let [x, y, z] = sum;
    Point3::new(x, y, z)
}

/// Makes the check.
pub fn repeatability(check: &Check, bench: &mut dyn Bench, found: &mut Findings) {
    let Measure::Repeatability {
        approaches,
        speed_mm_s,
    } = check.measure
    else {
        return;
    };
    let metrics = &["spread", "error"];
    with_arm(bench, Reach::Air, found, metrics, &mut |arm, found| {
        let points = arm.room.air();
        let mut places = vec![Vec::new(); points.len()];
        for approach in 0..approaches {
            for (target, places) in points.iter().zip(&mut places) {
                let from = beside(*target, approach, approaches);
                places.push(approach_from(arm, from, *target, speed_mm_s)?);
            }
        }
        let n = places.iter().map(Vec::len).sum::<usize>();
        let spread_mm = spread_mm(&places);
        found.value(ROBOT, "spread", spread_mm).of(n, 10);
        let off = points
            .iter()
            .zip(&places)
            .flat_map(|(target, places)| places.iter().map(|p| p.distance_mm(*target)));
        let error_mm = off.sum::<f64>() / n as f64;
        found.value(ROBOT, "error", error_mm).of(n, 10);
        Ok(())
    });
}

/// Where the `n`-th of `of` approaches comes from: another side each time, from above and from below in turn.
fn beside(target: Point3<Skin>, n: u32, of: u32) -> Point3<Skin> {
    let (sin, cos) = (std::f64::consts::TAU * f64::from(n) / f64::from(of)).sin_cos();
    let up = if n.is_multiple_of(2) { 1.0 } else { -1.0 };
    let [x, y, z] = target.to_array();
    let aside = FROM_MM * std::f64::consts::FRAC_1_SQRT_2;
    Point3::new(x + aside * cos, y + aside * sin, z + aside * up)
}

/// Where the tip comes to rest.
fn approach_from(
    arm: &mut Arm<'_>,
    from: Point3<Skin>,
    target: Point3<Skin>,
    speed_mm_s: f64,
) -> Result<Point3<Skin>, Trouble> {
    arm.go(from, speed_mm_s)?;
    arm.go(target, speed_mm_s)?;
    let mut seen = vec![arm.look()?];
    arm.watch(HostDuration(3 * MEAN_OVER.0), &mut seen, |_| false)?;
    Ok(mean(last(&seen, MEAN_OVER)))
}

/// The samples of the last `span`; not empty when `seen` is not.
pub(super) fn last(seen: &[PoseSample], span: HostDuration) -> &[PoseSample] {
    let Some(end) = seen.last() else { return seen };
    let first = seen.partition_point(|s| end.t - s.t > span);
    &seen[first..]
}

/// Pooled standard deviation about the means, all axes together, mm: the root of the sum of squares over the degrees of freedom.
fn spread_mm(places: &[Vec<Point3<Skin>>]) -> f64 {
    let (mut squares, mut freedom) = (0.0, 0.0);
    for places in places {
        let n = places.len() as f64;
        for axis in 0..3 {
            let of = |p: &Point3<Skin>| p.to_array()[axis];
            let mean = places.iter().map(of).sum::<f64>() / n;
            squares += places.iter().map(|p| (of(p) - mean).powi(2)).sum::<f64>();
        }
        freedom += n - 1.0;
    }
    (squares / freedom).sqrt()
}

/// Makes the check.
pub fn step_response(check: &Check, bench: &mut dyn Bench, found: &mut Findings) {
    let Measure::StepResponse { distance_mm, steps } = check.measure else {
        return;
    };
    let metrics = &["settling", "overshoot", "error"];
    with_arm(bench, Reach::Air, found, metrics, &mut |arm, found| {
        let [middle, ..] = arm.room.air();
        let mut responses = Vec::new();
        arm.go(middle, TRAVEL_MM_S)?;
        let mut from = middle;
        for n in 0..steps {
            let target = if n.is_multiple_of(2) {
                step(middle, distance_mm, n / 2)
            } else {
                middle
            };
            let response = respond(arm, from, target)?;
            responses.extend(response);
            from = target;
        }
        let n = responses.len();
        let most = |of: fn(&Response) -> f64| responses.iter().map(of).fold(0.0, f64::max);
        let mut settling: Vec<f64> = responses.iter().map(|r| r.settling_s).collect();
        settling.sort_by(f64::total_cmp);
        if let Some(median) = settling.get(n / 2) {
            found.value(ROBOT, "settling", *median).of(n, 3);
            found
                .value(ROBOT, "overshoot", most(|r| r.overshoot_mm))
                .of(n, 3);
            found.value(ROBOT, "error", most(|r| r.error_mm)).of(n, 3);
        }
        Ok(())
    });
}

/// Aside along x, y, and back, in turn.
fn step(middle: Point3<Skin>, distance_mm: f64, n: u32) -> Point3<Skin> {
    let (sin, cos) = (f64::from(n) * std::f64::consts::FRAC_PI_2).sin_cos();
    let [x, y, z] = middle.to_array();
    Point3::new(x + distance_mm * cos, y + distance_mm * sin, z)
}

/// How a tip answered a step.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Response {
    settling_s: f64,
    overshoot_mm: f64,
    error_mm: f64,
}

fn respond(
    arm: &mut Arm<'_>,
    from: Point3<Skin>,
    target: Point3<Skin>,
) -> Result<Option<Response>, Trouble> {
    let mut seen = Vec::new();
    let t = arm.send(target, TRAVEL_MM_S)?;
    let there = move |s: &PoseSample| s.t > t && s.commanded.distance_mm(target) <= THERE_MM;
    arm.watch(HostDuration::from_millis(5_000), &mut seen, there)?;
    arm.watch(STILL, &mut seen, |_| false)?;
    Ok(response(&seen, from, target, there))
}

/// From the samples of a step. `None`: the set point never came there.
fn response(
    seen: &[PoseSample],
    from: Point3<Skin>,
    target: Point3<Skin>,
    there: impl Fn(&PoseSample) -> bool,
) -> Option<Response> {
    let end = seen.iter().position(there)?;
    let after = &seen[end..];
    let (begin, last_seen) = (after.first()?.t, after.last()?.t);
    let away = |s: &PoseSample| s.measured.distance_mm(target);
    let outside = after.iter().rposition(|s| away(s) > SETTLED_MM);
    let settled = match outside.map(|n| after.get(n + 1)) {
        None => begin,
        Some(Some(s)) => s.t,
        Some(None) => last_seen,
    };
    let way_mm = target.distance_mm(from);
    let beyond = |s: &PoseSample| {
        let parts = (0..3).map(|i| {
            let of = |p: Point3<Skin>| p.to_array()[i];
            (of(s.measured) - of(target)) * (of(target) - of(from)) / way_mm
        });
        parts.sum::<f64>()
    };
    Some(Response {
        settling_s: (settled - begin).as_secs_f64(),
        overshoot_mm: seen.iter().map(beyond).fold(0.0, f64::max),
        error_mm: mean(last(after, MEAN_OVER)).distance_mm(target),
    })
}
