//! Tables of a data lake: presses are split into presses, estimates and features; every row names its session.

use crate::error::ExportError;
use crate::folder::Folder;
use crate::parquet_files::ParquetFiles;
use crate::table::{Column, Kind, Layout, TableWriter, Values};

/// The tables.
pub(crate) const TABLES: [&str; 5] = ["presses", "estimates", "features", "results", "poses"];
/// Columns that each part of a press has.
const KEYS: [&str; 2] = ["session_id", "press"];
/// A partition of the lake has this column.
const PARTITION: &str = "prototype";

/// Writes the tables of one session, each as one Parquet file.
pub(crate) struct LakeTables<'a> {
    to: ParquetFiles,
    session_id: &'a str,
    /// The table that is being written.
    open: Option<Layout>,
    /// The rows of a table that is split.
    rows: Vec<Values>,
}

/// Table of a column of presses.
fn part_of(column: &str) -> &'static str {
    const ESTIMATES: [&str; 4] = ["outcome", "ray_sine", "extrapolated", "rest_mm"];
    let begins = |all: &[&str]| all.iter().any(|start| column.starts_with(start));
    if begins(&["camera1_", "camera2_"]) {
        "features"
    } else if ESTIMATES.contains(&column) || begins(&["estimate_", "error_", "region_"]) {
        "estimates"
    } else {
        "presses"
    }
}

impl<'a> LakeTables<'a> {
    pub(crate) const fn new(folder: Folder, session_id: &'a str) -> Self {
        Self {
            to: ParquetFiles::new(folder),
            session_id,
            open: None,
            rows: Vec::new(),
        }
    }

    /// Writes the columns that `keep` selects as the table `name`.
    fn write_part(
        &mut self,
        layout: &Layout,
        name: &'static str,
        keep: impl Fn(&str) -> bool,
    ) -> Result<(), ExportError> {
        let both = layout.columns.iter().zip(&self.rows);
        let kept: Vec<(Column, Values)> = both
            .filter(|(column, _)| keep(&column.name))
            .map(|(column, values)| (column.clone(), values.clone()))
            .collect();
        let (columns, values): (Vec<Column>, Vec<Values>) = kept.into_iter().unzip();
        let rows = values.first().map_or(0, Values::rows);
        self.to.begin(&Layout { name, columns }, rows as u64)?;
        self.to.append(&values)?;
        self.to.end()
    }
}

impl TableWriter for LakeTables<'_> {
    fn begin(&mut self, layout: &Layout, rows: u64) -> Result<(), ExportError> {
        self.open = Some(layout.clone());
        if layout.name != "pose" {
            return Ok(());
        }
        let id = Column {
            name: KEYS[0].to_owned(),
            kind: Kind::Text(self.session_id.len()),
        };
        let columns = [id].into_iter().chain(layout.columns.iter().cloned());
        let layout = Layout {
            name: "poses",
            columns: columns.collect(),
        };
        self.to.begin(&layout, rows)
    }

    fn append(&mut self, batch: &[Values]) -> Result<(), ExportError> {
        if self
            .open
            .as_ref()
            .is_none_or(|layout| layout.name != "pose")
        {
            // Tables of presses and metrics come in one batch.
            self.rows = batch.to_vec();
            return Ok(());
        }
        let rows = batch.first().map_or(0, Values::rows);
        let id = Values::Text(vec![Some(self.session_id.to_owned()); rows]);
        let batch: Vec<Values> = [id].into_iter().chain(batch.iter().cloned()).collect();
        self.to.append(&batch)
    }

    fn end(&mut self) -> Result<(), ExportError> {
        let Some(layout) = self.open.take() else {
            return Ok(());
        };
        match layout.name {
            "pose" => self.to.end(),
            "presses" => {
                for part in ["presses", "estimates", "features"] {
                    let is_key = |name: &str| KEYS.contains(&name);
                    let keep =
                        |name: &str| name != PARTITION && (is_key(name) || part_of(name) == part);
                    self.write_part(&layout, part, keep)?;
                }
                Ok(())
            }
            name => self.write_part(&layout, name, |column| column != PARTITION),
        }
    }
}
