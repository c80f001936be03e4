//! Measured values of a golden campaign, in the units of the suite's metrics.

use skinrig_analysis::Analysis;
use skinrig_analysis::result::{Estimate, PressResult};
use skinrig_model::{Point2, PressRole};

use crate::device_evidence::SKIN;
use crate::findings::Findings;
use crate::golden_evidence;

/// Minimum number of presses for localisation metrics.
const PRESSES: u64 = 12;
/// Minimum number of locations for the spread between repetitions.
const LOCATIONS: u64 = 4;
/// Minimum number of reference presses at the start and at the end.
const REFERENCES: u64 = 2;
/// Positions closer than this are one location, mm.
const SAME_LOCATION_MM: f64 = 1e-6;
/// Half width of a 95 % interval in standard errors.
const Z: f64 = 1.96;
/// Metrics of events that belong to presses.
const PRESS_METRICS: [&str; 8] = [
    "rmse",
    "repeat_std",
    "latency",
    "press_events",
    "idle_events",
    "located",
    "reference_shift",
    "reference_events",
];

/// Adds the metrics of `analysis` to `findings`, and evidence of problems that make them unreliable.
/// `lost_bytes` is by camera.
pub(crate) fn add(analysis: &Analysis, lost_bytes: [u64; 2], findings: &mut Findings) {
    golden_evidence::add(analysis, lost_bytes, findings);
    // Without clocks no event can be assigned to a press. After a finding the presses are not those stated: deeper, displaced.
    if !(analysis.is_valid() && analysis.findings.is_empty()) {
        for metric in PRESS_METRICS {
            findings.unmeasured(SKIN, metric);
        }
        valid(analysis, findings);
        findings.value(SKIN, "lost", lost(lost_bytes));
        return;
    }
    let scored = &analysis.scored;
    estimate(findings, "rmse", scored.rmse_mm, 1.0, PRESSES);
    estimate(findings, "repeat_std", scored.repeat_std_mm, 1.0, LOCATIONS);
    let contact = analysis.latency.as_ref().and_then(|l| l.from_contact);
    match contact {
        Some(contact) => estimate(findings, "latency", contact.median_ms, 1e-3, PRESSES),
        None => {
            findings
                .unmeasured(SKIN, "latency")
                .with_note("the contact times do not come from a clock of their own");
        }
    }
    rates(analysis, findings);
    estimate(findings, "located", scored.located_rate, 100.0, PRESSES);
    valid(analysis, findings);
    references(analysis, findings);
    findings.value(SKIN, "lost", lost(lost_bytes));
}

fn lost([one, two]: [u64; 2]) -> f64 {
    (one + two) as f64
}

fn valid(analysis: &Analysis, findings: &mut Findings) {
    let counts = analysis.counts;
    if counts.planned == 0 {
        findings.unmeasured(SKIN, "valid");
        return;
    }
    let share = f64::from(counts.valid) / f64::from(counts.planned);
    findings
        .value(SKIN, "valid", 100.0 * share)
        .with_samples(counts.planned as usize, PRESSES);
}

fn estimate(findings: &mut Findings, metric: &'static str, e: Estimate, unit: f64, needs: u64) {
    let value = match e.value {
        Some(value) => findings.value(SKIN, metric, unit * value),
        None => findings.unmeasured(SKIN, metric),
    };
    value.with_samples(e.n as usize, needs);
    value.interval = e
        .low
        .zip(e.high)
        .map(|(low, high)| [unit * low, unit * high]);
}

/// Event rates of both cameras together, over the valid presses.
fn rates(analysis: &Analysis, findings: &mut Findings) {
    let both = |of: fn(&PressResult, usize) -> Option<f64>| -> Vec<f64> {
        let valid = analysis
            .presses
            .iter()
            .filter(|p| p.verdict == skinrig_model::Verdict::Valid);
        let sums = valid.map(|p| Some(of(p, 0)? + of(p, 1)?));
        sums.flatten().collect()
    };
    let pressed = both(|p, camera| Some(p.views[camera]?.rate_per_s));
    let idle = both(|p, camera| {
        let view = p.views[camera]?;
        (view.idle_s > 0.0).then_some(view.idle_rate_per_s)
    });
    for (metric, rates) in [("press_events", pressed), ("idle_events", idle)] {
        let n = rates.len();
        match Sample::of(&rates) {
            Some(sample) => {
                let value = findings
                    .value(SKIN, metric, sample.mean)
                    .with_samples(n, PRESSES);
                value.interval = sample.interval();
            }
            None => {
                findings.unmeasured(SKIN, metric);
            }
        }
    }
}

/// Compares presses at the reference location (that of the first scored press) at the start of the
/// campaign with those at its end.
fn references(analysis: &Analysis, findings: &mut Findings) {
    let scored = |p: &&PressResult| p.role == PressRole::Score;
    let scored: Vec<&PressResult> = analysis.presses.iter().filter(scored).collect();
    let Some(first) = scored.first() else {
        findings.unmeasured(SKIN, "reference_shift");
        findings.unmeasured(SKIN, "reference_events");
        return;
    };
    let is_reference = |p: &&&PressResult| p.planned.distance_mm(first.planned) <= SAME_LOCATION_MM;
    let start: Vec<&PressResult> = scored.iter().take_while(is_reference).copied().collect();
    let end = scored.iter().rev().take_while(is_reference).copied();
    let end: Vec<&PressResult> = end.take(scored.len() - start.len()).collect();
    shift(&start, &end, findings);
    events(&start, &end, findings);
}

