//! Registers a session that a command has just recorded, analysed or tagged. Best effort: the command never fails because of the
//! catalogue, and waits at most [`WAIT`], when the robot is at rest.

use std::path::Path;
use std::time::Duration;

use skinrig_catalogue::{Access, Address, Catalogue, CatalogueError};

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
