//! Registers a session that a command has just recorded, analysed or tagged. Best effort: the command never fails because of the
//! catalogue, and waits at most [`WAIT`], when the robot is at rest. Lists a folder from its catalogue.

use std::path::Path;
use std::time::Duration;

use skinrig_catalogue::{Access, Address, Catalogue, CatalogueError, ListedSession};

use crate::paths::folder_of;

/// Longest wait for another program that writes the catalogue, such as a second run that ends at the same moment.
const WAIT: Duration = Duration::from_millis(200);

/// Registers `session` in the embedded catalogue of its folder; says so if that fails. The session is then stale, until
/// `skinrig catalogue register` or the next command that changes it.
pub(crate) fn register(session: &Path) {
    if let Err(e) = try_register(session) {
        errln!(
            "note: {} is not in the catalogue as it is: {e}\n  next: `skinrig catalogue register {0}`",
            session.display()
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

/// The sessions of a folder from its embedded catalogue; `None` if only the files have the whole answer.
pub(crate) fn list(folder: &Path) -> Option<Vec<ListedSession>> {
    let address = Address::of_folder(folder);
    let mut catalogue = Catalogue::open(address, Access::Read, WAIT).ok()?;
    let listed = catalogue.list(folder).ok()?;
    // What was read does not depend on it.
    let _ = catalogue.close();
    listed
}
