//! `skinrig analyze` and `skinrig report`, and the end of `run` and `import`: from a session to its results.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};

use skinrig_analysis::motion::MotionCourse;
use skinrig_analysis::reference_code::reference_code;
use skinrig_analysis::result::{Motion, PressResult};
use skinrig_analysis::tradeoff::Tradeoff;
use skinrig_analysis::{Analysis, EarlierAttempt, Keep, LegStart, SessionInput};
use skinrig_model::{AnalysisSettings, CameraId, HostTime, RigGeometry, RunHeader, TriggerEdge};
use skinrig_recorder::{AttemptRow, RecorderError, SessionReader};
use skinrig_report::{Provenance, ReportInput, Variant};

use crate::analyses;
use crate::args::{AnalyzeArgs, ReportArgs};
use crate::exit::{Exit, Failure, Outcome};
use crate::rig_document::RigDocument;
use crate::source::SessionEvents;

/// The results of one session.
pub struct Results {
    /// Where the session is.
    pub session: PathBuf,
    /// The numbers.
    pub analysis: Analysis,
    /// Where the session's further legs begin, as the analysis moved them.
    pub legs: Vec<LegStart>,
    /// Where they come from.
    pub provenance: Provenance,
    /// The tradeoff that lies beside the session, or why it cannot be read.
    pub tradeoff: Option<Result<Tradeoff, String>>,
}

impl Results {
    /// As the report crate takes it.
    #[must_use]
    pub(crate) fn report_input(&self) -> ReportInput<'_> {
        ReportInput {
            analysis: &self.analysis,
            provenance: self.provenance.clone(),
            tradeoff: self
                .tradeoff
                .as_ref()
                .map(|t| t.as_ref().map_err(String::as_str)),
        }
    }
}

/// How to analyse a session.
#[derive(Debug, Clone, Copy, Default)]
pub struct Choices<'a> {
    /// Overrides of the settings it was recorded with.
    pub overrides: &'a [String],
    /// Make the choices of the public code before them, and judge its way too.
    pub reference_code: bool,
    /// What the variant is to be called.
    pub name: Option<&'a str>,
}

/// A session ready to be analysed.
pub(crate) struct Opened {
    pub(crate) reader: SessionReader,
    pub(crate) header: RunHeader,
    pub(crate) input: SessionInput,
    pub(crate) events: SessionEvents,
    /// How the settings differ from the session's own.
    pub(crate) variant: Option<Variant>,
}

/// Opens a session with the settings it was recorded with or with others.
///
/// # Errors
/// [`Failure::input`] for files that are no readable session or settings that do not parse.
pub(crate) fn open(path: &Path, choices: Choices<'_>) -> Result<Opened, Failure> {
    let unreadable = Failure::session;
    let reader = SessionReader::open(path).map_err(unreadable)?;
    let header = reader.header().map_err(unreadable)?;
    let document: RigDocument = serde_json::from_str(&header.rig_json).map_err(|e| {
        Failure::input(format!(
            "{}: expected the description of the rig in the session, found: {e}\n  \
             next: `skinrig verify` says whether the file is damaged",
            path.display()
        ))
    })?;
    let own = document.analysis.clone();
    let settings = settings(&header, document.analysis, choices)?;
    let changes = settings != own || choices.reference_code || choices.name.is_some();
    let variant = changes.then(|| variant(choices));
    let mut input = session_input(&reader, settings, document.geometry).map_err(unreadable)?;
    skinrig_analysis::legs::align(&mut input);
    let events = SessionEvents::new(path, header.stream_formats, &input.legs);
    Ok(Opened {
        reader,
        header,
        input,
        events,
        variant,
    })
}

fn variant(choices: Choices<'_>) -> Variant {
    let own = || analyses::own_name(choices.overrides, choices.reference_code);
    Variant {
        name: choices.name.map_or_else(own, str::to_owned),
        changed: choices.overrides.to_vec(),
        reference_code: choices.reference_code,
    }
}

