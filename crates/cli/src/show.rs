//! `skinrig show`: one session described.

use skinrig_model::{CameraId, PreflightCheck, RunEnd};
use skinrig_recorder::{AttemptRow, RecorderError, SessionReader};

use crate::args::ShowArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::progress::clock_text;
use crate::rig::gates;

/// Describes a session.
///
/// # Errors
/// [`Failure::input`] when the file is no readable session.
pub fn show(args: &ShowArgs, json: bool) -> Outcome {
    let document = describe(args).map_err(Failure::session)?;
    if json {
        crate::terminal::print_json(&document);
    } else {
        print(&document);
    }
    Ok(Exit::Ok)
}

/// How many losses of a camera are listed.
const MOST_LOSSES: usize = 5;

/// What a camera lost, and when.
fn losses(
    reader: &SessionReader,
    camera: CameraId,
) -> Result<Vec<serde_json::Value>, RecorderError> {
    let losses = reader.losses(camera)?;
    let rows = losses.iter().map(|loss| {
        serde_json::json!({
            "chunk": loss.seq, "bytes": loss.bytes, "from_us": loss.time.from_us, "to_us": loss.time.to_us,
            "time": loss.time.to_string(),
        })
    });
    Ok(rows.collect())
}

fn describe(args: &ShowArgs) -> Result<serde_json::Value, RecorderError> {
    let reader = SessionReader::open(&args.session)?;
    let header = reader.header()?;
    let totals = reader.totals()?;
    let end = reader.end()?;
    let devices: Vec<_> = reader
        .devices()?
        .into_iter()
        .map(|d| {
            let settings: Vec<_> = d
                .settings
                .iter()
                .map(|s| serde_json::json!([s.name, s.requested, s.read_back]))
                .collect();
            serde_json::json!({
                "role": d.role.name(), "model": d.identity.model, "serial": d.identity.serial,
                "firmware": d.identity.firmware, "settings": settings,
            })
        })
        .collect();
    let mut cameras = Vec::new();
    for camera in CameraId::ALL {
        let chunks = reader.chunk_index(camera)?;
        cameras.push(serde_json::json!({
            "camera": camera.number(),
            "format": header.stream_formats[camera.index()].name(),
            "chunks": chunks.len(),
            "bytes": chunks.iter().map(|c| c.raw_bytes).sum::<u64>(),
            "stored_bytes": chunks.iter().map(|c| c.stored_bytes).sum::<u64>(),
            "events": chunks.iter().map(|c| c.facts.cd_events).sum::<u64>(),
            "trigger_edges": chunks.iter().map(|c| c.facts.trigger_edges).sum::<u64>(),
            "lost_bytes": chunks.iter().map(|c| c.lost_before).sum::<u64>(),
            "losses": losses(&reader, camera)?,
        }));
    }
    let interruptions: Vec<_> = reader
        .interruptions()?
        .iter()
        .map(|i| serde_json::json!([i.t.as_secs_f64(), i.kind.name(), i.reason]))
        .collect();
    let notes: Vec<_> = reader
        .notes()?
        .iter()
        .map(|n| serde_json::json!([n.t.as_secs_f64(), n.text]))
        .collect();
    let legs = leg_rows(&reader)?;
    let writer = skinrig_recorder::writer_of(&args.session);
    let mut document = serde_json::json!({
        "legs": legs, "written_by": writer,
        "session": args.session, "id": reader.session_id()?, "sealed": reader.seal()?.is_some(),
        "started_at": header.started_at, "prototype": header.prototype,
        "operator": header.operator, "protocol": header.protocol_name,
        "protocol_sha256": header.protocol_sha256, "overrides": header.overrides,
        "plan_sha256": header.plan_sha256, "seed": header.seed, "rig_kind": header.rig_kind,
        "rig": header.rig_name, "host": header.host, "software": header.software,
        "command_line": header.command_line, "totals": totals, "devices": devices,
        "cameras": cameras, "interruptions": interruptions, "notes": notes,
        "end": end.as_ref().map(|(_, e)| e.name()),
        "end_reason": end.as_ref().and_then(|(_, e)| match e {
            RunEnd::Completed => None,
            RunEnd::Stopped(r) | RunEnd::Faulted(r) => Some(r.clone()),
        }),
        "preflight": reader.preflight()?,
        "duration_s": end.as_ref().map(|(t, _)| t.as_secs_f64()),
    });
    document["analyses"] = analysis_rows(&args.session, &reader.session_id()?);
    if args.protocol {
        document["protocol_text"] = header.protocol_text.into();
    }
    if args.presses {
        document["presses"] = press_rows(&reader)?.into();
    }
    Ok(document)
}

