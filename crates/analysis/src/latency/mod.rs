//! The detection-latency study: when the cameras detect a press.
//!
//! The method follows the paper ("Data Ablation and Latency Distribution Analysis"): bin and smooth the events of both
//! cameras, run a one-sided CUSUM tuned to a rate increase over the background, report an onset where it stays above a
//! threshold for some bins, and choose the threshold by detections against false alarms. Four things differ. Both cameras
//! are placed on host time by their own clock fits. Rates are events divided by the length of a window, with a floor. Where
//! the contact was measured, onsets are also reported as latencies from it, with their uncertainty. And the first detection
//! ends the search, as in online operation: one before contact is a false alarm, counted over the time in which there could
//! be one, and its press is not detected.
//!
//! [`spans`] defines trial and background, [`bins`] counts, [`smooth`] smooths, [`cusum`] detects, [`sweep`] chooses the
//! threshold, [`interval`] estimates, [`course`] prepares drawing.

pub mod bins;
pub mod course;
pub mod cusum;
pub mod interval;
pub mod smooth;
pub mod spans;
pub mod sweep;
pub mod thin;
pub mod trial;

use rayon::prelude::*;
use skinrig_model::{Background, PressRole};

use self::bins::HostTimeView;
use self::interval::{Estimates, Outcome, Plan};
use self::smooth::Boundary;
use self::spans::{Neighbours, Spans};
use self::trial::{Detector, Label, Trial};
use crate::metrics::quantile;
use crate::press_events::{RetainedPress, RetainedPresses};
use crate::result::{
    Analysis, ClockFit, ClockMethod, ContactLatency, Latency, MapName, ReducedLatency,
    ThresholdRow, TrialBackground,
};
use crate::verdict;
use skinrig_statistics::seeded;

/// First random stream for thinning events; the bootstrap counts from 0.
const THINNING: u64 = 1 << 40;

/// Studies the scored presses among `retained` that were executed as planned, whether or not the cameras saw them; presses that
/// the journal or the settings exclude by hand are not trials. `None` without any scored press or without a clock for both
/// cameras.
#[must_use]
pub fn study(analysis: &Analysis, retained: &RetainedPresses) -> Option<Latency> {
    let [Some(one), Some(two)] = analysis.clocks else {
        return None;
    };
    let clocks = [one, two];
    let settings = &analysis.settings.latency;
    let role = |p: &&RetainedPress| analysis.presses.get(p.row).map(|r| r.role);
    let presses = retained.presses.iter();
    let presses: Vec<&RetainedPress> = presses
        .filter(|p| role(p) == Some(PressRole::Score))
        .collect();
    if presses.is_empty() {
        return None;
    }
    let usable = usable(analysis, &clocks, &presses);
    let edges = match settings.background {
        Background::Before => Boundary::Renormalised,
        Background::After => Boundary::ZeroPadded,
    };
    let margin_ms = margin_ms(analysis, &clocks);
    let grid = sweep::thresholds(settings.thresholds);
    let detector = Detector::new(settings, edges, grid, margin_ms);
    let trials = run(&usable, &detector, None);
    let found = DetectorResult::new(analysis, &detector, settings.target_rate, &trials);

    let reduced_settings = settings.reduced;
    let few = sweep::thresholds(reduced_settings.thresholds.into());
    let few = Detector::new(settings, edges, few, margin_ms);
    let thinning = Some((reduced_settings.factor, analysis.settings.seed));
    let thinned = run(&usable, &few, thinning);
    let reduced = DetectorResult::new(analysis, &few, reduced_settings.target_rate, &thinned);

    let onset = |t: &Trial| found.chosen.and_then(|i| t.searches[i].onset_ms());
    let early = |t: &Trial| Some((t.label.press, t.searches[found.chosen?].false_alarm_ms()?));
    let mut rates: Vec<f64> = trials.iter().map(|t| t.background_per_s).collect();
    let covered = |f: fn(&Spans) -> f64| {
        usable
            .iter()
            .map(|u| f(&u.spans))
            .fold(f64::INFINITY, f64::min)
    };
    let covered_us = (covered(|s| -s.trial_us.0), covered(|s| s.trial_us.1));
    Some(Latency {
        settings: *settings,
        trials: trials.len() as u32,
        unusable: (presses.len() - trials.len()) as u32,
        shortened: usable.iter().filter(|u| u.spans.shortened).count() as u32,
        covered_ms: if usable.is_empty() {
            (0.0, 0.0)
        } else {
            (covered_us.0 * 1e-3, covered_us.1 * 1e-3)
        },
        zero_padded: edges == Boundary::ZeroPadded,
        decision_delay_ms: decision_delay_ms(&detector),
        earliest_ms: detector.earliest_ms,
        background_s: trials.iter().map(|t| t.background_s).sum(),
        at_risk_s: found.outcomes.iter().map(|o| o.at_risk_s).sum(),
        background_rate_per_s: quantile(&mut rates, 0.5).unwrap_or(0.0),
        detected_rate: found.estimates.detected_rate,
        width_ms: found.estimates.width_ms,
        median_ms: found.estimates.median_ms,
        false_alarms_per_s: found.estimates.false_alarms_per_s,
        false_detections: trials.iter().filter_map(early).collect(),
        from_contact: from_contact(analysis, &clocks, &trials, &found),
        reduced: Some(ReducedLatency {
            factor: reduced_settings.factor,
            thresholds: reduced_settings.thresholds.into(),
            target_rate: reduced_settings.target_rate,
            threshold: reduced.chosen.map(|i| few.thresholds[i]),
            detected_rate: reduced.estimates.detected_rate,
            width_ms: reduced.estimates.width_ms,
            false_alarms_per_s: reduced.estimates.false_alarms_per_s,
        }),
        course: course::course(&trials, detector.bin_ms),
        onsets: trials.iter().map(|t| (t.label.press, onset(t))).collect(),
        backgrounds: backgrounds(&trials, &found),
        chosen: found.chosen.map(|i| i as u32),
        sweep: found.rows,
    })
}

