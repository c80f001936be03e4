//! Exit codes of errors of the catalogue, and how long commands wait for it.

use std::time::Duration;

use skinrig_catalogue::CatalogueError;

use crate::exit::Failure;

/// How long a command waits for another program that writes the catalogue. A write takes milliseconds.
pub(crate) const WAIT: Duration = Duration::from_secs(30);

/// Bad input, unless the machine or the database failed.
pub(crate) fn failure(error: CatalogueError) -> Failure {
    match &error {
        CatalogueError::Io { source, .. } if source.kind() == std::io::ErrorKind::NotFound => {
            Failure::input(error)
        }
        CatalogueError::Io { .. } | CatalogueError::Sql { .. } | CatalogueError::Busy { .. } => {
            Failure::internal(error)
        }
        _ => Failure::input(error),
    }
}