/// The analyses that lie beside the session: the official one first, then the variants with what they change.
fn analysis_rows(session: &std::path::Path, session_id: &str) -> serde_json::Value {
    let row = |listed: crate::analyses::AnalysisFile| {
        let mut row = serde_json::json!({ "name": listed.name, "results": listed.results });
        match listed.summary {
            Ok(s) => {
                row["rmse_mm"] = serde_json::json!(s.rmse_mm);
                row["valid"] = s.valid.into();
                row["faults"] = s.faults.into();
                row["analysis_version"] = s.analysis_version.into();
                row["changes"] = serde_json::json!(s.variant.map(|v| v.to_string()));
            }
            Err(why) => row["trouble"] = why.into(),
        }
        row
    };
    crate::analyses::all(session, session_id)
        .into_iter()
        .map(row)
        .collect()
}

fn print_analyses(rows: &serde_json::Value) {
    for row in rows.as_array().into_iter().flatten() {
        let name = row["name"].as_str().unwrap_or("official");
        let number = |key: &str| row["rmse_mm"][key].as_f64();
        let faults: Vec<&str> = row["faults"]
            .as_array()
            .into_iter()
            .flatten()
            .filter_map(serde_json::Value::as_str)
            .collect();
        let found = match (
            row["trouble"].as_str(),
            row["valid"].as_bool(),
            number("value"),
        ) {
            (Some(why), ..) => why.to_owned(),
            (_, Some(false), _) if faults.is_empty() => "INVALID: clocks not known".to_owned(),
            (_, Some(false), _) => "INVALID".to_owned(),
            (.., Some(rmse)) => format!(
                "RMSE {rmse:.2} mm ({:.2} to {:.2}), n {}",
                number("low").unwrap_or(f64::NAN),
                number("high").unwrap_or(f64::NAN),
                row["rmse_mm"]["n"]
            ),
            (.., None) => "no scored press located".to_owned(),
        };
        let version = row["analysis_version"]
            .as_u64()
            .map(|v| format!("  analysis version {v}"));
        outln!("analysis   {name}  {found}{}", version.unwrap_or_default());
        if !faults.is_empty() {
            outln!(
                "           found: {}; the report says what to do",
                faults.join(", ")
            );
        }
        if let Some(changes) = row["changes"].as_str() {
            outln!("           {changes}");
        }
    }
}

/// Each leg: when it began, by whom, how it ended, and how many attempts it cut off.
fn leg_rows(reader: &SessionReader) -> Result<Vec<serde_json::Value>, RecorderError> {
    let legs = reader.legs()?;
    let attempts: Vec<AttemptRow> = reader.presses()?.into_iter().flat_map(|p| p.1).collect();
    let rows = legs.iter().enumerate().map(|(i, leg)| {
        let next = legs.get(i + 1).map(|next| next.origin);
        let within = |a: &&AttemptRow| {
            a.intent.is_some_and(|t| t >= leg.origin && next.is_none_or(|next| t < next))
        };
        let own = || attempts.iter().filter(within);
        let cut_off = own().filter(|a| a.outcome.as_ref().is_none_or(|o| o.verdict.is_cut_off()));
        let reason = leg.end.as_ref().and_then(|(_, end)| match end {
            RunEnd::Completed => None,
            RunEnd::Stopped(why) | RunEnd::Faulted(why) => Some(why.clone()),
        });
        serde_json::json!({
            "leg": leg.number, "started_at": leg.began.started_at, "operator": leg.began.operator,
            "host": leg.began.host, "software": leg.began.software,
            "command_line": leg.began.command_line, "from_s": leg.origin.as_secs_f64(),
            "end": leg.end.as_ref().map(|(_, end)| end.name()), "end_reason": reason,
            "attempts": own().count(), "cut_off": cut_off.map(|a| a.id.to_string()).collect::<Vec<_>>(),
        })
    });
    Ok(rows.collect())
}