/// Analyses a session, with the settings it was recorded with or with others.
///
/// # Errors
/// [`Failure::input`] for files that are no readable session or settings that do not parse.
pub fn analyze_session(path: &Path, choices: Choices<'_>) -> Result<Results, Failure> {
    let session = open(path, choices)?;
    // The public code judges calibrating presses too.
    let keep = if choices.reference_code {
        Keep::All
    } else {
        Keep::Scored
    };
    let (input, events) = (&session.input, &session.events);
    let (mut analysis, kept) =
        skinrig_analysis::analyze_and_keep(input, events, keep).map_err(Failure::input)?;
    analysis.reference = choices
        .reference_code
        .then(|| reference_code(input, &analysis, &kept));
    analysis.motion = motion(&session.reader, &analysis).map_err(Failure::session)?;
    let mut provenance = crate::provenance::provenance(&session.reader, &session.header, &analysis)
        .map_err(Failure::session)?;
    provenance.variant = session.variant;
    Ok(Results {
        session: path.to_owned(),
        analysis,
        legs: session.input.legs,
        provenance,
        tradeoff: crate::tradeoff_file::beside_session(path),
    })
}

/// The robot's path against its commands, in full around the presses that the report looks at closely.
fn motion(reader: &SessionReader, analysis: &Analysis) -> Result<Option<Motion>, RecorderError> {
    let close = |p: &&PressResult| analysis.zooms.iter().any(|z| z.press == p.press);
    let presses = analysis.presses.iter().filter(close);
    let mut course = MotionCourse::new(presses.filter_map(|p| Some((p.press, p.timing?))));
    let ever = (HostTime(i64::MIN), HostTime(i64::MAX));
    reader.for_each_pose_block(ever.0, ever.1, |samples| course.push(samples))?;
    Ok(course.finish())
}

/// The settings of the session's own protocol or schedule, with the choices.
fn settings(
    header: &RunHeader,
    recorded: AnalysisSettings,
    choices: Choices<'_>,
) -> Result<AnalysisSettings, Failure> {
    if let Some(other) = choices
        .overrides
        .iter()
        .find(|o| !o.trim_start().starts_with("analysis."))
    {
        return Err(Failure::input(format!(
            "--set {other}: expected a key below `analysis.`; a recorded session's other values cannot change"
        )));
    }
    if choices.overrides.is_empty() && !choices.reference_code {
        return Ok(recorded);
    }
    let mut all = header.overrides.clone();
    if choices.reference_code {
        all.extend(skinrig_protocol::REFERENCE_CODE.map(str::to_owned));
    }
    all.extend_from_slice(choices.overrides);
    if let Some(old) = choices.overrides.iter().find(|o| {
        let key = o.trim_start().split('=').next().unwrap_or_default();
        key.trim_end() == "analysis.exclude_presses"
    }) {
        return Err(Failure::input(format!(
            "--set {old}: expected `analysis.exclude_press_numbers`, which counts presses from 1, found the key of earlier versions, \
             which counts from 0"
        )));
    }
    let text = header.protocol_text.as_bytes();
    let loader = skinrig_formats::regular::read_text;
    if header.rig_kind == "imported" {
        skinrig_protocol::schedule::Schedule::parse_recorded(&header.protocol_name, text, &all)
            .map(|s| s.analysis)
            .map_err(|found| Failure::findings(&found))
    } else {
        skinrig_protocol::Protocol::parse_recorded(&header.protocol_name, text, &all, &loader)
            .map(|p| p.analysis)
            .map_err(|found| Failure::findings(&found))
    }
}

fn session_input(
    reader: &SessionReader,
    settings: AnalysisSettings,
    rig: RigGeometry,
) -> Result<SessionInput, RecorderError> {
    let (mut planned, mut outcomes, mut earlier) = (Vec::new(), Vec::new(), Vec::new());
    for (press, mut attempts) in reader.presses()? {
        planned.push(press);
        outcomes.push(attempts.pop().and_then(|last| last.outcome));
        earlier.extend(attempts.iter().filter_map(earlier_attempt));
    }
    let (pose_interval_us, crossing_se_us) = crate::contacts::timing(reader, &outcomes)?;
    let descents = crate::contacts::descents(reader, &outcomes)?;
    let [one, two] = CameraId::ALL;
    let further = reader.legs()?.into_iter().skip(1);
    let legs = further.map(|leg| LegStart::recorded(leg.origin, leg.camera_origin_us));
    let legs = legs.collect();
    Ok(SessionInput {
        planned,
        outcomes,
        earlier,
        edges: [
            on_time(reader.trigger_edges(one)?, rig.trigger_delay_us[0]),
            on_time(reader.trigger_edges(two)?, rig.trigger_delay_us[1]),
        ],
        marks: reader.marks_sent()?,
        box_reports: reader
            .box_reports()?
            .into_iter()
            .map(|(_, said)| said)
            .collect(),
        gaps: [reader.gaps(one)?, reader.gaps(two)?],
        recorded: [reader.recorded(one)?, reader.recorded(two)?],
        pose_interval_us,
        crossing_se_us,
        descents,
        legs,
        rig,
        settings,
    })
}

