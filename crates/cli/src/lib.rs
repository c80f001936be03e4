//! The `skinrig` command line: arguments, wiring of the crates, terminal output, exit codes.
//!
//! The binary is a thin shell over [`main_with`]; whole-system tests use the same modules.
#[macro_use]
mod terminal;

mod analyses;
pub mod analysis_request;
mod analyze;
mod args;
mod beside_session;
mod catalogue;
mod challenge;
pub mod check;
mod compare;
mod completions;
mod conclusion;
mod control;
mod devices;
mod doctor;
pub mod exit;
mod export;
pub mod fault;
mod hil;
mod host;
mod import;
mod inspect;
mod jog;
mod lake;
pub mod library;
mod looks;
mod man;
mod new;
mod notify;
mod online;
mod paths;
mod phase;
mod progress;
mod prototypes;
mod provenance;
mod publish;
mod reanalyze;
mod recording;
mod remote;
pub mod results;
mod resume;
pub mod rig;
mod run;
mod salvage;
mod sample_size;
mod scene;
mod schema;
pub mod selection;
mod sense;
mod sessions;
mod shelf;
mod show;
mod signals;
mod signature;
pub mod sink;
mod status;
mod store;
mod subprocess;
mod supervise;
mod tag;
mod tradeoff;
mod twin;
mod verify;
mod version;
mod view;
mod watch;
mod whole_file;

use std::ffi::OsString;
use std::time::SystemTime;

use clap::Parser;

use crate::args::{Cli, Command};
use crate::exit::{Exit, Failure, Outcome};

/// Parses a command line (the first word is the program's name) without running it.
///
/// # Errors
/// Errors of clap, which include help and version.
pub fn parse(words: &[&str]) -> Result<(), clap::Error> {
    Cli::try_parse_from(words).map(|_| ())
}

/// Runs the program with these arguments (the first is its own name) and returns its exit status.
pub fn main_with(arguments: impl IntoIterator<Item = OsString>) -> Exit {
    signals::take_file_limits_as_errors();
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let cli = match args::parse(tag::expand_removals(arguments.clone())) {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version are not errors; clap prints them to standard output.
            let exit = if error.use_stderr() {
                Exit::Input
            } else {
                Exit::Ok
            };
            let _ = error.print();
            return exit;
        }
    };
    let dated = dates_are_possible(SystemTime::now());
    match dated.and_then(|()| dispatch(&cli, &arguments)) {
        Ok(_) if terminal::output_failed() => {
            errln!("error: cannot write to standard output: is the disk full?");
            Exit::Internal
        }
        Ok(exit) => exit,
        Err(failure) => {
            errln!("{}", failure.message);
            failure.exit
        }
    }
}

/// Rejects a clock before 1970: what is recorded, tagged or written has a date, which it cannot have then.
fn dates_are_possible(now: SystemTime) -> Result<(), Failure> {
    match now.duration_since(SystemTime::UNIX_EPOCH) {
        Ok(_) => Ok(()),
        Err(_) => Err(Failure::internal(
            "expected a date after 1970 from the clock of this computer, found an earlier one\n  next: set the clock, for example with \
             `timedatectl set-time`",
        )),
    }
}

fn dispatch(cli: &Cli, arguments: &[OsString]) -> Outcome {
    store::read_references();
    let json = cli.json;
    let output = terminal::Output {
        json,
        verbose: cli.verbose,
    };
    match &cli.command {
        Command::Init(a) => new::init(a, json),
        Command::New(a) => new::new(a, json),
        Command::Check(a) => check::check(a, json),
        Command::Plan(a) => check::plan(a, json),
        Command::Run(a) => run::run(a, &command_line(arguments), output),
        Command::Resume(a) => resume::resume(a, &command_line(arguments), output),
        Command::Status(a) => status::status(a, json),
        Command::Control(a) => control::control(a, json),
        Command::Note(a) => control::note(a, json),
        Command::Devices(a) => devices::devices(a, json),
        Command::Doctor(a) => doctor::doctor(a, json),
        Command::Jog(a) => jog::jog(a),
        Command::Hil(a) => hil::hil(a, &command_line(arguments), json),
        Command::Watch(a) => watch::watch(a, json),
        Command::View(a) => view::view(a, json),
        Command::Prototypes(a) => prototypes::prototypes(a, json),
        Command::Tag(a) => tag::tag(a, json),
        Command::Store(a) => store::store(a, json),
        Command::Catalogue(a) => catalogue::catalogue(a, json),
        Command::Sessions(a) => sessions::sessions(a, json),
        Command::Show(a) => show::show(a, json),
        Command::Analyze(a) => analyze::analyze(a, output),
        Command::Reanalyze(a) => reanalyze::reanalyze(a, output),
        Command::Report(a) => analyze::report(a, json),
        Command::Compare(a) => compare::compare(a, json),
        Command::Tradeoff(a) => tradeoff::tradeoff(a, output),
        Command::Twin(a) => twin::twin(a, &command_line(arguments), output),
        Command::Scene(a) => scene::scene(a, &command_line(arguments), output),
        Command::Online(a) => online::online(a, output),
        Command::Verify(a) => verify::verify(a, json),
        Command::Salvage(a) => salvage::salvage(a, json),
        Command::Import(a) => import::import(a, &command_line(arguments), output),
        Command::Select(a) => selection::select(a, json),
        Command::Publish(a) => publish::publish(a, json),
        Command::Reproduce(a) => publish::reproduce(a, json),
        Command::Lake(a) => lake::lake(a, json),
        Command::Export(a) => export::export(a, json),
        Command::Challenge(a) => challenge::challenge(a, json),
        Command::Inspect(a) => inspect::inspect(a, json),
        Command::Schema(a) => schema::schema(a),
        Command::Completions(a) => completions::completions(a),
        Command::Man(a) => man::man(a, json),
        Command::TakeLook(a) => looks::take_look(a),
        Command::LearnSkin(a) => sense::learn_skin(a),
        Command::AnalyzeRequest => reanalyze::analyze_request(),
        Command::SuperviseArm => supervise::supervise(),
        Command::HoldArm(a) => hil::hold::hold(a),
    }
}

/// The arguments as one line, for the session's header.
fn command_line(arguments: &[OsString]) -> String {
    let words: Vec<_> = arguments
        .iter()
        .skip(1)
        .map(|a| a.to_string_lossy())
        .collect();
    format!("skinrig {}", words.join(" "))
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_clock_before_1970_is_refused() {
        let epoch = SystemTime::UNIX_EPOCH;
        assert!(dates_are_possible(epoch).is_ok());
        let refused = dates_are_possible(epoch - Duration::from_nanos(1)).unwrap_err();
        assert_eq!(refused.exit, Exit::Internal);
        assert!(
            refused.message.contains("set the clock"),
            "{}",
            refused.message
        );
    }
}