fn print_legs(d: &serde_json::Value) {
    let legs = d["legs"].as_array().map_or(&[][..], Vec::as_slice);
    let last = legs.len().saturating_sub(1);
    for (i, leg) in legs.iter().enumerate() {
        let text = |key: &str| leg[key].as_str().unwrap_or("-").to_owned();
        let cut_off: Vec<&str> = leg["cut_off"]
            .as_array()
            .into_iter()
            .flatten()
            .filter_map(|a| a.as_str())
            .collect();
        if legs.len() == 1 && cut_off.is_empty() {
            return;
        }
        let under_way = i == last && d["written_by"].is_string();
        let end = match (leg["end"].as_str(), under_way) {
            (Some(end), _) => end,
            (None, true) => "under way",
            (None, false) => "cut off",
        };
        let why = leg["end_reason"].as_str().map(|why| format!(": {why}"));
        outln!(
            "leg {:<6} {}  by {}  from {:.0} s  {} attempts  {end}{}",
            leg["leg"],
            text("started_at"),
            text("operator"),
            leg["from_s"].as_f64().unwrap_or(0.0),
            leg["attempts"],
            why.unwrap_or_default(),
        );
        if !cut_off.is_empty() {
            let what = if under_way { "open" } else { "cut off" };
            outln!("           {what}: {}", cut_off.join(", "));
        }
    }
}

fn press_rows(reader: &SessionReader) -> Result<Vec<serde_json::Value>, RecorderError> {
    let rows = reader.presses()?.into_iter().map(|(planned, attempts)| {
        let outcome = attempts.last().and_then(|a| a.outcome.as_ref());
        let earlier = attempts.iter().rev().skip(1).rev().map(|a| {
            let verdict = a.outcome.as_ref().map(|o| &o.verdict);
            serde_json::json!([
                a.id.number,
                verdict.map_or("open", |v| v.name()),
                verdict.and_then(|v| v.reason())
            ])
        });
        let earlier: Vec<_> = earlier.collect();
        serde_json::json!({
            "press": planned.id, "role": planned.role, "repetition": planned.repetition,
            "location": planned.location, "x_mm": planned.at.x_mm, "y_mm": planned.at.y_mm,
            "depth_mm": planned.depth_mm, "attempts": attempts.len(), "earlier": earlier,
            "verdict": outcome.map_or("open", |o| o.verdict.name()),
            "reason": outcome.and_then(|o| o.verdict.reason()),
            "contact_s": outcome.and_then(|o| o.timing).map(|t| t.contact.as_secs_f64()),
            "measured_depth_mm": outcome.and_then(|o| o.measured_depth_mm),
            "touched_mm": outcome.and_then(|o| o.touched_mm),
        })
    });
    Ok(rows.collect())
}

fn print_preflight(checks: &serde_json::Value) {
    let checks: Vec<PreflightCheck> = serde_json::from_value(checks.clone()).unwrap_or_default();
    if !checks.is_empty() {
        crate::terminal::out(format_args!("{}", gates::table(&checks)));
    }
}

