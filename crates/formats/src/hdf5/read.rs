//! Reading the events of one dvs dictionary, batch by batch.

use std::path::PathBuf;

use rust_hdf5::{DatatypeMessage, H5Dataset};
use skinrig_model::{CdEvent, Polarity};

use super::BATCH_ROWS;
use super::column::{IntColumn, unreadable};
use super::tree::{Container, DvsEntry, open_followed};
use crate::error::FormatsError;
use crate::stream::Geometry;

/// The largest time that is accepted: ten years, s. Larger values are not seconds.
const MAX_TS_S: f64 = 315_360_000.0;

/// Reads the events of one sensor. Every value is checked before it is delivered.
pub struct EventReader {
    path: PathBuf,
    ts: H5Dataset,
    ts_name: String,
    columns: [IntColumn; 3],
    geometry: Geometry,
    rows: usize,
    next_row: usize,
    last_ts_s: f64,
    ts_s: Vec<f64>,
    x: Vec<u16>,
    y: Vec<u16>,
    pol: Vec<u16>,
    events: Vec<CdEvent>,
}

impl EventReader {
    pub(super) fn new(
        container: &Container,
        entry: &DvsEntry,
        geometry: Geometry,
    ) -> Result<Self, FormatsError> {
        let path = container.path.clone();
        let open = |name: &String| open_followed(&container.file, &path, name);
        let [ts_name, x, y, pol] = &entry.fields;
        let ts = open(ts_name)?;
        let datatype = ts.datatype().map_err(FormatsError::hdf5(&path))?;
        if !matches!(datatype, DatatypeMessage::FloatingPoint { size: 8, .. }) {
            return Err(FormatsError::Dataset {
                path,
                dataset: ts_name.clone(),
                expected: "64-bit floating point seconds".into(),
                found: format!("{datatype:?}"),
            });
        }
        let column = |name| IntColumn::new(open(name)?, name, &path);
        Ok(Self {
            columns: [column(x)?, column(y)?, column(pol)?],
            ts,
            ts_name: ts_name.clone(),
            geometry,
            rows: usize::try_from(entry.events).unwrap_or(usize::MAX),
            next_row: 0,
            last_ts_s: 0.0,
            ts_s: Vec::new(),
            x: Vec::new(),
            y: Vec::new(),
            pol: Vec::new(),
            events: Vec::new(),
            path,
        })
    }

    /// The next events, in time order; an empty slice at the end.
    ///
    /// # Errors
    /// [`FormatsError::Row`] for a time that is NaN, infinite, negative or before its predecessor, for a pixel
    /// outside the sensor and for a polarity that is not 0 or 1; [`FormatsError::Dataset`] for rows that the
    /// file does not have, as when it is truncated. No event of that batch is delivered.
    pub fn next_batch(&mut self) -> Result<&[CdEvent], FormatsError> {
        let start = self.next_row;
        let rows = BATCH_ROWS.min(self.rows - start);
        self.events.clear();
        if rows == 0 {
            return Ok(&self.events);
        }
        self.ts_s.resize(rows, 0.0);
        self.ts
            .read_slice_into(&mut self.ts_s, &[start], &[rows])
            .map_err(|e| unreadable(&self.path, &self.ts_name, start, rows, &e))?;
        let [x, y, pol] = &mut self.columns;
        for (column, out) in [(x, &mut self.x), (y, &mut self.y), (pol, &mut self.pol)] {
            out.resize(rows, 0);
            column.read(start, out, &self.path)?;
        }
        self.check(start)?;
        let pixels = self.x.iter().zip(&self.y).zip(&self.pol);
        self.events.extend(
            self.ts_s
                .iter()
                .zip(pixels)
                .map(|(ts, ((x, y), pol))| CdEvent {
                    // Not negative and below 2^53 µs, so adding a half and cutting off is rounding.
                    t_us: (ts * 1e6 + 0.5) as i64 as u64,
                    x: *x,
                    y: *y,
                    polarity: Polarity::from_bit(*pol == 1),
                }),
        );
        self.next_row += rows;
        self.last_ts_s = self.ts_s[rows - 1];
        Ok(&self.events)
    }

    /// Rows delivered so far.
    #[must_use]
    pub fn rows_read(&self) -> u64 {
        self.next_row as u64
    }

    /// Rows in all.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.rows as u64
    }

    /// Checks the batch that begins at row `start`. All values are looked at without branches; only a bad batch
    /// is searched for its first bad row.
    fn check(&self, start: usize) -> Result<(), FormatsError> {
        let Geometry { width, height } = self.geometry;
        let below =
            |values: &[u16], limit: u16| values.iter().fold(0_u16, |max, v| max.max(*v)) < limit;
        let ordered = self.ts_s[0] >= self.last_ts_s
            && self.ts_s[self.ts_s.len() - 1] <= MAX_TS_S
            && self
                .ts_s
                .windows(2)
                .fold(true, |all, pair| all & (pair[0] <= pair[1]));
        if !ordered {
            let mut previous = self.last_ts_s;
            for (row, ts) in self.ts_s.iter().enumerate() {
                if !(*ts >= previous && *ts <= MAX_TS_S) {
                    return Err(FormatsError::Row {
                        path: self.path.clone(),
                        dataset: self.ts_name.clone(),
                        row: (start + row) as u64,
                        expected: format!(
                            "seconds in ascending order, from {previous} to {MAX_TS_S}"
                        ),
                        found: ts.to_string(),
                    });
                }
                previous = *ts;
            }
        }
        let limits = [width, height, 2];
        for ((column, values), limit) in self
            .columns
            .iter()
            .zip([&self.x, &self.y, &self.pol])
            .zip(limits)
        {
            if !below(values, limit)
                && let Some(row) = values.iter().position(|v| *v >= limit)
            {
                let expected = format!("0..={}", limit - 1);
                return Err(column.bad_value(start, row, expected, &self.path));
            }
        }
        Ok(())
    }
}
