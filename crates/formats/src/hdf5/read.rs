//! Reads the events of one dvs dictionary, batch by batch.

use std::path::PathBuf;

use rust_hdf5::{DatatypeMessage, H5Dataset};
use skinrig_model::{CdEvent, Polarity};

use super::BATCH_ROWS;
use super::column::{IntColumn, type_name, unreadable};
use super::tree::{Container, DvsEntry, open_followed};
use crate::error::FormatsError;
use crate::stream::Geometry;

/// Largest share of events outside the sensor in a recording of this sensor. Cameras and converters
/// put a few events in 10^7 one pixel beyond the edge; in another sensor's recording, tens of percent are outside.
const MAX_OUTSIDE_SHARE: f64 = 0.01;
/// Largest accepted time: ten years, s. Larger values are not seconds.
const MAX_TS_S: f64 = 315_360_000.0;

/// Rows per read from the file: each call costs time, in a chunked file more with more
/// chunks.
const SLAB_ROWS: usize = 4 * BATCH_ROWS;
/// Rows per delivered batch: 16 kB, which stay in the first-level cache.
const DELIVERED_ROWS: usize = 1024;
/// `2^52`: the sum of this and a number from 0 to `2^52` has the number, rounded, in its lower 52 bits.
const ROUNDING: f64 = 4_503_599_627_370_496.0;

impl Container {
    /// Reads the events of the dictionary `choice`, or of the only one.
    ///
    /// # Errors
    /// As [`Self::choose`], and for a dataset whose type cannot represent events.
    pub fn events(
        &self,
        choice: Option<&str>,
        geometry: Geometry,
    ) -> Result<EventReader, FormatsError> {
        EventReader::new(self, self.choose(choice)?, geometry)
    }
}

/// Reads the events of one sensor. Every value is checked before it is delivered.
pub struct EventReader {
    path: PathBuf,
    ts: H5Dataset,
    ts_name: String,
    columns: [IntColumn; 3],
    geometry: Geometry,
    rows: usize,
    next_row: usize,
    slab_start: usize,
    slab_end: usize,
    outside: u64,
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
                found: type_name(&datatype),
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
            slab_start: 0,
            slab_end: 0,
            outside: 0,
            last_ts_s: 0.0,
            ts_s: Vec::new(),
            x: Vec::new(),
            y: Vec::new(),
            pol: Vec::new(),
            events: Vec::new(),
            path,
        })
    }

    /// The next events, in time order; an empty slice at the end. Times are rounded to the nearest µs, and to an
    /// even one from the middle between two. Events outside the sensor are delivered as they are and counted by
    /// [`Self::outside`]; a coordinate that does not fit 16 bits becomes `u16::MAX`.
    ///
    /// # Errors
    /// [`FormatsError::Row`] for a time that is NaN, infinite, negative or before its predecessor, and for a polarity
    /// that is not 0 or 1; for a pixel outside the sensor once more than 1 % of the rows read have one.
    /// [`FormatsError::Dataset`] for missing rows, for example in a truncated file. No event of the rows
    /// of that read is delivered.
    pub fn next_batch(&mut self) -> Result<&[CdEvent], FormatsError> {
        self.events.clear();
        if self.next_row == self.slab_end {
            self.read_slab()?;
        }
        let start = self.next_row - self.slab_start;
        let rows = start..(start + DELIVERED_ROWS).min(self.slab_end - self.slab_start);
        let pixels = self.x[rows.clone()].iter().zip(&self.y[rows.clone()]);
        let values = pixels
            .zip(&self.pol[rows.clone()])
            .zip(&self.ts_s[rows.clone()]);
        self.events
            .extend(values.map(|(((x, y), pol), ts)| CdEvent {
                // Checked: not negative, and below 2^52 µs.
                t_us: (ts * 1e6 + ROUNDING).to_bits() & ((1 << 52) - 1),
                x: *x,
                y: *y,
                polarity: Polarity::from_bit(*pol == 1),
            }));
        self.next_row += rows.len();
        Ok(&self.events)
    }

    /// Reads and checks the next rows.
    fn read_slab(&mut self) -> Result<(), FormatsError> {
        let start = self.next_row;
        let rows = SLAB_ROWS.min(self.rows - start);
        if rows == 0 {
            return Ok(());
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
        self.last_ts_s = self.ts_s[rows - 1];
        (self.slab_start, self.slab_end) = (start, start + rows);
        Ok(())
    }

    /// Events outside the sensor among the rows read so far.
    #[must_use]
    pub const fn outside(&self) -> u64 {
        self.outside
    }

    /// Total number of rows.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.rows as u64
    }

    /// Checks the rows from `start` on. All values are checked without branches; only if one is bad, the first bad
    /// row is searched.
    fn check(&mut self, start: usize) -> Result<(), FormatsError> {
        let Geometry { width, height } = self.geometry;
        let ts = &self.ts_s;
        let ordered = ts
            .iter()
            .zip(&ts[1..])
            .fold(1, |all, (a, b)| all & u64::from(a <= b));
        if ordered == 0 || !(ts[0] >= self.last_ts_s && ts[ts.len() - 1] <= MAX_TS_S) {
            let mut previous = self.last_ts_s;
            for (row, ts) in ts.iter().enumerate() {
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
        let pol = &self.columns[2];
        if self.pol.iter().fold(0, |bad, v| bad | u16::from(*v >= 2)) != 0
            && let Some(row) = self.pol.iter().position(|v| *v >= 2)
        {
            return Err(pol.bad_value(start, row, "0..=1".into(), &self.path));
        }
        let outside = |x: u16, y: u16| x >= width || y >= height;
        let pixels = || self.x.iter().zip(&self.y);
        let count: u64 = pixels().map(|(x, y)| u64::from(outside(*x, *y))).sum();
        self.outside += count;
        let read = (start + ts.len()) as f64;
        if count > 0
            && self.outside as f64 > MAX_OUTSIDE_SHARE * read
            && let Some(row) = pixels().position(|(x, y)| outside(*x, *y))
        {
            let (column, limit) = match self.x[row] >= width {
                true => (&self.columns[0], width),
                false => (&self.columns[1], height),
            };
            let expected = format!(
                "0..={} but for at most 1 % of the events ({} of {read} are outside {width} x {height} px)",
                limit - 1,
                self.outside
            );
            return Err(column.bad_value(start, row, expected, &self.path));
        }
        Ok(())
    }
}
