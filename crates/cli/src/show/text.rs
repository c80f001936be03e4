//! Prints the description of a session for `skinrig show`.

use skinrig_model::HostDuration;
use skinrig_recorder::PressTally;

use super::description::{Analysis, AnalysisContent, Camera, Description, Device, Leg, Press};
use crate::progress::clock_text;
use crate::rig::gates;

/// Most losses listed per camera.
const MAX_LOSSES: usize = 5;

pub(super) fn print(d: &Description) {
    let seal = if d.sealed { "" } else { "  NOT SEALED" };
    outln!("session    {}{seal}", d.id);
    outln!("started    {}  by {}", d.started_at, d.operator);
    outln!("prototype  {}", d.prototype);
    outln!("protocol   {}  sha256 {}", d.protocol, d.protocol_sha256);
    for change in &d.overrides {
        outln!("           --set {change}");
    }
    outln!("rig        {}  seed {}", d.rig, d.seed);
    outln!("software   {} on {}", d.software, d.host);
    end(d);
    legs(&d.legs, d.written_by.is_some());
    presses(&d.totals.presses, d.totals.sync.planned);
    d.analyses.iter().for_each(analysis);
    if !d.preflight.is_empty() {
        crate::terminal::out(format_args!("{}", gates::table(&d.preflight)));
    }
    outln!("devices");
    d.devices.iter().for_each(device);
    outln!("streams");
    d.cameras.iter().for_each(camera);
    for (t_s, kind, reason) in &d.interruptions {
        outln!("{t_s:>9.3} s  {kind}: {reason}");
    }
    for (t_s, text) in &d.notes {
        outln!("{t_s:>9.3} s  note: {text}");
    }
    for notification in &d.notifications {
        outln!("notified  {notification}");
    }
    if let Some(rows) = &d.presses {
        outln!("\n press  role       rep  loc      x      y  depth  verdict");
        rows.iter().for_each(press);
    }
    if let Some(protocol) = &d.protocol_text {
        outln!("\n{protocol}");
    }
}

fn end(d: &Description) {
    let duration = d.duration_s.map(HostDuration::from_secs_f64);
    let duration = duration.map_or("-".to_owned(), clock_text);
    let end = match (d.end, &d.written_by) {
        (Some(end), _) => end.to_owned(),
        (None, Some(writer)) => format!("under way, {writer} writes it"),
        (None, None) => "cut off; `skinrig resume` continues it".to_owned(),
    };
    outln!("end        {end}  after {duration}");
    if let Some(reason) = &d.end_reason {
        outln!("           {reason}");
    }
}

/// Prints the legs, unless there is only one that adds nothing.
fn legs(legs: &[Leg], being_written: bool) {
    if let [only] = legs
        && only.cut_off.is_empty()
    {
        return;
    }
    for (i, leg) in legs.iter().enumerate() {
        let under_way = being_written && i + 1 == legs.len();
        let end = match (leg.end, under_way) {
            (Some(end), _) => end,
            (None, true) => "under way",
            (None, false) => "cut off",
        };
        outln!(
            "leg {:<6} {}  by {}  from {:.0} s  {} attempts  {end}{}",
            leg.leg,
            leg.started_at,
            leg.operator,
            leg.from_s,
            leg.attempts,
            because(leg.end_reason.as_deref()),
        );
        if !leg.cut_off.is_empty() {
            let what = if under_way { "open" } else { "cut off" };
            outln!("           {what}: {}", leg.cut_off.join(", "));
        }
    }
}

fn presses(p: &PressTally, sync: u64) {
    let open = p
        .planned
        .saturating_sub(p.valid + p.missed + p.invalid + p.excluded);
    let open = match open {
        0 => String::new(),
        open => format!(" + {open} without a verdict"),
    };
    outln!(
        "recorded   {} planned = {} valid + {} missed + {} invalid + {} excluded{open}; {sync} sync",
        p.planned,
        p.valid,
        p.missed,
        p.invalid,
        p.excluded,
    );
}

fn analysis(analysis: &Analysis) {
    let name = analysis
        .name
        .as_deref()
        .unwrap_or(skinrig_catalogue::OFFICIAL);
    let (rmse, faults, changes, version) = match &analysis.found {
        AnalysisContent::Trouble { trouble } => {
            outln!("analysis   {name}  {trouble}");
            return;
        }
        AnalysisContent::Summary {
            valid: false,
            faults,
            changes,
            analysis_version,
            ..
        } => {
            let why = if faults.is_empty() {
                " (its report says why)"
            } else {
                ""
            };
            (format!("INVALID{why}"), faults, changes, analysis_version)
        }
        AnalysisContent::Summary {
            rmse_mm,
            faults,
            changes,
            analysis_version,
            ..
        } => {
            let bound = |bound: Option<f64>| bound.unwrap_or(f64::NAN);
            let text = rmse_mm.value.map_or_else(
                || "no scored press located".to_owned(),
                |value| {
                    format!(
                        "RMSE {value:.2} mm ({:.2} to {:.2}), n {}",
                        bound(rmse_mm.low),
                        bound(rmse_mm.high),
                        rmse_mm.n
                    )
                },
            );
            (text, faults, changes, analysis_version)
        }
    };
    outln!("analysis   {name}  {rmse}  analysis version {version}");
    if !faults.is_empty() {
        let faults = faults.join(", ");
        outln!("           found: {faults}; the report has the next steps");
    }
    if let Some(changes) = changes {
        outln!("           {changes}");
    }
}

fn device(device: &Device) {
    outln!(
        "  {:<12} {}  serial {}  firmware {}",
        device.role,
        device.model,
        device.serial,
        device.firmware
    );
    for (name, requested, read_back) in &device.settings {
        outln!("    {name:<24} asked {requested}  read back {read_back}");
    }
}

fn camera(c: &Camera) {
    outln!(
        "  camera {}  {}  {} events, {} trigger edges, {:.1} MB in {} chunks ({:.1} MB stored), {} bytes lost",
        c.camera,
        c.format,
        c.events,
        c.trigger_edges,
        c.bytes as f64 / 1e6,
        c.chunks,
        c.stored_bytes as f64 / 1e6,
        c.lost_bytes,
    );
    for loss in c.losses.iter().take(MAX_LOSSES) {
        outln!("    lost: {} bytes, {}", loss.bytes, loss.time);
    }
    if c.losses.len() > MAX_LOSSES {
        outln!(
            "    lost: {} times more (--json)",
            c.losses.len() - MAX_LOSSES
        );
    }
}

fn press(p: &Press) {
    outln!(
        "{:>6}  {:<9} {:>4} {:>4} {:>6.1} {:>6.1} {:>6.2}  {}{}",
        p.press.number(),
        p.role.name(),
        p.repetition.number(),
        p.location.number(),
        p.x_mm,
        p.y_mm,
        p.depth_mm,
        p.verdict,
        because(p.reason.as_deref()),
    );
    for (number, verdict, reason) in &p.earlier {
        let why = because(reason.as_deref());
        outln!("{:>51}attempt {number} {verdict}{why}", "");
    }
}

/// `: reason`, or nothing.
fn because(reason: Option<&str>) -> String {
    reason
        .map(|reason| format!(": {reason}"))
        .unwrap_or_default()
}
