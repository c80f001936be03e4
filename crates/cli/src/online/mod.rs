//! `skinrig online`: a recorded session replayed as a live source through the online estimator.

mod feed;
mod offline;
mod summary;

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde::Serialize;
use serde_json::json;
use skinrig_analysis::{Analysis, SessionInput};
use skinrig_model::{CameraId, HostTime, PoseSample, StreamFormat};
use skinrig_online::{
    Decoders, Detection, Estimate, Felt, Live, SkinModel, StreamSettings, Training,
};
use skinrig_recorder::{RecorderError, SessionReader};
use skinrig_results::AlignedSession;

use crate::analysis_request::AnalysisRequest;
use crate::args::{OnlineArgs, StopRule};
use crate::exit::{Exit, Failure, Outcome};
use crate::library::analysis_for_tables;
use crate::paths::shell_path;
use crate::phase::Phase;
use crate::results::open;
use crate::selection::result::{self, SelectedResult};
use crate::selection::{self, Target};
use crate::signals::on_ctrl_c;
use crate::terminal::Output;

use feed::Feed;
pub(crate) use offline::Compared;
use offline::Comparison;
use summary::{Felts, Quantiles, Sighting, words};

/// Largest distance in time of the pose that gives the depth at an instant, ns: at 20 mm/s the tip moves 0.1 mm meanwhile.
const POSE_NS: f64 = 5e6;

/// Times of a replay.
#[derive(Debug, Clone, Serialize)]
struct Speed {
    events: u64,
    events_per_s: f64,
    /// From bytes in to decision out, µs, of packets without a position.
    decision_us: Quantiles,
    /// The same of packets with one.
    position_us: Quantiles,
}

/// A replay as far as it went.
struct Replay {
    found: Vec<Detection>,
    sightings: Vec<Sighting>,
    until_us: i64,
    stopped: bool,
    speed: Speed,
    compared: Compared,
}

fn line(estimate: &Estimate) -> serde_json::Value {
    match estimate {
        Estimate::Felt(d) => json!({
            "t_us": d.host_us, "felt": d.felt, "since_us": d.since_us, "llr": d.llr, "near_mm": d.near_mm,
        }),
        Estimate::Position { host_us, position } => json!({
            "t_us": host_us, "position": position.row(), "events": position.events,
        }),
    }
}

fn taught(error: impl std::fmt::Display, session: &Path) -> Failure {
    Failure::input(format!(
        "{0}: {error}\n  next: `skinrig show {on}` lists what was recorded",
        session.display(),
        on = shell_path(session)
    ))
}

fn learn(
    session: &Path,
    aligned: &AlignedSession,
    analysis: &Analysis,
    false_alarms: f64,
) -> Result<SkinModel, Failure> {
    let _phase = Phase::reading("learning", aligned.events.bytes_read());
    let tips = aligned.tip_courses(false).map_err(Failure::session)?;
    SkinModel::learn(analysis, &aligned.events, &tips, false_alarms).map_err(|e| taught(e, session))
}

/// Waits until the session time that has passed since `start` is due.
fn keep_pace(start: Instant, passed_us: i64, speed: f64, stop: &AtomicBool) {
    let due = Duration::from_micros((passed_us.max(0) as f64 / speed) as u64);
    while let Some(left) = due.checked_sub(start.elapsed()).filter(|l| !l.is_zero()) {
        if stop.load(Ordering::Relaxed) {
            return;
        }
        std::thread::sleep(left.min(Duration::from_millis(50)));
    }
}

