//! `skinrig resume`: continues an unfinished session in a further leg.

use std::path::{Path, PathBuf};

use chrono::{SecondsFormat, Utc};
use sha2::{Digest, Sha256};
use skinrig_controller::{Preflight, Resume, Run, RunReport};
use skinrig_device::Rig;
use skinrig_hil::lease::Lease;
use skinrig_model::{
    DeviceRole, HostTime, PlannedPress, Point2, PressHistory, PressRole, PressVerdict, Record,
    ResumeHeader, RunEnd, RunHeader, SimLevel,
};
use skinrig_notify::Notifier;
use skinrig_protocol::rig::RigFile;
use skinrig_protocol::{Plan, Protocol, Route};
use skinrig_recorder::{DeviceRow, RecorderError, SessionReader, SessionWriter};
use skinrig_sim::FaultWatch;

use crate::args::ResumeArgs;
use crate::conclusion::{close, conclude};
use crate::exit::{Exit, Failure, Outcome};
use crate::fault::FaultInjector;
use crate::hil::lease;
use crate::host::host_name;
use crate::looks::LookMode;
use crate::notify::{self, RunMessages};
use crate::paths::{self, shell_path};
use crate::progress::ProgressView;
use crate::rig::tolerated::ToleratedMismatches;
use crate::rig::{self, bench, gates, planted};
use crate::signals::Operator;
use crate::sink::{ReplayExpectations, SessionSink};
use crate::terminal::Output;
use skinrig_results::Rescan;
use skinrig_results::RigDocument;

/// Content of an unfinished session.
struct UnfinishedSession {
    header: RunHeader,
    document: RigDocument,
    plan: Plan,
    histories: Vec<PressHistory>,
    devices: Vec<DeviceRow>,
    end: Option<RunEnd>,
    legs: usize,
}

/// `skinrig resume`.
///
/// # Errors
/// [`Failure`] with the exit code of its kind.
pub(crate) fn resume(args: &ResumeArgs, command_line: &str, output: Output) -> Outcome {
    let operator = Operator::listen().map_err(Failure::internal)?;
    let session = &args.session;
    // From here on this process is the only writer, and the content is verified.
    let writer = match SessionWriter::resume::<Rescan>(session) {
        Err(RecorderError::AlreadyCompleted { .. }) => return only_seal(session),
        opened => opened.map_err(refusal)?,
    };
    let found = read(session)?;
    let pending = found.plan.pending(&found.histories);
    if let (Some(end), false) = (&found.end, pending.contains(&true)) {
        drop(writer);
        if SessionReader::open(session)
            .and_then(|reader| reader.seal())
            .is_ok_and(|seal| seal.is_none())
        {
            return only_seal(session);
        }
        return Err(Failure::input(nothing_left(session, end)));
    }
    if !output.json {
        outln!("{}", describe(session, &found, &pending));
    }
    let header = ResumeHeader {
        operator: found.header.operator.clone(),
        started_at: Utc::now().to_rfc3339_opts(SecondsFormat::Secs, true),
        host: host_name(),
        software: crate::version::SOFTWARE.to_owned(),
        command_line: command_line.to_owned(),
    };
    let (session, report) = if pending.contains(&true) {
        run_leg(args, &found, &pending, header, writer, &operator)?
    } else {
        (session.clone(), end_only(&found, header, writer)?)
    };
    conclude(&session, &report, args.no_analysis, None, output)
}

/// Why a session cannot be resumed: a list of its problems, or why it cannot be read.
fn refusal(error: RecorderError) -> Failure {
    match error {
        RecorderError::Unsound {
            path,
            problems,
            more_problems,
        } => {
            let name = path.display();
            let mut words = format!(
                "{name}: expected a sound session to continue, found {} problem(s)",
                problems.len() as u64 + more_problems
            );
            words.extend(problems.iter().map(|problem| format!("\n  {problem}")));
            if more_problems > 0 {
                words += &format!("\n  and {more_problems} more");
            }
            words += &format!(
                "\n  nothing was changed\n  next: `skinrig salvage {}` copies the intact part into a new session",
                shell_path(&path)
            );
            Failure::limit(words)
        }
        other => Failure::session(other),
    }
}

