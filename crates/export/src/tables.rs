//! Writes the tables of a session.

use crate::error::ExportError;
use crate::source::{Source, TableName};
use crate::table::TableWriter;
use crate::{metrics, presses, streams};

impl Source<'_> {
    /// Writes one table.
    ///
    /// # Errors
    /// When the session cannot be read, or the table cannot be written.
    pub fn write(&self, table: TableName, to: &mut dyn TableWriter) -> Result<(), ExportError> {
        match table {
            TableName::Presses => presses::table(self)?.write(to),
            TableName::Results => metrics::table(self)?.write(to),
            TableName::Pose => streams::pose(self, to),
            TableName::Events(camera) => streams::events(self, camera, table.name(), to),
        }
    }
}
