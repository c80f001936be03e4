//! Measures the detector on recorded sessions, against a detector that knows place and template.
//!
//! `cargo run --release -p skinrig-online --example measure -- RATES FACTOR SESSION...`: for these rates of false alarms per second
//! (`0.13`, or `1,0.13,0.01` for a receiver operating characteristic), and one in so many events. The first rate is compared with
//! the bound, unless `SKINRIG_NO_BOUND` is set.
#![expect(clippy::print_stdout, reason = "its output is its purpose")]

mod clairvoyant;
mod recording;

use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;

use skinrig_analysis::result::PressResult;
use skinrig_analysis::{Analysis, analyze};
use skinrig_model::{CameraId, CdEvent, HostTime, PressRole};
use skinrig_online::{
    Detection, DetectionScore, Detector, IdleStatistic, SLOT_US, ScoredPress, TouchModel, Training,
    interleave, learn,
};
use skinrig_results::{AlignedSession, AnalysisOptions, Session};

use clairvoyant::{Template, idle_rates, slot_of, threshold};
use recording::{Recording, keeps};

/// Slots of idle time from which the clairvoyant gets its thresholds: 150 s.
const IDLE_SLOTS: i64 = 300_000;
/// Slots searched before and after a contact.
const BEFORE: i64 = 400;

#[derive(Default)]
struct Delays {
    online: Vec<f64>,
    clairvoyant: Vec<f64>,
    excess: Vec<f64>,
}

impl Delays {
    fn print(&mut self) {
        row("after contact, ms", &mut self.online);
        row("clairvoyant, ms", &mut self.clairvoyant);
        row("excess, ms", &mut self.excess);
    }
}

fn quantile(sorted: &[f64], p: f64) -> f64 {
    let at = ((sorted.len().saturating_sub(1)) as f64 * p).round() as usize;
    sorted.get(at).copied().unwrap_or(f64::NAN)
}

fn row(what: &str, values: &mut [f64]) {
    values.sort_by(f64::total_cmp);
    let [p1, p10, p50, p90, p99] = [0.01, 0.1, 0.5, 0.9, 0.99].map(|p| quantile(values, p));
    println!(
        "  {what:18} n {:5}  p1 {p1:7.2}  p10 {p10:7.2}  median {p50:7.2}  p90 {p90:7.2}  p99 {p99:7.2}",
        values.len()
    );
}

/// Idle parts of all gaps between presses, slots.
fn idle_spans(analysis: &Analysis) -> Vec<(i64, i64)> {
    let us = |t: HostTime| t.0 as f64 * 1e-3;
    let timed: Vec<_> = analysis.presses.iter().filter_map(|p| p.timing).collect();
    let spans = timed.windows(2).map(|w| {
        let (from, to) = (us(w[0].release), us(w[1].contact) - 20e3);
        (slot_of(from + 0.6 * (to - from)), slot_of(to))
    });
    spans.filter(|(from, to)| to > from).collect()
}

/// Contacts of the other repetitions at the place of a press, slots; not of the first, whose pixels nothing had touched.
fn contacts_there(analysis: &Analysis, press: &PressResult) -> Vec<i64> {
    let there = analysis.presses.iter().filter(|p| {
        let same = p.location == press.location && p.press != press.press;
        same && p.role != PressRole::Sync && p.repetition.index() > 0
    });
    there
        .filter_map(|p| Some(slot_of(p.timing?.contact.0 as f64 * 1e-3)))
        .collect()
}

/// All decisions on a session.
fn detect(
    aligned: &AlignedSession,
    training: &Training,
    model: &TouchModel,
    limit: f64,
    factor: u64,
) -> Result<Vec<Detection>, Box<dyn Error>> {
    let clocks = *training.clocks();
    let mut detector = Detector::new(model, &clocks, limit, 0)?;
    let (mut found, mut kept): (Vec<Detection>, Vec<CdEvent>) = (Vec::new(), Vec::new());
    let read = interleave(&aligned.events, &clocks, |camera, events, next_us| {
        for camera in CameraId::ALL {
            detector.promise(camera, next_us[camera.index()], |d| found.push(d));
        }
        kept.clear();
        kept.extend(events.iter().filter(|e| keeps(factor, camera, e)));
        detector.push(camera, &kept, |d| found.push(d)) == kept.len()
    });
    read.map_err(|e| e.to_string())?;
    detector.finish(|d| found.push(d));
    Ok(found)
}