/// Message for a session whose presses all have outcomes; a further leg would not change how the run ended.
fn nothing_left(session: &Path, end: &RunEnd) -> String {
    let reason = match end.reason() {
        None => end.name().to_owned(),
        Some(reason) => format!("{}: {reason}", end.name()),
    };
    format!(
        "{0}: expected presses left to make, found none; the run ended {reason}\n  next: resolve that, then `skinrig analyze {on}`",
        session.display(),
        on = shell_path(session)
    )
}

/// Reads what a further leg needs; rejects sessions that cannot have one.
fn read(session: &Path) -> Result<UnfinishedSession, Failure> {
    let refused = |expected: &str, found: String, next: &str| {
        let session = session.display();
        Failure::input(format!(
            "{session}: expected {expected}, found {found}\n  next: {next}"
        ))
    };
    let reader = SessionReader::open(session).map_err(Failure::session)?;
    let header = reader.header().map_err(Failure::session)?;
    if !header.is_of_a_rig() {
        return Err(refused(
            "a session recorded by a rig",
            format!(
                "one that was {}: there are no presses to make",
                header.rig_kind
            ),
            "import or replay the recording again",
        ));
    }
    let verify = "`skinrig verify` shows what is damaged";
    for (what, text, digest) in [
        ("protocol", &header.protocol_text, &header.protocol_sha256),
        ("plan", &header.plan_json, &header.plan_sha256),
    ] {
        let found: String = Sha256::digest(text.as_bytes())
            .iter()
            .map(|b| format!("{b:02x}"))
            .collect();
        if found != *digest {
            let expected = format!("a {what} with SHA-256 {digest}");
            return Err(refused(&expected, found, verify));
        }
    }
    let document = serde_json::from_str(&header.rig_json)
        .map_err(|e| refused("the description of the rig", e.to_string(), verify))?;
    let plan: Plan = serde_json::from_str(&header.plan_json)
        .map_err(|e| refused("a plan", e.to_string(), verify))?;
    if plan.presses != header.presses {
        let found = format!("{} that differ", header.presses.len());
        return Err(refused("the presses of the plan", found, verify));
    }
    let all = || -> Result<_, RecorderError> {
        let end = reader.end()?.map(|(_, end)| end);
        Ok((
            reader.history()?,
            reader.devices()?,
            end,
            reader.legs()?.len(),
        ))
    };
    let (histories, devices, end, legs) = all().map_err(Failure::session)?;
    Ok(UnfinishedSession {
        header,
        document,
        plan,
        histories,
        devices,
        end,
        legs,
    })
}

/// State of the session and remaining work, for the terminal.
fn describe(session: &Path, found: &UnfinishedSession, pending: &[bool]) -> String {
    let ended = match &found.end {
        None => "cut off".to_owned(),
        Some(RunEnd::Stopped(reason)) => format!("stopped: {reason}"),
        Some(RunEnd::Faulted(causes)) => format!("faulted: {causes}"),
        Some(RunEnd::Completed) => "completed, with presses lost to rig faults".to_owned(),
    };
    let all = || found.plan.presses.iter().zip(&found.histories).zip(pending);
    let valid = all().filter(|((_, h), _)| h.verdict == Some(PressVerdict::Valid));
    let interrupted: Vec<_> = all()
        .filter(|((_, h), _)| h.attempts > 0 && h.verdict.is_none())
        .map(|((p, _), _)| p)
        .collect();
    let cut_off = match interrupted.as_slice() {
        [] => String::new(),
        presses => format!("; {} cut off", names(presses)),
    };
    let of = |role: fn(PressRole) -> bool| -> Vec<&PlannedPress> {
        all()
            .filter(|((p, _), pending)| **pending && role(p.role))
            .map(|((p, _), _)| p)
            .collect()
    };
    let sync = of(|role| role == PressRole::Sync);
    let rest = of(|role| role != PressRole::Sync);
    let next = match (rest.as_slice(), sync.len()) {
        ([], _) => "no press: only the end of the session is missing".to_owned(),
        (rest, 0) => names(rest),
        (rest, n) => format!("{n} sync presses, {}", names(rest)),
    };
    format!(
        "session   {}\nleg {:<6}{ended}\ndone      {} of {} presses valid{cut_off}\nto do     {next}\n",
        session.display(),
        found.legs,
        valid.count(),
        pending.len(),
    )
}

/// `press 5` or `187 presses from press 59 to press 245`.
fn names(presses: &[&PlannedPress]) -> String {
    match presses {
        [one] => one.id.to_string(),
        [first, .., last] => format!("{} presses from {} to {}", presses.len(), first.id, last.id),
        [] => "none".to_owned(),
    }
}