/// `None` of one that never began.
fn earlier_attempt(attempt: &AttemptRow) -> Option<EarlierAttempt> {
    let timing = attempt.outcome.as_ref().and_then(|o| o.timing);
    Some(EarlierAttempt {
        begun: attempt.intent.or(timing.map(|t| t.approach))?,
        clear: timing.map(|t| t.clear),
    })
}

/// Writes the results beside the session (or to `json_path`) and the report; returns both paths. A variant has files of its own.
///
/// # Errors
/// [`Failure::internal`] when a file cannot be written.
pub(crate) fn write_results(
    results: &Results,
    json_path: Option<&Path>,
    html_path: Option<&Path>,
) -> Result<(PathBuf, PathBuf), Failure> {
    let name = results.provenance.variant.as_ref().map(|v| v.name.as_str());
    let own_place = || analyses::results_path(&results.session, name);
    let json_path = json_path.map_or_else(own_place, Path::to_owned);
    let own_place = || analyses::report_path(&results.session, name);
    let html_path = html_path.map_or_else(own_place, Path::to_owned);
    let (json, html) = documents(results)?;
    write(&json_path, json.as_bytes())?;
    write(&html_path, html.as_bytes())?;
    Ok((json_path, html_path))
}

/// The results as JSON and the report.
///
/// # Errors
/// [`Failure::internal`] when one cannot be put together.
pub(crate) fn documents(results: &Results) -> Result<(String, String), Failure> {
    let input = results.report_input();
    let json =
        serde_json::to_string_pretty(&skinrig_report::json(&input)).map_err(Failure::internal)?;
    let html = skinrig_report::html(&input).map_err(Failure::internal)?;
    Ok((json, html))
}

/// Writes a whole file or none: a full disk leaves no half of it.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    crate::whole_file::write(path, bytes).map_err(|e| {
        let next = match e.kind() {
            std::io::ErrorKind::StorageFull => {
                "free space there, or choose another place with --out"
            }
            _ => "choose another place with --out",
        };
        Failure::internal(format!(
            "{}: cannot write: {e}\n  next: {next}",
            path.display()
        ))
    })
}

/// Prints the results table and the paths of what was written.
pub(crate) fn print_results(results: &Results, json: bool, paths: &(PathBuf, PathBuf)) {
    if json {
        let mut document = skinrig_report::json(&results.report_input());
        if let Some(object) = document.as_object_mut() {
            object.insert(
                "files".into(),
                serde_json::json!({
                    "session": results.session, "results": paths.0, "report": paths.1,
                }),
            );
        }
        crate::terminal::print_json(&document);
    } else {
        let color = std::io::stdout().is_terminal();
        let table = skinrig_report::terminal_table(&results.report_input(), color);
        crate::terminal::out(format_args!("{table}"));
        outln!("\nsession  {}", results.session.display());
        outln!("results  {}", paths.0.display());
        outln!("report   {}", paths.1.display());
    }
}

/// Ok, or code 4 when the session is INVALID or the scored RMSE is above the limit (or there is none to compare).
///
/// # Errors
/// [`Failure::limit`].
pub fn check_limit(results: &Results, max_rmse_mm: Option<f64>) -> Outcome {
    let analysis = &results.analysis;
    if !analysis.is_valid() {
        let next = if analysis.alignment.is_usable() {
            "mend what the audit names (its findings say what to do), and import or analyse again"
        } else {
            "see the alignment certificate in the report; limits are below `analysis.alignment`"
        };
        return Err(Failure::limit(format!(
            "the session is INVALID: none of its numbers is to be used\n  {}\n  next: {next}",
            analysis.invalid_because().join("\n  ")
        )));
    }
    let Some(limit) = max_rmse_mm else {
        return Ok(Exit::Ok);
    };
    match results.analysis.scored.rmse_mm.value {
        Some(rmse) if rmse <= limit => Ok(Exit::Ok),
        Some(rmse) => Err(Failure::limit(format!(
            "scored RMSE: expected at most {limit} mm (--max-rmse), found {rmse:.3} mm"
        ))),
        None => Err(Failure::limit(format!(
            "scored RMSE: expected at most {limit} mm (--max-rmse), found none: no scored press was located"
        ))),
    }
}

