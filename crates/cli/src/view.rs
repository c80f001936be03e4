//! `skinrig view`: arguments of the server, and what it asks of the rest of the program.

use std::net::{IpAddr, SocketAddr};
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use serde_json::{Value, json};
use skinrig_analysis::Analysis;
use skinrig_catalogue::ListedAnalysis;
use skinrig_controller::State;
use skinrig_hil::history::{self, HISTORY_FILE};
use skinrig_nightly::trend::Filter;
use skinrig_recorder::{SessionState, SessionSummary};
use skinrig_view::{
    AnalysisEntry, Lab, LabError, NewestBytes, Options, RunState, Server, SettingDifference,
    SettingValues, ShelfSession,
};

use crate::args::ViewArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::remote::{NewestEvents, Reply, Request, RunRequest, ask};
use crate::rig::gates;
use crate::shelf::{Shelf, estimate};
use crate::{analyses, compare, control, paths, prototypes, sessions};

/// Serves a folder of sessions until ctrl-C.
///
/// # Errors
/// [`Failure::input`] for what is neither a session nor a folder, or for an address that cannot be opened.
pub(crate) fn view(args: &ViewArgs, json: bool) -> Outcome {
    let (folder, first) = place(&args.session)?;
    // Once: the page lists the folder again and again.
    Shelf::told(&folder)?;
    let options = Options {
        folder,
        first,
        bind: args.bind.unwrap_or(Options::LOOPBACK),
        control: args.control,
    };
    let server = Server::open(options, Program).map_err(Failure::input)?;
    if json {
        crate::terminal::print_json(&json!({
            "link": server.link(), "address": server.address(), "control": args.control,
        }));
    } else {
        errln!("{}", server.opens());
        errln!("whoever has the link can read; ctrl-C ends");
        outln!("{}", server.link());
    }
    server.run().map_err(Failure::internal)?;
    Ok(Exit::Ok)
}

/// `ADDRESS` or `ADDRESS:PORT`.
pub(crate) fn address(text: &str) -> Result<SocketAddr, std::net::AddrParseError> {
    match text.parse::<IpAddr>() {
        Ok(ip) => Ok(SocketAddr::new(ip, 0)),
        Err(_) => text.parse(),
    }
}

/// The folder, and the session to open first.
fn place(given: &Path) -> Result<(PathBuf, Option<String>), Failure> {
    if given.is_dir() {
        return Ok((given.to_owned(), None));
    }
    let name = given.file_name().map(|n| n.to_string_lossy().into_owned());
    match name {
        Some(name) if given.is_file() => Ok((paths::folder_of(given).to_owned(), Some(name))),
        _ => Err(Failure::input(format!(
            "{}: expected a session or a folder of sessions, found none\n  next: `skinrig run` records one; name another folder",
            given.display()
        ))),
    }
}

/// This program as the server's lab.
pub struct Program;

/// The message of a failure, without its first word.
fn lab_error(failure: Failure) -> LabError {
    let message = failure.message;
    let plain = message.strip_prefix("error: ").map(str::to_owned);
    LabError(plain.unwrap_or(message))
}

/// An analysis as the catalogue has it.
fn listed_entry(listed: &ListedAnalysis) -> AnalysisEntry {
    let rmse = estimate(listed);
    AnalysisEntry {
        name: listed.variant.clone(),
        rmse_mm: Some([rmse.value, rmse.low, rmse.high]),
        is_valid: listed.is_valid,
        changes: listed.changed.clone(),
        trouble: None,
    }
}

impl Lab for Program {
    fn run(&self, session: &Path) -> Option<RunState> {
        match ask(session, &Request::Status) {
            Ok(Reply::Live(live)) => Some(RunState {
                state: live.state.clone(),
                is_over: live.state == State::Finished.name(),
                lost_bytes: live.cameras.each_ref().map(|c| c.lost_bytes),
                report: serde_json::to_value(live).unwrap_or_default(),
            }),
            _ => None,
        }
    }

    fn newest(&self, session: &Path) -> Option<[NewestBytes; 2]> {
        let Ok(Reply::Newest([one, two])) = ask(session, &Request::Newest) else {
            return None;
        };
        let of = |found: NewestEvents| {
            Some(NewestBytes {
                bytes: found.bytes()?,
                unix_s: found.unix_s,
            })
        };
        Some([of(one)?, of(two)?])
    }

