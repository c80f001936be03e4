//! `skinrig status`: progress or end of a run, from the session file and from the run itself.

use std::path::Path;

use serde_json::{Value, json};
use skinrig_model::{HostDuration, PressVerdict, RunEnd};
use skinrig_recorder::{RecorderError, SessionReader, writer_of};

use crate::args::StatusArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::paths;
use crate::progress::{clock_text, eta_text};
use crate::remote::{RemoteError, Reply, Request, RunSnapshot, ask};
use crate::rig::gates;
use crate::sessions;

/// Number of latest outcomes, interruptions and notes shown.
const SHOWN: usize = 5;

/// Prints the state of a session.
///
/// # Errors
/// [`Failure::input`] if there is no readable session.
pub(crate) fn status(args: &StatusArgs, as_json: bool) -> Outcome {
    let session = sessions::find(&args.session)?;
    // Look for the writer first: if the run ends in between, its end is then in the file.
    let writer = writer_of(&session);
    let (live, silence) = match ask(&session, &Request::Status) {
        Ok(Reply::Live(live)) => (Some(live), None),
        Ok(Reply::Refused(why)) => (None, Some(why)),
        Err(RemoteError::Failed(why)) => (None, Some(why.to_string())),
        Ok(Reply::Handed(_)) | Err(RemoteError::NotListening) => (None, None),
    };
    let stored = match stored(&session) {
        Ok(stored) => stored,
        // The first records of a run are not yet on the disk.
        Err(RecorderError::Empty { .. }) if writer.is_some() => json!({}),
        Err(e) => return Err(Failure::session(e)),
    };
    let mut d = json!({
        "session": session, "writer": writer, "live": live, "silence": silence,
        "disk_free_bytes": gates::free_bytes(paths::folder_of(&session)).ok().map(|b| b as u64),
    });
    if let (Some(d), Value::Object(stored)) = (d.as_object_mut(), stored) {
        d.extend(stored);
    }
    if as_json {
        crate::terminal::print_json(&d);
    } else {
        print(&d, live.as_deref());
    }
    Ok(Exit::Ok)
}

/// State of the session according to its file, as far as it is on the disk.
fn stored(session: &Path) -> Result<Value, RecorderError> {
    let reader = SessionReader::open(session)?;
    let header = reader.header()?;
    let end = reader.end()?.map(|(_, end)| end);
    let totals = reader.totals()?;
    let mut outcomes: Vec<_> = reader
        .presses()?
        .into_iter()
        .flat_map(|(_, attempts)| attempts)
        .filter_map(|a| a.outcome)
        .filter(|o| !matches!(o.verdict, PressVerdict::Missed(_)))
        .collect();
    // A press that a further leg repeated precedes later ones in the plan.
    outcomes.sort_by_key(|o| o.timing.map(|t| t.release));
    let last = |n: usize| n.saturating_sub(SHOWN);
    let outcomes: Vec<_> = outcomes[last(outcomes.len())..]
        .iter()
        .map(|o| {
            json!({
                "press": o.attempt.press, "attempt": o.attempt.number,
                "verdict": o.verdict.name(), "reason": o.verdict.reason(),
                "cause": o.verdict.cause(),
            })
        })
        .collect();
    let interruptions = reader.interruptions()?;
    let count = interruptions.len();
    let interruptions: Vec<_> = interruptions[last(count)..]
        .iter()
        .map(|i| json!([i.t.as_secs_f64(), i.kind.name(), i.reason.to_string()]))
        .collect();
    let notes = reader.notes()?;
    let notes: Vec<_> = notes[last(notes.len())..]
        .iter()
        .map(|n| json!([n.t.as_secs_f64(), n.text]))
        .collect();
    let reason = end.as_ref().and_then(RunEnd::reason);
    Ok(json!({
        "id": reader.session_id()?, "sealed": reader.seal()?.is_some(),
        "started_at": header.started_at, "prototype": header.prototype, "operator": header.operator,
        "protocol": header.protocol_name, "rig": header.rig_name, "rig_kind": header.rig_kind,
        "legs": reader.legs()?.len(), "end": end.as_ref().map(RunEnd::name), "end_reason": reason,
        "end_cause": end.as_ref().and_then(RunEnd::cause),
        "totals": totals, "last_outcomes": outcomes, "interruption_count": count,
        "last_interruptions": interruptions, "last_notes": notes,
    }))
}