fn print(d: &serde_json::Value) {
    let text = |key: &str| d[key].as_str().unwrap_or("-").to_owned();
    let count = |v: &serde_json::Value| v.as_u64().unwrap_or(0);
    outln!(
        "session    {}{}",
        text("id"),
        if d["sealed"] == true {
            ""
        } else {
            "  NOT SEALED"
        }
    );
    outln!("started    {}  by {}", text("started_at"), text("operator"));
    outln!("prototype  {}", text("prototype"));
    outln!(
        "protocol   {}  sha256 {}",
        text("protocol"),
        text("protocol_sha256")
    );
    for o in d["overrides"].as_array().into_iter().flatten() {
        outln!("           --set {}", o.as_str().unwrap_or_default());
    }
    outln!("rig        {}  seed {}", text("rig"), d["seed"]);
    outln!("software   {} on {}", text("software"), text("host"));
    let duration = d["duration_s"].as_f64().map_or_else(
        || "-".into(),
        |s| clock_text(skinrig_model::HostDuration::from_secs_f64(s)),
    );
    let end = match (d["end"].as_str(), d["written_by"].as_str()) {
        (Some(end), _) => end.to_owned(),
        (None, Some(writer)) => format!("under way, {writer} writes it"),
        (None, None) => "cut off; `skinrig resume` continues it".to_owned(),
    };
    outln!("end        {end}  after {duration}");
    if let Some(reason) = d["end_reason"].as_str() {
        outln!("           {reason}");
    }
    print_legs(d);
    let p = &d["totals"]["presses"];
    let open = ["valid", "missed", "invalid", "excluded"]
        .iter()
        .fold(count(&p["planned"]), |rest, key| {
            rest.saturating_sub(count(&p[*key]))
        });
    let open = if open > 0 {
        format!(" + {open} without a verdict")
    } else {
        String::new()
    };
    outln!(
        "presses    {} planned = {} valid + {} missed + {} invalid + {} excluded{open}; {} sync",
        p["planned"],
        p["valid"],
        p["missed"],
        p["invalid"],
        p["excluded"],
        d["totals"]["sync"]["planned"]
    );
    print_analyses(&d["analyses"]);
    print_preflight(&d["preflight"]);
    outln!("devices");
    for device in d["devices"].as_array().into_iter().flatten() {
        let s = |k: &str| device[k].as_str().unwrap_or("-").to_owned();
        outln!(
            "  {:<12} {}  serial {}  firmware {}",
            s("role"),
            s("model"),
            s("serial"),
            s("firmware")
        );
        for row in device["settings"].as_array().into_iter().flatten() {
            let cell = |i: usize| row[i].as_str().unwrap_or("-").to_owned();
            outln!(
                "    {:<24} asked {}  read back {}",
                cell(0),
                cell(1),
                cell(2)
            );
        }
    }
    outln!("streams");
    for c in d["cameras"].as_array().into_iter().flatten() {
        outln!(
            "  camera {}  {}  {} events, {} trigger edges, {:.1} MB in {} chunks ({:.1} MB stored), {} bytes lost",
            c["camera"],
            c["format"].as_str().unwrap_or("-"),
            c["events"],
            c["trigger_edges"],
            count(&c["bytes"]) as f64 / 1e6,
            c["chunks"],
            count(&c["stored_bytes"]) as f64 / 1e6,
            c["lost_bytes"],
        );
        let losses = c["losses"].as_array().map_or(&[][..], Vec::as_slice);
        for loss in losses.iter().take(MOST_LOSSES) {
            outln!(
                "    lost: {} bytes, {}",
                loss["bytes"],
                loss["time"].as_str().unwrap_or("")
            );
        }
        if losses.len() > MOST_LOSSES {
            outln!(
                "    lost: {} times more (--json)",
                losses.len() - MOST_LOSSES
            );
        }
    }
    for row in d["interruptions"].as_array().into_iter().flatten() {
        outln!(
            "{:>9.3} s  {}: {}",
            row[0].as_f64().unwrap_or(0.0),
            row[1].as_str().unwrap_or(""),
            row[2].as_str().unwrap_or("")
        );
    }
    for row in d["notes"].as_array().into_iter().flatten() {
        outln!(
            "{:>9.3} s  note: {}",
            row[0].as_f64().unwrap_or(0.0),
            row[1].as_str().unwrap_or("")
        );
    }
    if let Some(rows) = d["presses"].as_array() {
        outln!("\n press  role       rep  loc      x      y  depth  verdict");
        for r in rows {
            outln!(
                "{:>6}  {:<9} {:>4} {:>4} {:>6.1} {:>6.1} {:>6.2}  {}{}",
                count(&r["press"]),
                r["role"].as_str().unwrap_or("-"),
                count(&r["repetition"]),
                count(&r["location"]),
                r["x_mm"].as_f64().unwrap_or(f64::NAN),
                r["y_mm"].as_f64().unwrap_or(f64::NAN),
                r["depth_mm"].as_f64().unwrap_or(f64::NAN),
                r["verdict"].as_str().unwrap_or("-"),
                r["reason"]
                    .as_str()
                    .map(|t| format!(": {t}"))
                    .unwrap_or_default(),
            );
            for row in r["earlier"].as_array().into_iter().flatten() {
                let why = row[2].as_str().map(|why| format!(": {why}"));
                outln!(
                    "{:>51}attempt {} {}{}",
                    "",
                    row[0],
                    row[1].as_str().unwrap_or("-"),
                    why.unwrap_or_default()
                );
            }
        }
    }
    if let Some(protocol) = d["protocol_text"].as_str() {
        outln!("\n{protocol}");
    }
}