    fn request(&self, session: &Path, request: &str) -> Result<String, LabError> {
        let name = request.replace('_', "-");
        let what = RunRequest::from_str(&name, false).map_err(|_| {
            LabError(format!(
                "request: expected pause, pause_now, resume, stop, abort or halt, found `{}`",
                request.escape_debug()
            ))
        })?;
        let session = sessions::find_running(session).map_err(lab_error)?;
        let after = control::request(&session, what).map_err(lab_error)?;
        Ok(after.map_or_else(|| State::Finished.name().to_owned(), |live| live.state))
    }

    fn note(&self, session: &Path, by: &str, text: &str) -> Result<(), LabError> {
        let session = sessions::find_running(session).map_err(lab_error)?;
        control::add_note(&session, by, text)
            .map(|_| ())
            .map_err(lab_error)
    }

    fn analysis(&self, session: &Path, session_id: &str, name: Option<&str>) -> Option<Analysis> {
        if name.is_some_and(|name| analyses::parse(name).is_err()) {
            return None;
        }
        analyses::stored(session, session_id, name)
    }

    fn analyses(&self, session: &Path, session_id: &str) -> Vec<AnalysisEntry> {
        let all = analyses::all(session, session_id).into_iter();
        let entry = |found: analyses::AnalysisFile| match found.summary {
            Ok(summary) => AnalysisEntry {
                name: found.name,
                rmse_mm: Some([
                    summary.rmse_mm.value,
                    summary.rmse_mm.low,
                    summary.rmse_mm.high,
                ]),
                is_valid: summary.valid,
                changes: summary.variant.map_or_else(Vec::new, |v| v.changed),
                trouble: None,
            },
            Err(why) => AnalysisEntry {
                name: found.name,
                rmse_mm: None,
                is_valid: false,
                changes: Vec::new(),
                trouble: Some(why.to_string()),
            },
        };
        all.map(entry).collect()
    }

    fn shelf(&self, folder: &Path) -> Result<Vec<ShelfSession>, LabError> {
        let shelf = Shelf::read(folder).map_err(lab_error)?;
        let session = |summary: &SessionSummary| {
            let analyses = match &summary.state {
                SessionState::Readable { session_id, .. } => match shelf.analyses(&summary.path) {
                    Some(listed) => listed.into_iter().map(listed_entry).collect(),
                    None => self.analyses(&summary.path, session_id),
                },
                SessionState::Empty | SessionState::Broken { .. } => Vec::new(),
            };
            ShelfSession {
                summary: summary.clone(),
                analyses,
            }
        };
        Ok(shelf.sessions.iter().map(session).collect())
    }

    fn differences(
        &self,
        sides: [(&Path, Option<&str>); 2],
    ) -> Result<(Vec<SettingDifference>, usize), LabError> {
        let (found, of) = compare::fact_differences(sides).map_err(lab_error)?;
        let rows = found.into_iter().map(|d| {
            let mut values = d.values.into_iter();
            let mut value = || values.next().unwrap_or_default();
            SettingDifference {
                label: d.what,
                key: d.fact.unwrap_or_default(),
                values: SettingValues {
                    a: value(),
                    b: value(),
                },
                severity: d.severity.name(),
                reason: d.reason,
            }
        });
        Ok((rows.collect(), of))
    }

    fn prototypes(&self, folder: &Path) -> Result<Value, LabError> {
        prototypes::document(folder).map_err(lab_error)
    }

    fn nights(&self, folder: &Path) -> Result<Vec<Value>, LabError> {
        let path = folder.join("nights").join(HISTORY_FILE);
        if !path.is_file() {
            return Ok(Vec::new());
        }
        let history = history::load(&path, &Filter::default());
        let history = history.map_err(|e| LabError(e.to_string()))?;
        let nights = history.nights.iter().rev();
        nights
            .map(|n| serde_json::to_value(n).map_err(|e| LabError(e.to_string())))
            .collect()
    }

    fn free_bytes(&self, session: &Path) -> Option<u64> {
        let free = gates::free_bytes(paths::folder_of(session)).ok()?;
        Some(free as u64)
    }
}
