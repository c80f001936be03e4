//! Owns the tables of the detection-latency study.

use skinrig_analysis::result::{Analysis, Estimate, FeltTouches, Latency, Spread};
use skinrig_model::Reaction;

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
    unthinned(&mut grid, a);
    grid.download("latency_sweep");
    Some(grid)
}

/// Touches felt while the session was recorded.
pub(super) fn felt(a: &Analysis) -> Option<Table> {
    let f = a.felt.as_ref()?;
    let mut grid = Table::new(
        "felt-table",
        "Felt while recording",
        &["Quantity", "#Median", "#99th percentile", "#n"],
    );
    let mut row = |name: &str, s: &Spread, digits: usize| {
        let value = |v: Option<f64>| number(v, digits);
        grid.row([
            name.to_owned(),
            value(s.median),
            value(s.p99),
            s.n.to_string(),
        ]);
    };
    row("contact to felt (ms)", &f.delay_ms, 1);
    row("last event to estimate (ms)", &f.lag_ms, 1);
    row("error before the release (mm)", &f.error_mm, 2);
    row("longer semi-axis of its region (mm)", &f.region_mm, 2);
    if f.with_depths > 0 {
        row(
            "error of the depth before the release (mm)",
            &f.depth_error_mm,
            2,
        );
        row("its interval, to each side (mm)", &f.depth_within_mm, 2);
    }
    if let Some(r) = &f.reactions {
        row("contact to new set point (ms)", &r.reaction_ms, 1);
        row("last event to new set point (ms)", &r.since_event_ms, 1);
        row("measured depth (mm)", &r.depth_mm, 2);
    }
    for text in felt_notes(f) {
        grid.note(text);
    }
    Some(grid)
}

fn felt_notes(f: &FeltTouches) -> Vec<String> {
    let mut notes = vec![format!(
        "{} of {} scored presses felt, {} missed, {} during a false alarm; {} false alarms in {} s without contact.",
        f.felt,
        f.presses,
        f.missed,
        f.alarmed,
        f.false_alarms,
        number(Some(f.at_risk_s), 0)
    )];
    if f.outside > 0 {
        notes.push(format!(
            "{} scored presses came before touches were felt, {} s into the session, or after it was resumed.",
            f.outside,
            number(Some(f.from_s), 0)
        ));
    }
    if f.with_regions > 0 {
        notes.push(format!(
            "The regions hold at every instant in {} of {} touches; at least 95 % are stated.",
            f.held, f.with_regions
        ));
    } else if f.error_mm.n > 0 {
        notes.push("No regions: the calibration presses are too few.".to_owned());
    }
    if f.with_depths > 0 {
        notes.push(format!(
            "The intervals of the depth hold at every instant in {} of {} touches; 95 % are stated.",
            f.depths_held, f.with_depths
        ));
    }
    if let Some(r) = &f.reactions {
        let what = match r.reaction {
            Reaction::Stop => "stopped where they were",
            Reaction::Lift => "lifted",
        };
        let mut text = format!("{} presses {what} when they were felt", r.reaction_ms.n);
        if r.regions.0 > 0 {
            text += &format!(
                "; the region held the measured position in {} of {}",
                r.regions.1, r.regions.0
            );
        }
        if !r.early.is_empty() {
            text += &format!("; {} reacted before contact", r.early.len());
        }
        notes.push(text + ".");
    }
    if f.skipped > 0 {
        notes.push(format!(
            "The estimator could not keep up {} times; nothing recorded was lost.",
            f.skipped
        ));
    }
    notes
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

/// A note if the located positions are those of fewer events than the detector has.
fn unthinned(grid: &mut Table, a: &Analysis) {
    let thinning = a.settings.thinning;
    if thinning > 1 {
        grid.note(format!(
            "Of all events: the detector does not thin. Positions and event rates of presses are those of 1/{thinning} of the events."
        ));
    }
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
    unthinned(&mut grid, a);
    grid.download("latency_onsets");
    Some(grid)
}
