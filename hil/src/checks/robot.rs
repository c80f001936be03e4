//! Checks `robot_state`, `repeatability` and `step_response`: the robot in free air.

use skinrig_model::{HostDuration, Point3, PoseSample, Skin};
use skinrig_nightly::EvidenceKind;
use skinrig_protocol::suite::{Check, Measure};

use crate::arm::{Arm, Reach, with_arm};
use crate::bench::{Bench, Problem};
use crate::findings::Findings;

const ROBOT: &str = "robot";
/// Travel speed in free air where a check has no speed parameter, mm/s.
pub(super) const TRAVEL_MM_S: f64 = 40.0;
/// Rest time.
const REST: HostDuration = HostDuration::from_millis(1_000);
/// Averaging time of a position.
const AVERAGING: HostDuration = HostDuration::from_millis(100);
/// Distance from which a point is approached, mm.
const APPROACH_MM: f64 = 4.0;
/// Largest distance from the target at which the tip counts as settled, mm.
const SETTLE_TOLERANCE_MM: f64 = 0.1;
/// Largest distance from the target at which the set point counts as arrived, mm.
const SET_POINT_TOLERANCE_MM: f64 = 1e-3;

/// Runs the check.
pub(super) fn robot_state(_: &Check, bench: &mut dyn Bench, findings: &mut Findings) {
    with_arm(
        bench,
        Reach::Air,
        findings,
        &["creep"],
        &mut |arm, findings| {
            let mut samples = Vec::new();
            arm.watch(REST, &mut samples, |_| false)?;
            if let Some(creep_mm) = creep_mm(&samples) {
                findings
                    .value(ROBOT, "creep", creep_mm)
                    .with_samples(samples.len(), MIN_SAMPLES);
            }
            Ok(())
        },
    );
    let is_fault = |kind: &EvidenceKind| {
        use EvidenceKind as K;
        matches!(kind, K::State | K::ReadBack | K::Refused | K::Trip)
    };
    let n = findings
        .evidence
        .iter()
        .filter(|e| is_fault(&e.kind))
        .count();
    // Faults are unknown if the robot is missing.
    if n == findings.evidence.len() {
        findings.value(ROBOT, "faults", n as f64);
    } else {
        findings.unmeasured(ROBOT, "faults");
    }
}

/// Samples needed to locate a resting tip.
const MIN_SAMPLES: u64 = 50;

/// Largest distance between the first mean position and any later one, mm.
fn creep_mm(samples: &[PoseSample]) -> Option<f64> {
    let begin = samples.first()?.t;
    let window = |s: &PoseSample| (s.t - begin).0 / AVERAGING.0;
    let positions = samples.chunk_by(|a, b| window(a) == window(b)).map(mean);
    let positions: Vec<Point3<Skin>> = positions.collect();
    let first = *positions.first()?;
    Some(
        positions
            .iter()
            .map(|p| p.distance_mm(first))
            .fold(0.0, f64::max),
    )
}

/// Mean position of a non-empty list of samples.
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

/// Runs the check.
pub(super) fn repeatability(check: &Check, bench: &mut dyn Bench, findings: &mut Findings) {
    let Measure::Repeatability {
        approaches,
        speed_mm_s,
    } = check.measure
    else {
        return;
    };
    with_arm(
        bench,
        Reach::Air,
        findings,
        &["spread", "error"],
        &mut |arm, findings| approach_points(arm, findings, approaches, speed_mm_s),
    );
}

fn approach_points(
    arm: &mut Arm<'_>,
    findings: &mut Findings,
    approaches: u32,
    speed_mm_s: f64,
) -> Result<(), Problem> {
    let points = arm.volume.air_points();
    let mut positions = vec![Vec::new(); points.len()];
    for approach in 0..approaches {
        for (target, positions) in points.iter().zip(&mut positions) {
            let from = approach_start(*target, approach, approaches);
            positions.push(approach_from(arm, from, *target, speed_mm_s)?);
        }
    }
    let n = positions.iter().map(Vec::len).sum::<usize>();
    let spread_mm = spread_mm(&positions);
    findings
        .value(ROBOT, "spread", spread_mm)
        .with_samples(n, 10);
    let errors_mm = points
        .iter()
        .zip(&positions)
        .flat_map(|(target, positions)| positions.iter().map(|p| p.distance_mm(*target)));
    let error_mm = errors_mm.sum::<f64>() / n as f64;
    findings.value(ROBOT, "error", error_mm).with_samples(n, 10);
    Ok(())
}

/// Start of approach `n` of `of`: from a different side each time, alternately from above and from
/// below.
fn approach_start(target: Point3<Skin>, n: u32, of: u32) -> Point3<Skin> {
    let (sin, cos) = libm::sincos(std::f64::consts::TAU * f64::from(n) / f64::from(of));
    let up = if n.is_multiple_of(2) { 1.0 } else { -1.0 };
    let [x, y, z] = target.to_array();
    let aside = APPROACH_MM * std::f64::consts::FRAC_1_SQRT_2;
    Point3::new(x + aside * cos, y + aside * sin, z + aside * up)
}

/// Position where the tip comes to rest.
fn approach_from(
    arm: &mut Arm<'_>,
    from: Point3<Skin>,
    target: Point3<Skin>,
    speed_mm_s: f64,
) -> Result<Point3<Skin>, Problem> {
    arm.go(from, speed_mm_s)?;
    arm.go(target, speed_mm_s)?;
    let mut samples = vec![arm.pose()?];
    arm.watch(HostDuration(3 * AVERAGING.0), &mut samples, |_| false)?;
    Ok(mean(last(&samples, AVERAGING)))
}