/// A press with everything that the study needs.
struct UsablePress<'a> {
    row: usize,
    label: Label,
    sights: [HostTimeView<'a>; 2],
    spans: Spans,
}

fn usable<'a>(
    analysis: &Analysis,
    clocks: &[ClockFit; 2],
    presses: &[&'a RetainedPress],
) -> Vec<UsablePress<'a>> {
    let neighbours = Neighbours::of(&analysis.presses);
    let one = |retained: &&'a RetainedPress| {
        let press = &analysis.presses[retained.row];
        if !verdict::is_done_as_planned(press) {
            return None;
        }
        let contact_us = press.timing.map_or(0.0, |t| t.contact.0 as f64 * 1e-3);
        let late_us = |k: usize| analysis.alignment.off_line_us(k, &clocks[k], contact_us);
        let sights = [0, 1].map(|k| HostTimeView::new(&retained.views[k], &clocks[k], late_us(k)));
        let background = analysis.settings.latency.background;
        Some(UsablePress {
            row: retained.row,
            label: Label {
                press: retained.press,
                location: press.location.index(),
            },
            spans: Spans::of(&sights, neighbours[retained.row]?, background)?,
            sights,
        })
    };
    presses.iter().filter_map(one).collect()
}

/// All trials, on all events or on one in `factor` of them, chosen anew for each `(factor, seed)`.
fn run(
    usable: &[UsablePress<'_>],
    detector: &Detector,
    thinning: Option<(u32, u64)>,
) -> Vec<Trial> {
    let one = |u: &UsablePress<'_>| {
        let stream = THINNING + u.row as u64;
        let thinning = thinning.map(|(k, seed)| (k, seeded::generator(seed, stream)));
        detector.run_on_events(u.label, &u.sights, &u.spans, thinning)
    };
    let found: Vec<Option<Trial>> = usable.par_iter().map(one).collect();
    found.into_iter().flatten().collect()
}

/// False alarms before each contact; empty without a threshold.
fn backgrounds(trials: &[Trial], found: &DetectorResult) -> Vec<TrialBackground> {
    let of = |(t, o): (&Trial, &Outcome)| TrialBackground {
        press: t.label.press,
        alarms: u32::from(o.false_alarm),
        length_s: o.at_risk_s,
    };
    let chosen = found
        .chosen
        .map(|_| trials.iter().zip(&found.outcomes).map(of).collect());
    chosen.unwrap_or_default()
}

/// Results of a detector at its chosen threshold.
struct DetectorResult {
    rows: Vec<ThresholdRow>,
    chosen: Option<usize>,
    estimates: Estimates,
    outcomes: Vec<Outcome>,
}

impl DetectorResult {
    fn new(analysis: &Analysis, detector: &Detector, target_rate: f64, trials: &[Trial]) -> Self {
        let settings = &analysis.settings;
        let rows = sweep::sweep(trials, detector, settings.latency.window_ms);
        let chosen = sweep::choose(&rows, target_rate);
        let outcome = |t: &Trial| {
            let search = chosen.map(|i| t.searches[i]);
            Outcome {
                location: t.label.location,
                onset_ms: search.and_then(|s| s.onset_ms()),
                false_alarm: search.is_some_and(|s| s.false_alarm_ms().is_some()),
                // Without a threshold there is no false-alarm rate, not even 0.
                at_risk_s: search.map_or(0.0, |s| s.at_risk_s),
            }
        };
        let outcomes: Vec<Outcome> = trials.iter().map(outcome).collect();
        let plan = Plan {
            window_ms: settings.latency.window_ms,
            resamples: settings.bootstrap_resamples,
            seed: settings.seed,
        };
        Self {
            estimates: plan.estimate(&outcomes),
            rows,
            chosen,
            outcomes,
        }
    }
}