fn replay(
    args: &OnlineArgs,
    reader: &SessionReader,
    (analysis, input): (&Analysis, &SessionInput),
    formats: [StreamFormat; 2],
    skin: &SkinModel,
    output: Output,
) -> Result<Replay, Failure> {
    let stop = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&stop);
    on_ctrl_c(move |_| asked.store(true, Ordering::Relaxed)).map_err(Failure::internal)?;
    let settings = StreamSettings {
        every_us: 5_000,
        from_us: 0,
    };
    let mut live = Live::new(Decoders::new(formats), skin, settings).map_err(Failure::input)?;
    let mut feed = Feed::open(reader, *skin.clocks()).map_err(Failure::session)?;
    let mut comparison = Comparison::new(analysis, input).map_err(Failure::input)?;
    let (mut found, mut sightings): (Vec<Detection>, Vec<Sighting>) = (Vec::new(), Vec::new());
    let mut onset_us = 0;
    let (mut events, mut busy_s) = (0u64, 0.0);
    let mut times: [Vec<f64>; 2] = [Vec::new(), Vec::new()];
    let mut estimates: Vec<Estimate> = Vec::new();
    let (start, mut first_us) = (Instant::now(), None);
    while !stop.load(Ordering::Relaxed) {
        let newest = CameraId::ALL.map(|camera| live.newest_us(camera));
        let Some(packet) = feed.next(newest).map_err(Failure::session)? else {
            break;
        };
        estimates.clear();
        let arrived = Instant::now();
        if packet.lost > 0 {
            live.lost(packet.camera, packet.lost);
        }
        let count = live
            .push(packet.camera, packet.bytes, |e| estimates.push(e))
            .map_err(Failure::input)?;
        let taken_s = arrived.elapsed().as_secs_f64();
        let located = estimates
            .iter()
            .any(|e| matches!(e, Estimate::Position { .. }));
        times[usize::from(located)].push(taken_s * 1e6);
        events += count as u64;
        busy_s += taken_s;
        comparison.push(packet.camera, live.packet());
        for estimate in &estimates {
            if output.json {
                outln!("{}", line(estimate));
            }
            match *estimate {
                Estimate::Felt(d) => {
                    if d.felt == Felt::Onset {
                        onset_us = d.host_us;
                    }
                    found.push(d);
                }
                Estimate::Position { host_us, position } => {
                    sightings.push(Sighting {
                        host_us,
                        onset_us,
                        position,
                    });
                }
            }
        }
        if let Some(speed) = args.speed.0 {
            let now_us = live.detector().now_us();
            // The streams begin where both cameras have sent something.
            if live.newest_us(CameraId::One).is_some() && live.newest_us(CameraId::Two).is_some() {
                let first_us = *first_us.get_or_insert(now_us);
                keep_pace(start, now_us - first_us, speed, &stop);
            }
        }
    }
    let [decision, position] = times;
    Ok(Replay {
        until_us: live.detector().now_us(),
        stopped: stop.load(Ordering::Relaxed),
        speed: Speed {
            events,
            events_per_s: events as f64 / busy_s.max(f64::MIN_POSITIVE),
            decision_us: Quantiles::of(decision),
            position_us: Quantiles::of(position),
        },
        compared: comparison.result(),
        found,
        sightings,
    })
}

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or("-".to_owned(), |v| format!("{v:.digits$}"))
}

