//! `skinrig man`.

use std::fs;
use std::path::PathBuf;

use clap::Command;

use crate::args::ManArgs;
use crate::exit::{Exit, Failure, Outcome};

/// Writes `skinrig.1` and a page for each command.
///
/// # Errors
/// [`Failure::input`] when the folder cannot be written.
pub(crate) fn man(args: &ManArgs, json: bool) -> Outcome {
    let failure = |e| {
        let folder = args.folder.display();
        Failure::input(format!(
            "{folder}: expected a writable folder: {e}\n  next: choose another folder"
        ))
    };
    fs::create_dir_all(&args.folder).map_err(failure)?;
    let pages = pages(crate::args::command()).map_err(Failure::internal)?;
    let mut files: Vec<PathBuf> = Vec::new();
    for (name, page) in pages {
        let file = args.folder.join(name);
        fs::write(&file, page).map_err(failure)?;
        files.push(file);
    }
    if json {
        crate::terminal::print_json(&serde_json::json!({ "files": files }));
    } else {
        outln!("{} pages in {}", files.len(), args.folder.display());
    }
    Ok(Exit::Ok)
}

/// File name and text of each page; hidden commands have none.
fn pages(mut command: Command) -> std::io::Result<Vec<(String, Vec<u8>)>> {
    command.build();
    let mut pages = Vec::new();
    let mut rest = vec![command];
    while let Some(command) = rest.pop() {
        let subcommands = command.get_subcommands();
        rest.extend(
            subcommands
                .filter(|c| !c.is_hide_set() && c.get_name() != "help")
                .cloned(),
        );
        let page = clap_mangen::Man::new(command);
        let mut text = Vec::new();
        page.render(&mut text)?;
        pages.push((page.get_filename(), text));
    }
    pages.sort();
    Ok(pages)
}