/// Opens the rig of the session and makes the remaining presses.
fn run_leg(
    args: &ResumeArgs,
    found: &UnfinishedSession,
    pending: &[bool],
    header: ResumeHeader,
    writer: SessionWriter,
    operator: &Operator,
) -> Result<(PathBuf, RunReport), Failure> {
    let protocol = protocol_of(found)?;
    let rest = rest_of(&protocol, &found.plan, pending)?;
    let OpenedRig {
        rig,
        watch,
        preflight,
        notes,
        notifier,
        bench,
    } = open_rig(args, found, protocol, &rest, pending)?;
    let expected = skinrig_model::HostDuration::from_secs_f64(rest.summary().duration_s);
    let view = ProgressView::resumed(&found.plan.presses, &found.histories, pending, expected);
    let folder = paths::folder_of(&args.session);
    let sink = SessionSink::new(writer, view, ReplayExpectations::default());
    let mut sink = sink
        .on_disk_of(folder)
        .controlled(&args.session, operator.control(), false)
        .with_notes(notes)
        .with_faults(FaultInjector::new(&args.faults, watch))
        .notifying(notifier.map(|notifier| RunMessages::new(notifier, &found.header)));
    let settings = bench::settings(&rig.kind);
    let looks = match found.header.rig_kind.as_str() {
        "simulated" => LookMode::of_simulation(args.real_time),
        _ => LookMode::Background,
    };
    let session_header = found.header.clone();
    let report = Run::new(&rest, session_header, rig, operator.control(), &mut sink)
        .with_settings(settings)
        .looking(looks.at(&args.session))
        .checked(preflight)
        .resumed(Resume {
            header,
            histories: found.histories.clone(),
        })
        .execute();
    let closed = close(sink, args.session.clone(), report, operator);
    if let Some(bench) = bench {
        bench.tolerated.propose(&bench.file);
    }
    closed
}

/// Parses the session's own protocol again: its text is in the session, files that it names are read from their paths.
fn protocol_of(found: &UnfinishedSession) -> Result<Protocol, Failure> {
    let header = &found.header;
    let loader = skinrig_formats::regular::read_text;
    Protocol::parse_recorded(
        &header.protocol_name,
        header.protocol_text.as_bytes(),
        &header.overrides,
        &loader,
    )
    .map_err(|found| Failure::findings(&found))
}

/// The remaining plan: with straight paths where they are free, else with the planned ones.
fn rest_of(protocol: &Protocol, plan: &Plan, pending: &[bool]) -> Result<Plan, Failure> {
    let is_pending = |id: skinrig_model::PressId| pending.get(id.index() as usize) == Some(&true);
    let straight = plan.remaining(is_pending, Route::Straight);
    if protocol.check(&straight).is_ok() {
        return Ok(straight);
    }
    let planned = plan.remaining(is_pending, Route::AsPlanned);
    let checked = protocol.check(&planned).map(|()| planned);
    checked.map_err(|found| Failure::findings(&found))
}

/// Where the simulated skin was pressed in earlier legs. An attempt that is repeated does not count, so that it meets the same
/// contact again.
fn pressed_before(found: &UnfinishedSession, pending: &[bool]) -> Vec<Point2> {
    let all = found.plan.presses.iter().zip(&found.histories).zip(pending);
    all.flat_map(|((press, history), pending)| {
        let attempted = history.attempts.saturating_sub(u32::from(*pending));
        (0..attempted).map(|_| press.at)
    })
    .collect()
}

/// The opened rig of a session.
struct OpenedRig {
    rig: Rig,
    /// The watch over injected faults; `None` on a bench.
    watch: Option<FaultWatch>,
    preflight: Preflight,
    /// Notes for the session.
    notes: Vec<String>,
    /// For messages about the end of the leg.
    notifier: Option<Notifier>,
    /// The bench, held until the session is closed; `None` for the simulated rig.
    bench: Option<OpenBench>,
}

/// State of an opened bench.
struct OpenBench {
    tolerated: ToleratedMismatches,
    file: RigFile,
    _lease: Lease,
}

