//! Owns the tables of the detection-latency study.

use skinrig_analysis::result::{Analysis, Estimate, Latency};

use super::cells::estimate;
use crate::document::Table;
use crate::format::{NONE, number};

/// Detection rates and times beside the published numbers.
pub(super) fn latency(a: &Analysis) -> Option<Table> {
    let l = a.latency.as_ref()?;
    let mut grid = Table::new(
        "latency-table",
        "Detection",
        &["Quantity", "#Session", "#95 % interval", "#n", "#Published"],
    );
    let row = |name: &str, e: &Estimate, scale: f64, digits: usize, theirs: &str| {
        let own = estimate(name, e, scale, digits);
        own.into_iter().chain([theirs.to_owned()])
    };
    let chosen = l.chosen.and_then(|i| l.sweep.get(i as usize));
    grid.row([
        "threshold h".to_owned(),
        number(chosen.map(|r| r.threshold), 2),
        NONE.to_owned(),
        NONE.to_owned(),
        "1 (code: 17 to 19)".to_owned(),
    ]);
    grid.row(row("detected (%)", &l.detected_rate, 100.0, 1, "≥ 95"));
    grid.row(row(
        "width of the 5-95 % interval of onsets (ms)",
        &l.width_ms,
        1.0,
        1,
        "31",
    ));
    grid.row(row(
        "median onset after contact (ms)",
        &l.median_ms,
        1.0,
        1,
        NONE,
    ));
    grid.row(row(
        "false alarms per second",
        &l.false_alarms_per_s,
        1.0,
        3,
        "0.13",
    ));
    if let Some(r) = &l.reduced {
        let k = r.factor;
        grid.row([
            format!("1/{k} of the events: threshold h"),
            number(r.threshold, 2),
            NONE.to_owned(),
            NONE.to_owned(),
            "3".to_owned(),
        ]);
        grid.row(row(
            &format!("1/{k} of the events: detected (%)"),
            &r.detected_rate,
            100.0,
            1,
            "88",
        ));
        grid.row(row(
            &format!("1/{k} of the events: width of 5-95 % (ms)"),
            &r.width_ms,
            1.0,
            1,
            "113",
        ));
        grid.row(row(
            &format!("1/{k} of the events: false alarms per second"),
            &r.false_alarms_per_s,
            1.0,
            2,
            "1.86",
        ));
    }
    notes(&mut grid, l);
    grid.download("latency_sweep");
    Some(grid)
}

fn notes(grid: &mut Table, l: &Latency) {
    let s = &l.settings;
    grid.note(format!(
        "One-sided CUSUM on counts of both cameras: bins of {} ms, Gaussian of {} ms, tuned to a rate {} times the \
         background, {} bins in a row; background from {} the press ({} s in total, median {} events per second). {} \
         trials, {} presses unusable, {} trials shortened.",
        number(Some(s.bin_ms), 2),
        number(Some(s.sigma_ms), 2),
        number(Some(s.alpha), 1),
        s.consecutive,
        crate::format::words(&s.background),
        number(Some(l.background_s), 1),
        number(Some(l.background_rate_per_s), 0),
        l.trials,
        l.unusable,
        l.shortened,
    ));
    if l.at_risk_s > 0.0 {
        grid.note(format!(
            "False alarms: {} alarms more than {} ms before contact, in {} s from the start of each trial to its \
             contact or to the alarm, which ends the search. The interval is the exact Poisson interval.",
            l.false_detections.len(),
            number(Some(-l.earliest_ms), 1),
            number(Some(l.at_risk_s), 1),
        ));
    }
    if let Some(list) = crate::detector::false_detections(l) {
        grid.note(format!(
            "Fired before contact, and therefore not detected: {list}."
        ));
    }
    for remark in crate::detector::remarks(l) {
        grid.note(crate::format::sentence(&remark));
    }
    grid.note(format!(
        "A live detector would report an onset {} ms after its time.",
        number(Some(l.decision_delay_ms), 1)
    ));
}

/// Latency from the hardware-timestamped contact with its uncertainty budget.
pub(super) fn from_contact(a: &Analysis) -> Option<Table> {
    let c = a.latency.as_ref()?.from_contact.as_ref()?;
    let mut grid = Table::new(
        "latency-from-contact",
        "Latency from the measured contact",
        &["Quantity", "#ms", "#95 % interval", "#n"],
    );
    let row = |name: &str, e: &Estimate| estimate(name, e, 1.0, 2);
    grid.row(row("5th percentile", &c.p5_ms));
    grid.marked_row(row("median", &c.median_ms), true);
    grid.row(row("95th percentile", &c.p95_ms));
    let part = |name: &str, ms: f64| {
        [
            name.to_owned(),
            format!("± {}", number(Some(ms), 3)),
            NONE.to_owned(),
            NONE.to_owned(),
        ]
    };
    grid.row(part(
        "standard uncertainty of one latency",
        c.uncertainty_ms,
    ));
    grid.row(part("from the bin width", c.from_bins_ms));
    grid.row(part("from the camera clocks", c.from_clocks_ms));
    grid.row(part(
        "from the resolution of the contact",
        c.from_contact_ms,
    ));
    grid.note(format!(
        "The percentiles exclude {} presses whose detector fired before contact (false alarms) and {} presses never \
         detected. An error of the assumed surface height shifts all contacts alike and is not in the budget.",
        c.before_contact, c.missed
    ));
    grid.download("latency_onsets");
    Some(grid)
}