/// Distance between the mean estimates at start and end.
fn shift(start: &[&PressResult], end: &[&PressResult], findings: &mut Findings) {
    let estimates = |presses: &[&PressResult]| -> Vec<Point2> {
        presses.iter().filter_map(|p| p.estimate()).collect()
    };
    let (start, end) = (estimates(start), estimates(end));
    let along = |points: &[Point2], of: fn(&Point2) -> f64| {
        Sample::of(&points.iter().map(of).collect::<Vec<f64>>())
    };
    let axes: Option<Vec<(Sample, Sample)>> = [|p: &Point2| p.x_mm, |p: &Point2| p.y_mm]
        .into_iter()
        .map(|of: fn(&Point2) -> f64| Some((along(&start, of)?, along(&end, of)?)))
        .collect();
    let n = start.len().min(end.len());
    let Some(axes) = axes else {
        findings
            .unmeasured(SKIN, "reference_shift")
            .with_samples(n, REFERENCES);
        return;
    };
    let square: f64 = axes.iter().map(|(a, b)| (b.mean - a.mean).powi(2)).sum();
    let shift_mm = square.sqrt();
    let variance: f64 = axes
        .iter()
        .map(|(a, b)| a.variance_of_mean() + b.variance_of_mean())
        .sum();
    let value = findings
        .value(SKIN, "reference_shift", shift_mm)
        .with_samples(n, REFERENCES);
    if variance.is_finite() {
        let half = Z * variance.sqrt();
        value.interval = Some([(shift_mm - half).max(0.0), shift_mm + half]);
    }
}

/// Events of both cameras at the end as a percentage of the start.
fn events(start: &[&PressResult], end: &[&PressResult], findings: &mut Findings) {
    let counts = |presses: &[&PressResult]| -> Vec<f64> {
        let sums = presses.iter().map(|p| {
            let [one, two] = p.views;
            Some(f64::from(one?.events) + f64::from(two?.events))
        });
        sums.flatten().collect()
    };
    let (start, end) = (counts(start), counts(end));
    let n = start.len().min(end.len());
    let ratio = Sample::of(&start)
        .zip(Sample::of(&end))
        .filter(|(a, _)| a.mean > 0.0);
    let Some((a, b)) = ratio else {
        findings
            .unmeasured(SKIN, "reference_events")
            .with_samples(n, REFERENCES);
        return;
    };
    let share = b.mean / a.mean;
    // Relative variances add to first order.
    let relative = a.variance_of_mean() / a.mean.powi(2) + b.variance_of_mean() / b.mean.powi(2);
    let value = findings
        .value(SKIN, "reference_events", 100.0 * share)
        .with_samples(n, REFERENCES);
    if relative.is_finite() {
        let half = Z * share * relative.sqrt();
        value.interval = Some([100.0 * (share - half), 100.0 * (share + half)]);
    }
}

/// Mean and spread of a few numbers.
#[derive(Debug, Clone, Copy)]
struct Sample {
    mean: f64,
    /// Divided by n - 1; infinite for n = 1.
    variance: f64,
    n: f64,
}

impl Sample {
    fn of(values: &[f64]) -> Option<Self> {
        let n = values.len() as f64;
        if values.is_empty() {
            return None;
        }
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
        let variance = if n > 1.0 {
            squares / (n - 1.0)
        } else {
            f64::INFINITY
        };
        Some(Self { mean, variance, n })
    }

    /// Variance of the mean.
    fn variance_of_mean(&self) -> f64 {
        self.variance / self.n
    }

    fn interval(&self) -> Option<[f64; 2]> {
        let half = Z * self.variance_of_mean().sqrt();
        half.is_finite()
            .then_some([self.mean - half, self.mean + half])
    }
}

#[cfg(test)]
mod tests {
    use skinrig_analysis::analyze;
    use skinrig_analysis::result::{Evidence, Fault, Finding, Law};

    use super::*;

    /// The error of presses that were deeper than stated is no error of the skin, however small.
    #[test]
    fn a_session_with_a_finding_measures_nothing_of_the_skin() {
        let (input, events) = skinrig_planted::grid::session();
        let mut analysis = analyze(&input, &events).expect("an analysis");
        let rmse = |analysis: &Analysis| {
            let mut findings = Findings::default();
            add(analysis, [0; 2], &mut findings);
            let rmse = findings.values.iter().find(|v| v.metric == "rmse");
            (rmse.expect("the metric").value, findings.evidence.len())
        };
        assert!(matches!(rmse(&analysis), (Some(_), 0)));
        analysis.findings.push(Finding {
            law: Law::AsCommanded,
            fault: Fault::HeightOff,
            camera: None,
            evidence: Evidence::Unlisted {
                listed: 1,
                more: 1,
                from_s: 0.0,
                to_s: 1.0,
            },
            advice: String::new(),
            invalidates: false,
        });
        assert!(analysis.is_valid());
        assert_eq!(rmse(&analysis), (None, 1));
    }
}
