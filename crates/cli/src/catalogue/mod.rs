//! `skinrig catalogue`: registers sessions, says what is stale, and answers questions.

mod answer;
pub(crate) mod args;
pub(crate) mod automatic;
mod failure;

use std::path::{Path, PathBuf};

use skinrig_catalogue::{
    Access, Address, Catalogue, FolderStatus, NightRegistration, ROLES, Registration, Unreadable,
};
use skinrig_hil::history::{self, HISTORY_FILE};

use self::args::{
    CatalogueArgs, CatalogueCommand, FolderArgs, RegisterArgs, RolesArgs, StatusArgs,
};
pub(crate) use self::failure::{WAIT, failure};
use crate::exit::{Exit, Failure, Outcome};
use crate::paths::folder_of;

/// `skinrig catalogue`.
///
/// # Errors
/// [`Failure::input`] for a missing or unsuitable catalogue, folder or session, [`Failure::internal`] when the machine or the
/// database fails.
pub(crate) fn catalogue(args: &CatalogueArgs, json: bool) -> Outcome {
    match &args.command {
        CatalogueCommand::Rebuild(a) => rebuild(a, json),
        CatalogueCommand::Status(a) => status(a, json),
        CatalogueCommand::Register(a) => register(a, json),
        CatalogueCommand::Roles(a) => roles(a, json),
        CatalogueCommand::Query(a) => answer::query(a, json),
    }
}

fn rebuild(args: &FolderArgs, json: bool) -> Outcome {
    let address = args.catalogue.of_folder(&args.folder);
    let (catalogue, done) = Catalogue::rebuild(address, &args.folder, WAIT).map_err(failure)?;
    finish(catalogue, &done, args.nights.as_deref(), json)?;
    Ok(exit_of(&done))
}

/// Exit code after a whole folder: files that are no sessions are usual there, mistakes in the file of prototypes are not.
fn exit_of(done: &Registration) -> Exit {
    match &done.prototypes_problem {
        None => Exit::Ok,
        Some(problem) => {
            errln!("{problem}");
            Exit::Input
        }
    }
}

fn status(args: &StatusArgs, json: bool) -> Outcome {
    let address = args.catalogue.of_folder(&args.folder);
    let mut catalogue = Catalogue::open(address, Access::Read, WAIT).map_err(failure)?;
    let found = catalogue.status(&args.folder).map_err(failure)?;
    let place = catalogue.place().to_owned();
    catalogue.close().map_err(failure)?;
    if json {
        crate::terminal::print_json(&serde_json::json!({ "catalogue": place, "status": found }));
    } else {
        print_status(&place, &found, &args.folder);
    }
    Ok(Exit::Ok)
}

fn roles(args: &RolesArgs, json: bool) -> Outcome {
    let address = args.catalogue.of_folder(Path::new("sessions"));
    let mut catalogue = open(address)?;
    catalogue.create_roles().map_err(failure)?;
    let place = catalogue.place().to_owned();
    catalogue.close().map_err(failure)?;
    if json {
        let names = ROLES.map(|role| role.name);
        crate::terminal::print_json(&serde_json::json!({ "catalogue": place, "roles": names }));
        return Ok(Exit::Ok);
    }
    outln!("catalogue   {place}");
    for role in ROLES {
        outln!("{:<18}{}", role.name, role.may);
    }
    outln!(
        "next        `GRANT {} TO USER;` on the server",
        ROLES[0].name
    );
    Ok(Exit::Ok)
}

fn register(args: &RegisterArgs, json: bool) -> Outcome {
    if args.annotations {
        return register_annotations(args, json);
    }
    if let [folder] = &args.sessions[..]
        && folder.is_dir()
    {
        let mut catalogue = open(args.catalogue.of_folder(folder))?;
        let done = catalogue.refresh(folder, false).map_err(failure)?;
        finish(catalogue, &done, args.nights.as_deref(), json)?;
        return Ok(exit_of(&done));
    }
    let folder = one_folder(&args.sessions)?;
    let mut catalogue = open(args.catalogue.of_folder(&folder))?;
    let done = catalogue.register(&args.sessions).map_err(failure)?;
    finish(catalogue, &done, args.nights.as_deref(), json)?;
    match done.unreadable.is_empty() {
        true => Ok(Exit::Ok),
        false => Ok(Exit::Input),
    }
}

