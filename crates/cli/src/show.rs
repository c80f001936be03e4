//! `skinrig show`: one session described.

use skinrig_model::{CameraId, PreflightCheck, RunEnd};
use skinrig_recorder::{RecorderError, SessionReader};

use crate::args::ShowArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::progress::clock_text;
use crate::rig::gates;

/// Describes a session.
///
/// # Errors
/// [`Failure::input`] when the file is no readable session.
pub fn show(args: &ShowArgs, json: bool) -> Outcome {
    let document = describe(args).map_err(Failure::input)?;
    if json {
        crate::print_json(&document);
    } else {
        print(&document);
    }
    Ok(Exit::Ok)
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
    let mut document = serde_json::json!({
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
    if args.protocol {
        document["protocol_text"] = header.protocol_text.into();
    }
    if args.presses {
        document["presses"] = press_rows(&reader)?.into();
    }
    Ok(document)
}

fn press_rows(reader: &SessionReader) -> Result<Vec<serde_json::Value>, RecorderError> {
    let rows = reader.presses()?.into_iter().map(|(planned, attempts)| {
        let outcome = attempts.iter().rev().find_map(|a| a.outcome.as_ref());
        serde_json::json!({
            "press": planned.id.0, "role": planned.role, "repetition": planned.repetition + 1,
            "location": planned.location + 1, "x_mm": planned.at.x_mm, "y_mm": planned.at.y_mm,
            "depth_mm": planned.depth_mm, "attempts": attempts.len(),
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
    outln!(
        "end        {}  after {duration}",
        d["end"].as_str().unwrap_or("not ended")
    );
    if let Some(reason) = d["end_reason"].as_str() {
        outln!("           {reason}");
    }
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
        }
    }
    if let Some(protocol) = d["protocol_text"].as_str() {
        outln!("\n{protocol}");
    }
}