/// `skinrig analyze`.
///
/// # Errors
/// See [`analyze_session`], `write_results`, [`check_limit`].
pub fn analyze(args: &AnalyzeArgs, json: bool) -> Outcome {
    let choices = Choices {
        overrides: &args.overrides,
        reference_code: args.reference_code,
        name: args.name.as_deref(),
    };
    let results = analyze_session(&args.session, choices)?;
    if let (Some(variant), Some(out)) = (&results.provenance.variant, &args.out) {
        let official = analyses::results_path(&args.session, None);
        not_official(&official, out, variant)?;
    }
    let html = args.out.as_ref().map(|out| out.with_extension("html"));
    let older = replaced(&results, args.out.as_deref());
    let paths = write_results(&results, args.out.as_deref(), html.as_deref())?;
    older.iter().for_each(|note| errln!("{note}"));
    print_results(&results, json, &paths);
    check_limit(&results, args.max_rmse)
}

/// A variant in the place of the `official` file would be taken for it.
pub(crate) fn not_official(official: &Path, out: &Path, variant: &Variant) -> Result<(), Failure> {
    let place = |path: &Path| {
        let folder = crate::paths::folder_of(path).canonicalize().ok();
        (folder, path.file_name().map(std::ffi::OsStr::to_owned))
    };
    if place(official) != place(out) {
        return Ok(());
    }
    Err(Failure::input(format!(
        "--out {}: expected another place for the variant `{}`, found that of the official results\n  next: leave --out out",
        out.display(),
        variant.name
    )))
}

/// A remark when results of another version of the analysis are about to be replaced.
fn replaced(results: &Results, out: Option<&Path>) -> Option<String> {
    let name = results.provenance.variant.as_ref().map(|v| v.name.as_str());
    let id = &results.provenance.session_id;
    let before = analyses::summary(&results.session, id, name)
        .ok()
        .filter(|_| out.is_none())?;
    let (then, now) = (before.analysis_version, results.analysis.version);
    (then != now).then(|| {
        format!(
            "note: the results of analysis version {then} are replaced by those of version {now}"
        )
    })
}

/// `skinrig report`.
///
/// # Errors
/// See [`analyze_session`], `write_results`.
pub fn report(args: &ReportArgs, json: bool) -> Outcome {
    let variant = match &args.analysis {
        None => None,
        Some(name) => {
            let reader = SessionReader::open(&args.session).map_err(Failure::session)?;
            let id = reader.session_id().map_err(Failure::session)?;
            Some(analyses::variant(&args.session, &id, name)?)
        }
    };
    let choices = variant.as_ref().map_or_else(Choices::default, |v| Choices {
        overrides: &v.changed,
        reference_code: v.reference_code,
        name: Some(&v.name),
    });
    let results = analyze_session(&args.session, choices)?;
    let older = replaced(&results, None);
    let paths = write_results(&results, None, args.out.as_deref())?;
    older.iter().for_each(|note| errln!("{note}"));
    if json {
        crate::terminal::print_json(&serde_json::json!({ "report": paths.1, "results": paths.0 }));
    } else {
        outln!("{}", paths.1.display());
    }
    check_limit(&results, None)
}

/// Edges at the instants at which they reached the camera's input: it stamps them so much later. An edge within that time of
/// the camera's first microsecond is put on it.
fn on_time(mut edges: Vec<TriggerEdge>, delay_us: u16) -> Vec<TriggerEdge> {
    for edge in &mut edges {
        edge.t_us = edge.t_us.saturating_sub(u64::from(delay_us));
    }
    edges
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_are_moved_to_when_they_reached_the_camera() {
        let edge = |t_us| TriggerEdge {
            t_us,
            channel: 0,
            rising: true,
        };
        let edges = || vec![edge(2), edge(1_000_003), edge((1 << 34) + 1)];
        assert_eq!(on_time(edges(), 0), edges());
        let moved = vec![edge(0), edge(1_000_000), edge((1 << 34) - 2)];
        assert_eq!(on_time(edges(), 3), moved);
    }
}