fn register_annotations(args: &RegisterArgs, json: bool) -> Outcome {
    if let Some(folder) = args.sessions.iter().find(|path| path.is_dir()) {
        return Err(Failure::input(format!(
            "{}: expected session files with --annotations, found a folder\n  next: name the sessions that were tagged",
            folder.display()
        )));
    }
    let folder = one_folder(&args.sessions)?;
    let mut catalogue = open(args.catalogue.of_folder(&folder))?;
    let done = catalogue
        .register_annotations(&args.sessions)
        .map_err(failure)?;
    finish(catalogue, &done, None, json)?;
    match done.unreadable.is_empty() {
        true => Ok(Exit::Ok),
        false => Ok(Exit::Input),
    }
}

fn open(address: Address) -> Result<Catalogue, Failure> {
    Catalogue::open(address, Access::Write, WAIT).map_err(failure)
}

/// The folder of the sessions.
fn one_folder(sessions: &[PathBuf]) -> Result<PathBuf, Failure> {
    let folders: Vec<&Path> = sessions.iter().map(|path| folder_of(path)).collect();
    let first = folders.first().copied().unwrap_or(Path::new("."));
    match folders.iter().find(|folder| **folder != first) {
        None => Ok(first.to_owned()),
        Some(other) => Err(Failure::input(format!(
            "expected sessions of one folder, found {} and {}\n  next: register them one folder after the other",
            first.display(),
            other.display()
        ))),
    }
}

/// Registers nights, closes the catalogue, and prints what was registered.
fn finish(
    mut catalogue: Catalogue,
    done: &Registration,
    nights: Option<&Path>,
    json: bool,
) -> Result<(), Failure> {
    let nights = nights.map(|folder| register_nights(&mut catalogue, folder));
    let nights = nights.transpose()?;
    let place = catalogue.place().to_owned();
    catalogue.close().map_err(failure)?;
    if json {
        crate::terminal::print_json(&serde_json::json!({
            "catalogue": place, "sessions": done, "nights": nights,
        }));
    } else {
        print_registration(&place, done, nights.as_ref());
    }
    Ok(())
}

/// Registers the nights in a folder, and the changes accepted in the history there.
fn register_nights(catalogue: &mut Catalogue, folder: &Path) -> Result<NightRegistration, Failure> {
    let mut done = catalogue.register_nights(folder).map_err(failure)?;
    let history = folder.join(HISTORY_FILE);
    if history.is_file() {
        match history::acceptances(&history) {
            Ok(all) => catalogue
                .replace_acceptances(folder, &all)
                .map_err(failure)?,
            Err(e) => done.unreadable.push(Unreadable {
                file: history.display().to_string(),
                reason: e.to_string(),
            }),
        }
    }
    Ok(done)
}

fn print_registration(place: &str, done: &Registration, nights: Option<&NightRegistration>) {
    outln!("catalogue   {place}");
    outln!(
        "sessions    {} read, {} unchanged, {} being recorded, {} not readable, {} gone",
        done.registered.len(),
        done.unchanged,
        done.under_way.len(),
        done.unreadable.len(),
        done.forgotten.len()
    );
    if let Some(prototypes) = done.prototypes.filter(|n| *n > 0) {
        outln!("prototypes  {prototypes}");
    }
    if let Some(nights) = nights {
        outln!(
            "nights      {} added, {} unchanged, {} not readable",
            nights.registered,
            nights.unchanged,
            nights.unreadable.len()
        );
    }
    let nights = nights.map(|n| n.unreadable.as_slice()).unwrap_or_default();
    print_unreadable(done.unreadable.iter().chain(nights));
}

fn print_status(place: &str, found: &FolderStatus, folder: &Path) {
    outln!("catalogue   {place}");
    outln!(
        "sessions    {}: {} current, {} stale, {} being recorded",
        found.files,
        found.current,
        found.stale.len(),
        found.under_way.len()
    );
    for stale in &found.stale {
        outln!("stale       {}: {}", stale.file, stale.why.words());
    }
    print_unreadable(&found.unreadable);
    if !found.stale.is_empty() {
        outln!(
            "next        `skinrig catalogue register {}` reads what is stale",
            folder.display()
        );
    }
}

fn print_unreadable<'a>(all: impl IntoIterator<Item = &'a Unreadable>) {
    for unreadable in all {
        outln!("unreadable  {}: {}", unreadable.file, unreadable.reason);
    }
}