/// Half the kernel, ms: how early a smoothed count can rise before its event.
fn reach_ms(detector: &Detector) -> f64 {
    detector.kernel.reach() as f64 * detector.bin_ms
}

/// Time from the reported onset, the middle of the first bin of a run, to the end of the last bin used for the decision.
fn decision_delay_ms(detector: &Detector) -> f64 {
    let rest = f64::from(detector.consecutive.max(1)) - 0.5;
    rest * detector.bin_ms + reach_ms(detector)
}

/// Standard uncertainty of a camera's time for a host time, ms, without systematic errors that the clocks cannot reveal.
fn from_clocks_ms(analysis: &Analysis, clocks: &[ClockFit; 2]) -> f64 {
    let certificate = &analysis.alignment;
    // A 95 % interval for random error, plus a uniform distribution within the bounds.
    let of = |name: MapName| -> Option<f64> {
        let (noise_us, bound_us) = (certificate.interval_us(name)?, certificate.bound_us(name)?);
        Some(libm::hypot(noise_us / 1.96, uniform(2.0 * bound_us)))
    };
    let maps = [
        MapName::Camera1FromBox,
        MapName::Camera2FromBox,
        MapName::HostFromBox,
    ];
    if let [Some(one), Some(two), Some(host_us)] = maps.map(of) {
        return 1e-3 * libm::hypot(one.max(two), host_us);
    }
    let residual_us = clocks[0].residual_rms_us.max(clocks[1].residual_rms_us);
    let half_width_us = analysis.contact_timing.mark_half_width_us;
    1e-3 * libm::hypot(residual_us, uniform(2.0 * half_width_us))
}

/// Standard deviation of a uniform distribution of this width.
fn uniform(width: f64) -> f64 {
    width / 12f64.sqrt()
}

/// Standard uncertainty of a latency, ms, by source.
struct Uncertainty {
    bins_ms: f64,
    clocks_ms: f64,
    contact_ms: f64,
}

impl Uncertainty {
    /// `None` if the contacts were not measured on an independent clock: they come from a schedule, or a camera clock from
    /// the events themselves.
    fn of(analysis: &Analysis, clocks: &[ClockFit; 2]) -> Option<Self> {
        let timing = &analysis.contact_timing;
        if timing.scheduled || clocks.iter().any(|c| c.method == ClockMethod::EventRates) {
            return None;
        }
        let stamped = analysis.alignment.bound_us(MapName::RobotFromHost);
        let pose_us = libm::hypot(
            uniform(timing.pose_interval_us),
            uniform(stamped.unwrap_or(0.0)),
        );
        Some(Self {
            bins_ms: uniform(analysis.settings.latency.bin_ms),
            clocks_ms: from_clocks_ms(analysis, clocks),
            contact_ms: 1e-3 * libm::hypot(pose_us, timing.crossing_se_us),
        })
    }

    fn total_ms(&self) -> f64 {
        libm::hypot(libm::hypot(self.bins_ms, self.clocks_ms), self.contact_ms)
    }
}

/// How much earlier than its contact a press may seem to begin, ms: the 95 % uncertainty of a measured contact, or, if not
/// measured, the allowed distance of an onset from the median.
fn margin_ms(analysis: &Analysis, clocks: &[ClockFit; 2]) -> f64 {
    Uncertainty::of(analysis, clocks)
        .map_or(analysis.settings.latency.window_ms, |u| 1.96 * u.total_ms())
}

/// Latencies from the measured contact. The trigger box ties host time, on which the contact was measured, to each camera's
/// clock.
fn from_contact(
    analysis: &Analysis,
    clocks: &[ClockFit; 2],
    trials: &[Trial],
    found: &DetectorResult,
) -> Option<ContactLatency> {
    let uncertainty = Uncertainty::of(analysis, clocks)?;
    let searches = || {
        trials
            .iter()
            .filter_map(|t| Some(t.searches[found.chosen?]))
    };
    let [p5_ms, median_ms, p95_ms] = found.estimates.from_contact_ms;
    Some(ContactLatency {
        p5_ms,
        median_ms,
        p95_ms,
        before_contact: searches().filter(|s| s.false_alarm_ms().is_some()).count() as u32,
        missed: trials.len() as u32 - searches().filter(|s| s.detection.is_some()).count() as u32,
        uncertainty_ms: uncertainty.total_ms(),
        from_bins_ms: uncertainty.bins_ms,
        from_clocks_ms: uncertainty.clocks_ms,
        from_contact_ms: uncertainty.contact_ms,
    })
}