/// Opens the rig of the session.
fn open_rig(
    args: &ResumeArgs,
    found: &UnfinishedSession,
    protocol: Protocol,
    rest: &Plan,
    pending: &[bool],
) -> Result<OpenedRig, Failure> {
    let folder = paths::folder_of(&args.session);
    let header = &found.header;
    let summary = rest.summary();
    if header.rig_kind == "simulated" {
        let unfit = match &args.rig {
            _ if args.tolerant => {
                "--tolerant, because the simulated rig of this session has no mismatches"
            }
            Some(_) => "--rig, because the session is of the simulated rig",
            None => "",
        };
        if !unfit.is_empty() {
            let session = args.session.display();
            return Err(Failure::input(format!("{session}: expected no {unfit}")));
        }
        let notifier = notify::for_run(args.notify.as_deref(), None)?;
        let level = found.document.rig["level"].as_str().unwrap_or_default();
        let level: SimLevel = level
            .parse()
            .map_err(|e| Failure::input(format!("{}: rig: {e}", args.session.display())))?;
        let faults = &args.faults;
        let (rig, watch) = rig::simulated_after(
            &protocol,
            level,
            header.seed,
            args.real_time,
            faults,
            rig::EarlierLegs {
                count: found.legs as u32,
                pressed: pressed_before(found, pending),
            },
        )?;
        let mut preflight = gates::of_simulated(&rig, folder, summary.expected_bytes);
        preflight
            .caller_checks
            .insert(0, gates::recorder(&args.session));
        let notes = planted::label(faults).into_iter().collect();
        return Ok(OpenedRig {
            rig,
            preflight,
            watch: Some(watch),
            notes,
            notifier,
            bench: None,
        });
    }
    let recorded = found.document.rig["file_name"].as_str();
    let path = args.rig.clone().or(recorded.map(PathBuf::from));
    let path = path.ok_or_else(|| {
        Failure::input(format!(
            "{}: expected the rig file of the session with --rig, found none",
            args.session.display()
        ))
    })?;
    let mut file = bench::load(&path)?;
    if args.tolerant {
        bench::tolerate(&mut file);
    }
    planted::refuse(&args.faults, &bench::display_name(&file))?;
    same_bench(&file, found)?;
    let rig_notify = Some((file.file_name.as_str(), file.notify.as_ref()));
    let notifier = notify::for_run(args.notify.as_deref(), rig_notify)?;
    let lease = lease::take(&file, &format!("resume {}", args.session.display()))?;
    let (rig, tolerated) = bench::open(&file, &protocol)?;
    let notes = same_devices(&rig, &found.devices, args.allow_other_device)?;
    let mut preflight = gates::of_bench(&file, &rig, folder, summary.duration_s);
    preflight
        .caller_checks
        .insert(0, gates::recorder(&args.session));
    Ok(OpenedRig {
        rig,
        watch: None,
        preflight,
        notes,
        notifier,
        bench: Some(OpenBench {
            tolerated,
            file,
            _lease: lease,
        }),
    })
}

/// Checks that the rig file is of the session's bench: same kind, same skin frame, and limits that allow the plan.
fn same_bench(file: &RigFile, found: &UnfinishedSession) -> Result<(), Failure> {
    let differs = |what: &str, expected: String, found: String| {
        Failure::input(format!(
            "{}: {what}: expected {expected}, as in the session, found {found}\n  \
             next: resume on the bench as it was, or begin a new session with `skinrig run`",
            file.file_name
        ))
    };
    let (header, limits) = (&found.header, &found.plan.limits);
    if file.kind.name() != header.rig_kind {
        let kind = file.kind.name().to_owned();
        return Err(differs("kind", header.rig_kind.clone(), kind));
    }
    if file.frame.robot_from_skin != header.robot_from_skin {
        let place = |t: &skinrig_model::RigidTransform<_, _>| format!("{:?} mm", t.translation_mm);
        let (was, is) = (&header.robot_from_skin, &file.frame.robot_from_skin);
        return Err(differs("frame", place(was), place(is)));
    }
    for (what, was, is) in [
        (
            "limits.max_speed",
            limits.max_speed_mm_s,
            file.limits.max_speed_mm_s,
        ),
        (
            "limits.max_force",
            limits.max_force_n,
            file.limits.max_force_n,
        ),
        (
            "limits.max_depth",
            limits.max_depth_mm,
            file.limits.max_depth_mm,
        ),
    ] {
        if is < was {
            return Err(differs(what, format!("{was} or more"), is.to_string()));
        }
    }
    Ok(())
}