/// The current state of the session, in words.
fn state(d: &Value, live: Option<&RunSnapshot>) -> String {
    let session = d["session"].as_str().unwrap_or_default();
    let next = match d["rig_kind"].as_str() {
        Some("imported" | "replayed") => "run it again".to_owned(),
        _ => format!("`skinrig resume {session}` continues it"),
    };
    match (live, d["writer"].as_str(), d["end"].as_str()) {
        (Some(live), by, _) => format!("{} ({})", live.state, by.unwrap_or("process unknown")),
        (None, Some(by), _) => {
            let why = d["silence"].as_str();
            let why = why.map_or_else(String::new, |why| format!(": {why}"));
            format!("written by {by}, which does not respond{why}")
        }
        (None, None, Some("completed")) if d["sealed"] == true => "completed".to_owned(),
        (None, None, Some(end)) => {
            let reason = d["end_reason"].as_str();
            let reason = reason.map_or_else(String::new, |r| format!(": {r}"));
            let sealed = if d["sealed"] == true {
                ""
            } else {
                ", not sealed"
            };
            format!("{end}{sealed}{reason}; {next}")
        }
        (None, None, None) => format!("cut off: no program is running it; {next}"),
    }
}

fn print(d: &Value, live: Option<&RunSnapshot>) {
    let text = |key: &str| d[key].as_str().unwrap_or("-").to_owned();
    outln!("session   {}", text("session"));
    outln!("state     {}", state(d, live));
    outln!(
        "run       {} on {}, rig {}; begun {} by {}; leg {}",
        text("protocol"),
        text("prototype"),
        text("rig"),
        text("started_at"),
        text("operator"),
        d["legs"].as_u64().unwrap_or(1)
    );
    match live {
        Some(live) => print_live(live),
        None => print_stored(&d["totals"]),
    }
    let lost = d["totals"]["lost_bytes"].as_u64().unwrap_or(0);
    outln!("lost      {lost} bytes of the camera streams in the session file");
    match d["disk_free_bytes"].as_u64() {
        Some(free) => outln!("disk      {} free", gates::size(free as f64)),
        None => outln!("disk      free space unknown"),
    }
    for o in d["last_outcomes"].as_array().into_iter().flatten() {
        let number = o["attempt"].as_u64().unwrap_or(1);
        let attempt_note = if number > 1 {
            format!(", attempt {number}")
        } else {
            String::new()
        };
        let reason = o["reason"].as_str();
        let reason = reason.map_or_else(String::new, |r| format!(": {r}"));
        outln!(
            "          press {}{attempt_note} {}{reason}",
            o["press"],
            o["verdict"].as_str().unwrap_or("-")
        );
    }
    let listed = d["last_interruptions"].as_array().map_or(0, Vec::len) as u64;
    let all = d["interruption_count"].as_u64().unwrap_or(0);
    if all > listed {
        outln!("          {} earlier interruptions", all - listed);
    }
    for row in d["last_interruptions"].as_array().into_iter().flatten() {
        let word = |i: usize| row[i].as_str().unwrap_or("").to_owned();
        let t = row[0].as_f64().unwrap_or(0.0);
        outln!("          {t:.3} s  {}: {}", word(1), word(2));
    }
    for row in d["last_notes"].as_array().into_iter().flatten() {
        let t = row[0].as_f64().unwrap_or(0.0);
        outln!(
            "          {t:.3} s  note: {}",
            row[1].as_str().unwrap_or("")
        );
    }
}

fn print_live(live: &RunSnapshot) {
    let press = live.press.as_ref().map_or_else(String::new, |p| {
        let block = match p.role {
            skinrig_model::PressRole::Sync => "sync".to_owned(),
            _ => format!("repetition {}", p.repetition),
        };
        let [x, y] = p.at_mm;
        format!(" ({block}, at ({x:.1}, {y:.1}) mm)")
    });
    outln!(
        "press     {} of {}{press}; {} done: {} valid, {} invalid, {} missed, {} excluded; {} retaken",
        live.press.as_ref().map_or(0, |p| p.number),
        live.planned,
        live.done,
        live.valid,
        live.invalid,
        live.missed,
        live.excluded,
        live.retaken
    );
    let seconds = HostDuration::from_secs_f64;
    let elapsed = seconds(live.elapsed_s);
    let waited = std::time::Duration::try_from_secs_f64(live.waited_s).unwrap_or_default();
    outln!(
        "time      {} of rig time in this leg; eta {}",
        clock_text(elapsed),
        eta_text(elapsed, live.eta_s.map(seconds), waited)
    );
    let [one, two] = live.cameras.each_ref().map(|c| {
        c.events_per_s
            .map_or_else(|| "-".to_owned(), |r| format!("{:.1}", r / 1e3))
    });
    let [a, b] = &live.cameras;
    outln!(
        "streams   camera 1 {one}, camera 2 {two} kev/s; trigger {} sent, {}+{} seen; {}+{} bytes lost in this leg",
        live.marks_sent,
        a.marks_seen,
        b.marks_seen,
        a.lost_bytes,
        b.lost_bytes
    );
}

fn print_stored(totals: &Value) {
    let of = |block: &str, key: &str| totals[block][key].as_u64().unwrap_or(0);
    let both = |key: &str| of("presses", key) + of("sync", key);
    outln!(
        "press     {} planned: {} valid, {} invalid, {} missed, {} excluded",
        both("planned"),
        both("valid"),
        both("invalid"),
        both("missed"),
        both("excluded")
    );
}
