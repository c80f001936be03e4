//! Registers a session that a command has just recorded, analysed or tagged. Best effort: the command never fails because of the
//! catalogue, and waits at most [`WAIT`], when the robot is at rest.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::Duration;

use skinrig_catalogue::{Access, Address, Catalogue, CatalogueError};

use crate::paths::{file_name, folder_of};

/// Longest wait for another program that writes the catalogue, such as a second run that ends at the same moment.
pub(crate) const WAIT: Duration = Duration::from_millis(200);

/// Registers `session` in the embedded catalogue of its folder; prints a note if that fails. Its entry is then stale until
/// `skinrig catalogue register` or the next command that changes it.
pub(crate) fn register(session: &Path) {
    match try_register(session) {
        Ok(()) => {}
        Err(e @ CatalogueError::OtherName { .. }) => errln!("note: not in the catalogue: {e}"),
        Err(e) => errln!(
            "note: {} is not in the catalogue as it is: {e}\n  next: `skinrig catalogue register {0}`",
            session.display()
        ),
    }
}

/// Registers those of `sessions`, all in `folder`, whose entries are stale; prints a note if that fails. For commands without a robot: waits
/// for another program that writes the catalogue.
pub(crate) fn register_stale(folder: &Path, sessions: &[PathBuf]) {
    let attempt = || {
        let mut catalogue =
            Catalogue::open(Address::of_folder(folder), Access::Write, super::WAIT)?;
        let stale = catalogue.status(folder)?.stale;
        let stale: BTreeSet<String> = stale.into_iter().map(|stale| stale.file).collect();
        let is_stale = |path: &&PathBuf| path.is_file() && stale.contains(&file_name(path));
        let stale: Vec<PathBuf> = sessions.iter().filter(is_stale).cloned().collect();
        catalogue.register(&stale)?;
        catalogue.close()
    };
    if let Err(e) = attempt() {
        errln!(
            "note: the new results are not in the catalogue: {e}\n  next: `skinrig catalogue register {}`",
            folder.display()
        );
    }
}

fn try_register(session: &Path) -> Result<(), CatalogueError> {
    let address = Address::of_folder(folder_of(session));
    let mut catalogue = Catalogue::open(address, Access::Write, WAIT)?;
    // A session that cannot be read is an entry, too.
    catalogue.register(&[session.to_owned()])?;
    catalogue.close()
}