/// Checks that the devices are those of the session; if `others` are allowed, returns a note for each.
fn same_devices(rig: &Rig, known: &[DeviceRow], others: bool) -> Result<Vec<String>, Failure> {
    let [one, two] = &rig.cameras;
    let mut notes = Vec::new();
    for (role, now) in [
        (DeviceRole::Indenter, rig.indenter.identity()),
        (DeviceRole::Camera1, one.identity()),
        (DeviceRole::Camera2, two.identity()),
    ] {
        let before = known.iter().rev().find(|d| d.role == role);
        if let Some(before) = before
            && before.identity.serial != now.serial
        {
            notes.push(format!(
                "{role}: expected serial {}, as in the session, found {}",
                before.identity.serial, now.serial
            ));
        }
    }
    if notes.is_empty() || others {
        return Ok(notes);
    }
    Err(Failure::input(format!(
        "{}\n  next: connect the device of the session, or accept the other one with --allow-other-device (it is recorded)",
        notes.join("\n")
    )))
}

/// Writes the missing end of a session whose presses all have outcomes; uses no device.
fn end_only(
    found: &UnfinishedSession,
    header: ResumeHeader,
    mut writer: SessionWriter,
) -> Result<RunReport, Failure> {
    let end = || -> Result<(), RecorderError> {
        writer.accept(Record::Resumed(Box::new(header)))?;
        writer.accept(Record::Ended {
            t: HostTime::ZERO,
            end: RunEnd::Completed,
        })?;
        writer.finish().map(drop)
    };
    end().map_err(Failure::internal)?;
    let count = |verdict: fn(&PressVerdict) -> bool| {
        let last = found.histories.iter().filter_map(|h| h.verdict.as_ref());
        last.filter(|v| verdict(v)).count()
    };
    let planned = found.histories.len();
    let valid = count(|v| matches!(v, PressVerdict::Valid | PressVerdict::Excluded(_)));
    let missed = count(|v| matches!(v, PressVerdict::Missed(_)));
    Ok(RunReport {
        end: RunEnd::Completed,
        press_faults: Vec::new(),
        valid_presses: Vec::new(),
        ended_at: HostTime::ZERO,
        planned,
        valid,
        invalid: planned - valid - missed,
        missed,
        retracted: true,
        disarmed: true,
        problems: Vec::new(),
    })
}

/// Adds the missing seal of a session that has ended.
fn only_seal(session: &Path) -> Outcome {
    let writer = SessionWriter::open_ended::<Rescan>(session).map_err(refusal)?;
    let notify = || errln!("{}", crate::sink::HELD_OPEN);
    writer
        .finish_with_notice(notify)
        .map_err(Failure::internal)?;
    outln!(
        "{}: ended; only its seal was missing, and has been added\n  next: skinrig analyze {on}",
        session.display(),
        on = shell_path(session)
    );
    Ok(Exit::Ok)
}

#[cfg(test)]
mod tests {
    use super::*;
    use skinrig_sim::{SimConfig, simulated_rig};

    #[test]
    fn another_device_is_rejected_or_noted() {
        let rig = |seed| simulated_rig(&SimConfig::new(seed, SimLevel::Kinematic));
        let (before, now) = (rig(1), rig(2));
        let row = |role, identity| DeviceRow {
            role,
            identity,
            settings: Vec::new(),
        };
        // Camera 1 was exchanged before; its last serial counts.
        let known = [
            row(DeviceRole::Camera1, before.cameras[0].identity()),
            row(DeviceRole::Indenter, now.indenter.identity()),
            row(DeviceRole::Camera1, now.cameras[0].identity()),
            row(DeviceRole::Camera2, before.cameras[1].identity()),
        ];
        let same = &known[1..3];
        assert_eq!(same_devices(&now, same, false).unwrap(), [""; 0]);
        let serials = |of: &Rig| of.cameras[1].identity().serial;
        let note = format!(
            "camera 2: expected serial {}, as in the session, found {}",
            serials(&before),
            serials(&now)
        );
        assert_eq!(same_devices(&now, &known, true).unwrap(), [note.as_str()]);
        let refused = same_devices(&now, &known, false).unwrap_err().message;
        assert!(refused.contains(&note), "{refused}");
        assert!(refused.contains("--allow-other-device"), "{refused}");
    }
}