fn print(skin: &SkinModel, stop: StopRule, felts: &Felts, replay: &Replay, rig: &str) {
    outln!("rig       {rig}");
    outln!(
        "learnt    {} places, {:.0} idle events/s; threshold {:.1} nats from {:.0} s of idle time",
        skin.places(),
        skin.idle_per_s(),
        skin.threshold(),
        skin.idle_s()
    );
    let outside = match felts.outside {
        0 => String::new(),
        more => format!("; {more} more after the end of a camera's data"),
    };
    outln!(
        "felt      {} of {} scored presses; {} missed, {} during a false alarm{outside}",
        felts.felt,
        felts.presses,
        felts.missed,
        felts.alarmed
    );
    let (delay, release) = (felts.delay_ms, felts.release_ms);
    let depth = felts.depth_mm;
    let depth = match depth.n {
        0 => String::new(),
        _ => format!(
            "; tip then {} mm deep (p99 {} mm)",
            number(depth.median, 2),
            number(depth.p99, 2)
        ),
    };
    outln!(
        "delay     median {} ms, p99 {} ms after measured contact{depth}",
        number(delay.median, 1),
        number(delay.p99, 1)
    );
    if let Some((per_s, (low, high))) = felts.false_alarms_per_s {
        outln!(
            "false     {} alarms before contact in {:.0} s: {per_s:.3}/s, 95 % interval [{low:.3}, {high:.3}]",
            felts.false_alarms,
            felts.at_risk_s
        );
    }
    outln!(
        "release   median {} ms, p99 {} ms after the measured one",
        number(release.median, 1),
        number(release.p99, 1)
    );
    for (what, at) in [
        (words(stop), &felts.at_stop),
        ("last before the release".to_owned(), &felts.at_end),
    ] {
        outln!(
            "position  {what}: {} ms after the onset, error median {} mm, p99 {} mm, n {}; region {} mm, holds {} of them",
            number(at.after_onset_ms.median, 0),
            number(at.error_mm.median, 2),
            number(at.error_mm.p99, 2),
            at.error_mm.n,
            number(at.region_mm.median, 2),
            at.inside
                .map_or("-".to_owned(), |s| format!("{:.0} %", 100.0 * s))
        );
    }
    let (touches, held) = felts.held;
    if touches > 0 {
        outln!("regions   hold at every instant in {held} of {touches} touches (95 % stated)");
    } else {
        outln!("regions   none: the calibration presses are too few");
    }
    let reached = &felts.reached;
    let (touches, held) = reached.held;
    if touches > 0 {
        outln!(
            "depth     error median {} mm, p99 {} mm before the release; the interval, then within {} mm, holds at every instant in {held} of {touches}",
            number(reached.error_mm.median, 2),
            number(reached.error_mm.p99, 2),
            number(reached.within_mm.median, 2)
        );
    } else {
        outln!(
            "depth     unknown: that of the calibration presses was not measured, or they are too few"
        );
    }
    outln!(
        "offline   {} of {} press windows give the bits of the analysis",
        replay.compared.equal,
        replay.compared.windows
    );
    let speed = &replay.speed;
    outln!(
        "speed     {:.2} Mev/s; a packet takes {} µs (p99 {}), with a position {} µs (p99 {})",
        speed.events_per_s * 1e-6,
        number(speed.decision_us.median, 0),
        number(speed.decision_us.p99, 0),
        number(speed.position_us.median, 0),
        number(speed.position_us.p99, 0)
    );
}

/// Depth of the measured tip at a time of the host, mm; `None` without poses around it.
fn tip_depth_mm(reader: &SessionReader, host_us: f64) -> Result<Option<f64>, RecorderError> {
    let at = |ns: f64| HostTime(ns as i64);
    let (from, to) = (host_us * 1e3 - POSE_NS, host_us * 1e3 + POSE_NS);
    let poses = reader.poses(at(from), at(to))?;
    let distance = |t: HostTime| (t.0 as f64 - host_us * 1e3).abs();
    let near = |a: &&PoseSample, b: &&PoseSample| distance(a.t).total_cmp(&distance(b.t));
    Ok(poses.iter().min_by(near).map(|pose| -pose.measured.z_mm))
}

/// Opens a session that can be replayed, with its analysis.
fn open_replayable(session: &Path) -> Result<(SessionReader, Analysis), Failure> {
    let reader = SessionReader::open_unchanged(session).map_err(Failure::session)?;
    let id = reader.session_id().map_err(Failure::session)?;
    let (analysis, legs) = analysis_for_tables(session, &reader, &id)?;
    if !legs.is_empty() {
        return Err(Failure::input(format!(
            "{0}: expected a session recorded in one go, found {1} legs\n  next: `skinrig analyze {on}` analyses resumed sessions",
            session.display(),
            legs.len() + 1,
            on = shell_path(session)
        )));
    }
    Ok((reader, analysis))
}