/// Samples of the last `span`; not empty unless `samples` is.
pub(super) fn last(samples: &[PoseSample], span: HostDuration) -> &[PoseSample] {
    let Some(end) = samples.last() else {
        return samples;
    };
    let first = samples.partition_point(|s| end.t - s.t > span);
    &samples[first..]
}

/// Pooled standard deviation about the means over all axes, mm: root of the sum of squares over the degrees of freedom.
fn spread_mm(positions: &[Vec<Point3<Skin>>]) -> f64 {
    let (mut squares, mut freedom) = (0.0, 0.0);
    for positions in positions {
        let n = positions.len() as f64;
        for axis in 0..3 {
            let of = |p: &Point3<Skin>| p.to_array()[axis];
            let mean = positions.iter().map(of).sum::<f64>() / n;
            squares += positions
                .iter()
                .map(|p| (of(p) - mean).powi(2))
                .sum::<f64>();
        }
        freedom += n - 1.0;
    }
    (squares / freedom).sqrt()
}

/// Runs the check.
pub(super) fn step_response(check: &Check, bench: &mut dyn Bench, findings: &mut Findings) {
    let Measure::StepResponse { distance_mm, steps } = check.measure else {
        return;
    };
    with_arm(
        bench,
        Reach::Air,
        findings,
        &["settling", "overshoot", "error"],
        &mut |arm, findings| measure_steps(arm, findings, distance_mm, steps),
    );
}

fn measure_steps(
    arm: &mut Arm<'_>,
    findings: &mut Findings,
    distance_mm: f64,
    steps: u32,
) -> Result<(), Problem> {
    let [centre, ..] = arm.volume.air_points();
    let mut responses = Vec::new();
    arm.go(centre, TRAVEL_MM_S)?;
    let mut from = centre;
    for n in 0..steps {
        let target = if n.is_multiple_of(2) {
            step_target(centre, distance_mm, n / 2)
        } else {
            centre
        };
        let response = measure_step(arm, from, target)?;
        responses.extend(response);
        from = target;
    }
    let n = responses.len();
    let most = |of: fn(&Response) -> f64| responses.iter().map(of).fold(0.0, f64::max);
    let mut settling: Vec<f64> = responses.iter().map(|r| r.settling_s).collect();
    settling.sort_by(f64::total_cmp);
    if let Some(median) = settling.get(n / 2) {
        findings
            .value(ROBOT, "settling", *median)
            .with_samples(n, 3)
            .with_note(format!("at {} mm/s", arm.speed_mm_s(TRAVEL_MM_S)));
        findings
            .value(ROBOT, "overshoot", most(|r| r.overshoot_mm))
            .with_samples(n, 3);
        findings
            .value(ROBOT, "error", most(|r| r.error_mm))
            .with_samples(n, 3);
    }
    Ok(())
}

/// Target of step `n`: alternately along +x, +y, -x and -y.
fn step_target(centre: Point3<Skin>, distance_mm: f64, n: u32) -> Point3<Skin> {
    let (sin, cos) = libm::sincos(f64::from(n) * std::f64::consts::FRAC_PI_2);
    let [x, y, z] = centre.to_array();
    Point3::new(x + distance_mm * cos, y + distance_mm * sin, z)
}

/// Response of the tip to a step.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Response {
    settling_s: f64,
    overshoot_mm: f64,
    error_mm: f64,
}

fn measure_step(
    arm: &mut Arm<'_>,
    from: Point3<Skin>,
    target: Point3<Skin>,
) -> Result<Option<Response>, Problem> {
    let mut samples = Vec::new();
    let t = arm.send(target, TRAVEL_MM_S)?;
    let has_arrived =
        move |s: &PoseSample| s.t > t && s.commanded.distance_mm(target) <= SET_POINT_TOLERANCE_MM;
    arm.watch(HostDuration::from_millis(5_000), &mut samples, has_arrived)?;
    arm.watch(REST, &mut samples, |_| false)?;
    Ok(evaluate_step(&samples, from, target, has_arrived))
}

/// Evaluates the samples of a step. `None`: the set point never arrived.
fn evaluate_step(
    samples: &[PoseSample],
    from: Point3<Skin>,
    target: Point3<Skin>,
    has_arrived: impl Fn(&PoseSample) -> bool,
) -> Option<Response> {
    let end = samples.iter().position(has_arrived)?;
    let after = &samples[end..];
    let (begin, last_seen) = (after.first()?.t, after.last()?.t);
    let error_mm = |s: &PoseSample| s.measured.distance_mm(target);
    let outside = after
        .iter()
        .rposition(|s| error_mm(s) > SETTLE_TOLERANCE_MM);
    let settled = match outside.map(|n| after.get(n + 1)) {
        None => begin,
        Some(Some(s)) => s.t,
        Some(None) => last_seen,
    };
    let distance_mm = target.distance_mm(from);
    let overshoot_mm = |s: &PoseSample| {
        let parts = (0..3).map(|i| {
            let of = |p: Point3<Skin>| p.to_array()[i];
            (of(s.measured) - of(target)) * (of(target) - of(from)) / distance_mm
        });
        parts.sum::<f64>()
    };
    Some(Response {
        settling_s: (settled - begin).as_secs_f64(),
        overshoot_mm: samples.iter().map(overshoot_mm).fold(0.0, f64::max),
        error_mm: mean(last(after, AVERAGING)).distance_mm(target),
    })
}
