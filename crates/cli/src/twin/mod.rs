//! `skinrig twin`: the simulated skin that resembles that of a session.

#[cfg(test)]
mod calibration;
mod skins;

use std::path::{Path, PathBuf};

use skinrig_compare::flatten;
use skinrig_compare::twin::{SkinDraw, twin as fitted};
use skinrig_model::{AnalysisSettings, SimLevel};
use skinrig_protocol::protocol_with;
use skinrig_report::twin::{SessionTwin, page, terminal_text};

use crate::analyses::twin_path;
use crate::analysis_request::AnalysisRequest;
use crate::args::TwinArgs;
use crate::beside_session::{SessionIdentity, TWIN};
use crate::exit::{Exit, Failure, Outcome};
use crate::library::{NO_FILE, ProtocolSource};
use crate::paths::{file_name, shell_path};
use crate::phase::Phase;
use crate::provenance::origin_in_words;
use crate::results::{check_writable, open, write, write_named};
use crate::scene::replicates::{Replicates, Simulated, Source, each, ran_through, seeds};
use crate::terminal::Output;

use self::skins::{OPTICAL, draw, observed};

/// Simulates skins, fits the twin, and writes its page, results and protocol.
///
/// # Errors
/// [`Failure::input`] for a session or protocol that cannot be used; [`Failure::limit`] for an INVALID session.
pub(crate) fn twin(args: &TwinArgs, command_line: &str, output: Output) -> Outcome {
    let path = &args.session;
    let html_path = args.out.clone().unwrap_or_else(|| twin_path(path));
    check_writable(&html_path)?;
    let (aligned, _) = open(path, AnalysisRequest::default())?;
    ran_through(&aligned.session.reader, path)?;
    let identity = SessionIdentity::of(&aligned.session.reader).map_err(Failure::session)?;
    let header = aligned.session.header.clone();
    let settings = aligned.input.settings.clone();
    let phase = Phase::reading("analysing the session", aligned.events.bytes_read());
    let session = observed(aligned, path, || {
        format!(
            "{}: expected a valid session, found an INVALID one\n  next: `skinrig analyze {on}` says why",
            path.display(),
            on = shell_path(path)
        )
    })?;
    drop(phase);
    if session.figures.presses == 0 {
        return Err(Failure::input(format!(
            "{}: expected calibration presses, to which a twin is fitted, found none\n  next: record a session whose protocol has \
             `evaluation.calibrate`",
            path.display()
        )));
    }
    let source = Source {
        header: &header,
        session: path,
        protocol: args.protocol.as_deref(),
        folder: args.sessions.as_deref(),
        command_line,
    };
    let own = Replicates::of(&source, &[], Some(SimLevel::Optical.to_string()))?;
    let optical = OPTICAL.to_owned();
    same_settings(
        path,
        &settings,
        &own.protocol_with(std::slice::from_ref(&optical))?.analysis,
    )?;
    own.protocol_with(&[&[optical], &args.overrides[..]].concat())?;
    let seeds = seeds(args.seed, args.skins, header.seed)?;
    let skins = each(&seeds, "simulating skins", |seed| {
        draw(&own, &args.overrides, seed)
    })?;
    let draws: Vec<SkinDraw> = skins.found.iter().map(|(_, skin)| skin.clone()).collect();
    let found = match fitted(&session, &draws) {
        Ok(found) => found,
        Err(why) if skins.interrupted => {
            let n = skins.tried();
            return Err(Failure::stopped(format!(
                "stopped after {n} of {} simulated skins: {why}",
                args.skins
            )));
        }
        Err(why) => {
            return Err(Failure::input(format!(
                "{}: {why}{}",
                path.display(),
                failed(&skins)
            )));
        }
    };
    let is_like = found.is_like();
    let document = SessionTwin {
        session: file_name(path),
        origin: origin_in_words(&header),
        protocol: args
            .protocol
            .as_ref()
            .map(|file| file.display().to_string()),
        changed: args.overrides.clone(),
        seeds: skins.seeds(),
        failed: skins.failed.clone(),
        twin: found,
    };
    let files = write_all(&document, &identity, &own, &html_path, args)?;
    if output.json {
        let mut json = serde_json::json!({ "twin": document });
        json["files"] = serde_json::json!({
            "page": files.page, "results": files.results, "protocol": files.protocol,
        });
        crate::terminal::print_json(&json);
    } else {
        outln!("{}\n", terminal_text(&document, output.verbose));
        outln!(
            "page      {}\nresults   {}",
            files.page.display(),
            files.results.display()
        );
        if let Some(protocol) = &files.protocol {
            outln!("protocol  {}", protocol.display());
        }
    }
    if skins.interrupted {
        errln!(
            "INTERRUPTED after {} of {} simulated skins",
            skins.tried(),
            args.skins
        );
        return Ok(Exit::Stopped);
    }
    Ok(if is_like { Exit::Ok } else { Exit::Limit })
}