/// As [`open_replayable`], with its selection; an INVALID session has nothing to learn from.
fn open_valid(
    target: &Target,
) -> Result<(SessionReader, Analysis, Option<SelectedResult>), Failure> {
    let session = &target.path;
    let (reader, official) = open_replayable(session)?;
    let (analysis, selected) = match &target.selected {
        None => (official, None),
        Some(selected) => {
            let id = reader.session_id().map_err(Failure::session)?;
            let (analysis, stated) = result::analysis(session, &id, selected, None)?;
            (analysis, Some(stated))
        }
    };
    if !analysis.is_valid() {
        return Err(Failure::limit(format!(
            "{0}: expected a valid session, found an INVALID one: {1}\n  next: `skinrig analyze {on}` says what to mend",
            session.display(),
            analysis.invalid_because().join("; "),
            on = shell_path(session)
        )));
    }
    Ok((reader, analysis, selected))
}

/// Replays a session as a live source and compares the position at the end of each press window with its analysis.
///
/// # Errors
/// When the session cannot be read or analysed.
pub(crate) fn compare(session: &Path) -> Result<Compared, Failure> {
    let (reader, analysis) = open_replayable(session)?;
    let (aligned, _) = open(session, AnalysisRequest::default())?;
    let formats = reader.header().map_err(Failure::session)?.stream_formats;
    let clocks = Training::of(&analysis)
        .map(|training| *training.clocks())
        .map_err(|e| taught(e, session))?;
    let mut decoders = Decoders::new(formats);
    let mut feed = Feed::open(&reader, clocks).map_err(Failure::session)?;
    let mut comparison = Comparison::new(&analysis, &aligned.input).map_err(Failure::input)?;
    loop {
        let newest = CameraId::ALL.map(|camera| decoders.newest_us(camera));
        let Some(packet) = feed.next(newest).map_err(Failure::session)? else {
            return Ok(comparison.result());
        };
        if packet.lost > 0 {
            decoders.lost(packet.camera, packet.lost);
        }
        comparison.push(packet.camera, decoders.decode(packet.camera, packet.bytes));
    }
}

/// `skinrig online`.
///
/// # Errors
/// When the session cannot be read or analysed, or has too few calibration presses to learn from.
pub(crate) fn online(args: &OnlineArgs, output: Output) -> Outcome {
    let target = selection::sessions(&args.session)?.one(&args.session)?;
    let (reader, analysis, selected) = open_valid(&target)?;
    let header = reader.header().map_err(Failure::session)?;
    let choices = AnalysisRequest {
        selection: target.selected.as_ref(),
        ..AnalysisRequest::default()
    };
    let (aligned, _) = open(&target.path, choices)?;
    let skin = learn(&target.path, &aligned, &analysis, args.false_alarms)?;
    let both = (&analysis, &aligned.input);
    let replay = replay(args, &reader, both, header.stream_formats, &skin, output)?;
    let tips = aligned.tip_courses(true).map_err(Failure::session)?;
    let felts = Felts::new(
        &analysis,
        &tips,
        &replay.found,
        &replay.sightings,
        args.stop_at,
        replay.until_us,
        |us| tip_depth_mm(&reader, us),
    )
    .map_err(Failure::session)?;
    if output.json {
        let mut summary = json!({ "summary": {
            "rig": header.rig_name, "threshold": skin.threshold(), "places": skin.places(),
            "felt": felts, "speed": replay.speed, "stopped": replay.stopped,
            "windows": replay.compared.windows, "windows_equal_to_analysis": replay.compared.equal,
        }});
        if let Some(selected) = &selected {
            summary["summary"]["selection"] = selected.document();
        }
        outln!("{summary}");
    } else {
        if let Some(selected) = &selected {
            outln!("SELECTION {}", selected.line());
        }
        print(&skin, args.stop_at, &felts, &replay, &header.rig_name);
    }
    if replay.compared.equal < replay.compared.windows {
        return Err(Failure::internal(format!(
            "{}: expected the bits of the analysis in all {} press windows, found them in {}\n  next: analyse the session again, and report this if it stays",
            target.path.display(),
            replay.compared.windows,
            replay.compared.equal
        )));
    }
    Ok(if replay.stopped {
        Exit::Stopped
    } else {
        Exit::Ok
    })
}