/// What a threshold gives.
fn print_score(limit: f64, presses: usize, score: &DetectionScore) {
    let Some((per_s, (low, high))) = score.false_alarms_per_s() else {
        return;
    };
    let mut delays: Vec<f64> = score.delays_ms.iter().map(|d| d.1).collect();
    delays.sort_by(f64::total_cmp);
    println!(
        "  {limit:5.2} nats: {} false alarms in {:.0} s, {per_s:.4}/s [{low:.4}, {high:.4}]; {} of {presses} presses felt, {} missed, \
         {} alarmed; median {:.1} ms, p99 {:.1} ms",
        score.false_alarms,
        score.at_risk_s,
        delays.len(),
        score.missed,
        score.alarmed,
        quantile(&delays, 0.5),
        quantile(&delays, 0.99)
    );
}

fn measure(path: &Path, rates: &[f64], factor: u64, bound: bool) -> Result<Delays, Box<dyn Error>> {
    let aligned = Session::open(path, AnalysisOptions::default())?
        .read_input()?
        .align();
    let analysis = analyze(&aligned.input, &aligned.events)?;
    let training = Training::of(&analysis)?;
    let model = learn(&training, &aligned.events).map_err(|e| e.to_string())?;
    let model = model.thinned(1.0 / factor as f64);
    let keep = |c: CameraId, e: &CdEvent| keeps(factor, c, e);
    let idle = IdleStatistic::measure(&model, &training, &aligned.events, keep)?;
    println!(
        "{}: {} places, idle {:.0} events/s, learnt from {:.0} s idle",
        path.display(),
        model.places(),
        model.idle_per_s(),
        idle.seconds()
    );
    let presses = ScoredPress::of(&analysis);
    let mut scores = Vec::new();
    for rate in rates {
        let limit = idle.threshold(*rate);
        let found = detect(&aligned, &training, &model, limit, factor)?;
        let score = DetectionScore::new(&found, &presses);
        print_score(limit, presses.len(), &score);
        scores.push((*rate, score));
    }
    let Some((rate, mut score)) = scores.into_iter().next() else {
        return Ok(Delays::default());
    };
    let mut delays = Delays {
        online: score.delays_ms.iter().map(|d| d.1).collect(),
        ..Delays::default()
    };
    if bound {
        compare(
            &aligned,
            &analysis,
            &training,
            (rate, factor),
            &score,
            &mut delays,
        );
    }
    delays.print();
    row("release, ms", &mut score.releases_ms);
    Ok(delays)
}

/// The clairvoyant on the same presses.
fn compare(
    aligned: &AlignedSession,
    analysis: &Analysis,
    training: &Training,
    (rate, factor): (f64, u64),
    score: &DetectionScore,
    delays: &mut Delays,
) {
    let recording = Recording::read(&aligned.events, training.clocks(), factor);
    let spans = idle_spans(analysis);
    let rates = idle_rates(&recording, &spans);
    let mut left = IDLE_SLOTS;
    let few: Vec<_> = spans
        .into_iter()
        .take_while(|(from, to)| {
            left -= to - from;
            left > 0
        })
        .collect();
    let mut thresholds: BTreeMap<u32, f64> = BTreeMap::new();
    for (row, delay) in &score.delays_ms {
        let press = &analysis.presses[*row];
        let Some(timing) = press.timing else { continue };
        let contact_us = timing.contact.0 as f64 * 1e-3;
        let template = Template::new(&recording, &rates, &contacts_there(analysis, press));
        let limit = thresholds
            .entry(press.location.index())
            .or_insert_with(|| threshold(&template.maxima(&recording, &rates, &few), rate));
        let from = slot_of(contact_us) - BEFORE;
        let values = template.statistic(&recording, &rates, (from, from + 2 * BEFORE));
        let after = values
            .iter()
            .skip(BEFORE as usize - 2)
            .position(|v| v >= limit);
        if let Some(at) = after {
            let slot = from + BEFORE - 2 + at as i64;
            let known = (((slot + 1) * SLOT_US) as f64 - contact_us) * 1e-3;
            delays.clairvoyant.push(known);
            delays.excess.push(delay - known);
        }
    }
    let mut limits: Vec<f64> = thresholds.into_values().collect();
    row("clairvoyant, nats", &mut limits);
}

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [rates, factor, sessions @ ..] = &args[..] else {
        return Err("expected RATES FACTOR SESSION...".into());
    };
    let bound = std::env::var_os("SKINRIG_NO_BOUND").is_none();
    let mut all = Delays::default();
    for session in sessions {
        let rates: Result<Vec<f64>, _> = rates.split(',').map(str::parse).collect();
        let delays = measure(Path::new(session), &rates?, factor.parse()?, bound)?;
        all.online.extend(delays.online);
        all.clairvoyant.extend(delays.clairvoyant);
        all.excess.extend(delays.excess);
    }
    println!("all sessions");
    all.print();
    Ok(())
}