/// Rejects skins that would be analysed otherwise than the session: their figures mean something else.
fn same_settings(
    path: &Path,
    session: &AnalysisSettings,
    skins: &AnalysisSettings,
) -> Result<(), Failure> {
    let leaves = |settings: &AnalysisSettings| -> Result<Vec<(String, String)>, Failure> {
        let mut found = Vec::new();
        let value = serde_json::to_value(settings).map_err(Failure::internal)?;
        flatten("analysis", &value, &mut found);
        Ok(found)
    };
    let (session, skins) = (leaves(session)?, leaves(skins)?);
    let others = session.iter().filter(|leaf| !skins.contains(leaf));
    let others: Vec<&str> = others.map(|(key, _)| key.as_str()).collect();
    if others.is_empty() {
        return Ok(());
    }
    Err(Failure::input(format!(
        "{}: expected a protocol that analyses as the session was analysed, found other settings: {}\n  next: give a copy of the \
         protocol the session's `analysis` settings, which its report lists",
        path.display(),
        others.join(", ")
    )))
}

/// What the skins without results say, after a sentence.
fn failed(skins: &Simulated<SkinDraw>) -> String {
    match skins.failed.first() {
        Some((seed, why)) => format!(
            "; {} failed, the first with seed {seed}: {why}\n  next: a larger --skins; some of the skins drawn always fail",
            skins.failed.len()
        ),
        None => "\n  next: a larger --skins".to_owned(),
    }
}

struct Files {
    page: PathBuf,
    results: PathBuf,
    /// `None` if the session has no twin.
    protocol: Option<PathBuf>,
}

fn write_all(
    document: &SessionTwin,
    identity: &SessionIdentity,
    own: &Replicates<'_>,
    page_path: &Path,
    args: &TwinArgs,
) -> Result<Files, Failure> {
    let results = serde_json::json!({
        "format": TWIN.format, "format_version": TWIN.version, "session": identity, "twin": document,
    });
    let text = serde_json::to_string_pretty(&results).map_err(Failure::internal)?;
    let text = skinrig_catalogue::results_digest::with_digest(&text);
    let is_named = args.out.is_some();
    let write = if is_named { write_named } else { write };
    let files = Files {
        page: page_path.to_owned(),
        results: page_path.with_extension("json"),
        protocol: document
            .twin
            .is_like()
            .then(|| page_path.with_extension("yaml")),
    };
    if let Some(path) = &files.protocol {
        write(path, protocol(own, document)?.as_bytes())?;
    }
    write(&files.page, page(document).as_bytes())?;
    write(&files.results, text.as_bytes())?;
    Ok(files)
}

/// The twin as a protocol.
fn protocol(own: &Replicates<'_>, document: &SessionTwin) -> Result<String, Failure> {
    let (name, text) = match &own.protocol {
        ProtocolSource::File(path) => {
            let bytes = skinrig_formats::regular::read_text(path).map_err(|e| {
                Failure::input(format!("{}: cannot read the protocol: {e}", path.display()))
            })?;
            let text = String::from_utf8(bytes).map_err(Failure::internal)?;
            (path.display().to_string(), text)
        }
        ProtocolSource::Text(text) => (NO_FILE.to_owned(), text.clone()),
    };
    let mut overrides = own.overrides.clone();
    overrides.extend(document.twin.settings());
    overrides.push(OPTICAL.to_owned());
    let of = document.session.trim_end_matches(".session.sqlite");
    overrides.push(format!("scene.twin_of={of}"));
    let text =
        protocol_with(&name, &text, &overrides).map_err(|found| Failure::findings(&found))?;
    Ok(format!(
        "# yaml-language-server: $schema=./skinrig.schema.json\n#\n# The twin of {}: simulated skin, median of each constant over {} \
         simulated skins.\n# Written by `skinrig twin`; intervals are on its page.\n{text}",
        document.session, document.twin.skins
    ))
}
