//! Writes events as a bimvee container, in the layout of hickle 5.

use std::path::{Path, PathBuf};

use rust_hdf5::format::messages::datatype::EnumMember;
use rust_hdf5::{DatatypeMessage, H5Dataset, H5File};
use skinrig_model::{CdEvent, Polarity};

use super::BATCH_ROWS;
use crate::error::FormatsError;

/// The hickle version whose layout is used.
const HICKLE_VERSION: &str = "5.0.3";
/// Rows per chunk of a column.
const CHUNK_ROWS: usize = BATCH_ROWS;
const TYPES: &str = "hickle_types_table";

/// Writes the events of one sensor as a flat dvs dictionary: `ts` (f64 seconds), `x` and `y` (u16), `pol`
/// (h5py's boolean) and `tsOffset` (f64 seconds). Columns grow in chunks, so that the number of events need not be known
/// and memory stays bounded.
pub struct EventWriter {
    path: PathBuf,
    file: H5File,
    columns: Columns,
    origin_us: u64,
    last_us: u64,
    rows: u64,
    ts: Vec<f64>,
    x: Vec<u16>,
    y: Vec<u16>,
    pol: Vec<i8>,
}

struct Columns {
    ts: H5Dataset,
    x: H5Dataset,
    y: H5Dataset,
    pol: H5Dataset,
}

impl EventWriter {
    /// Creates `path`. Times are written relative to `origin_us`, and `tsOffset` states that: bimvee's
    /// `camera time = ts - tsOffset` holds for camera times in µs.
    ///
    /// # Errors
    /// If the file exists or cannot be created.
    pub fn create(path: &Path, origin_us: u64) -> Result<Self, FormatsError> {
        std::fs::File::create_new(path).map_err(FormatsError::io(path))?;
        let hdf5 = |e| FormatsError::hdf5(path)(e);
        let file = H5File::create(path).map_err(hdf5)?;
        let columns = layout(&file, -(origin_us as f64 / 1e6)).map_err(hdf5)?;
        Ok(Self {
            path: path.into(),
            file,
            columns,
            origin_us,
            last_us: origin_us,
            rows: 0,
            ts: Vec::new(),
            x: Vec::new(),
            y: Vec::new(),
            pol: Vec::new(),
        })
    }

    /// Appends events, in time order.
    ///
    /// # Errors
    /// [`FormatsError::OutOfOrder`] for an event before its predecessor or before the origin; none of the
    /// events is written then. [`FormatsError::Hdf5`] if the file cannot be written.
    pub fn append(&mut self, events: &[CdEvent]) -> Result<(), FormatsError> {
        let mut written_us = self.last_us;
        for event in events {
            if event.t_us < written_us {
                return Err(FormatsError::OutOfOrder {
                    found_us: event.t_us,
                    written_us,
                });
            }
            written_us = event.t_us;
        }
        for batch in events.chunks(BATCH_ROWS) {
            self.ts.clear();
            self.x.clear();
            self.y.clear();
            self.pol.clear();
            let origin_us = self.origin_us;
            self.ts
                .extend(batch.iter().map(|e| (e.t_us - origin_us) as f64 / 1e6));
            self.x.extend(batch.iter().map(|e| e.x));
            self.y.extend(batch.iter().map(|e| e.y));
            self.pol
                .extend(batch.iter().map(|e| i8::from(e.polarity == Polarity::On)));
            let columns = &self.columns;
            (columns.ts.append(&self.ts))
                .and_then(|()| columns.x.append(&self.x))
                .and_then(|()| columns.y.append(&self.y))
                .and_then(|()| columns.pol.append(&self.pol))
                .map_err(FormatsError::hdf5(&self.path))?;
            self.rows += batch.len() as u64;
        }
        self.last_us = written_us;
        Ok(())
    }

    /// Completes the file and returns the number of events in it. Without this call the file is not readable.
    ///
    /// # Errors
    /// [`FormatsError::Hdf5`] if the file cannot be written.
    pub fn finish(self) -> Result<u64, FormatsError> {
        drop(self.columns);
        self.file.close().map_err(FormatsError::hdf5(&self.path))?;
        Ok(self.rows)
    }
}

/// Creates the tree: types table, group, and the empty columns.
fn layout(file: &H5File, ts_offset_s: f64) -> Result<Columns, rust_hdf5::Hdf5Error> {
    file.set_attr_string("HICKLE_VERSION", HICKLE_VERSION)?;
    file.set_attr_string("HICKLE_PYTHON_VERSION", "3")?;
    let types = file.create_group(TYPES)?;
    // Each type: a Python class as a pickle (protocol 4, one global), which refers to the name of its kind.
    let char_type = || DatatypeMessage::FixedString {
        size: 1,
        padding: 1,
        charset: 0,
    };
    for (number, kind, module, class) in [
        ("0", "dict", "builtins", "dict"),
        ("2", "ndarray", "numpy", "ndarray"),
        ("4", "np_scalar", "numpy", "float64"),
    ] {
        let pickle = pickled_class(module, class);
        let named = types.new_dataset::<u8>().datatype(char_type()).null();
        named.create(kind)?;
        let stored = types
            .new_dataset::<u8>()
            .datatype(char_type())
            .shape([1, pickle.len()])
            .create(number)?;
        stored.write_raw(&pickle)?;
        refer(&stored, "base_type", kind)?;
    }
    let data = file.create_group("data")?;
    data.set_attr_object_reference("type", &format!("/{TYPES}/0"))?;
    fn column<T: rust_hdf5::types::H5Type>(
        data: &rust_hdf5::H5Group,
        (index, key, np_dtype): (i64, &str, &str),
        datatype: DatatypeMessage,
    ) -> Result<H5Dataset, rust_hdf5::Hdf5Error> {
        let dataset = data
            .new_dataset::<T>()
            .datatype(datatype)
            .shape([0])
            .chunk(&[CHUNK_ROWS])
            .max_shape(&[None])
            .create(&format!("\"{key}\""))?;
        describe(&dataset, index, "2", np_dtype)?;
        Ok(dataset)
    }
    let boolean = DatatypeMessage::Enum {
        base: Box::new(DatatypeMessage::i8_type()),
        members: [("FALSE", 0), ("TRUE", 1)]
            .map(|(name, value)| EnumMember {
                name: name.into(),
                value: vec![value],
            })
            .into(),
    };
    let columns = Columns {
        ts: column::<f64>(&data, (0, "ts", "<f8"), DatatypeMessage::f64_type())?,
        x: column::<u16>(&data, (1, "x", "<u2"), DatatypeMessage::u16_type())?,
        y: column::<u16>(&data, (2, "y", "<u2"), DatatypeMessage::u16_type())?,
        pol: column::<i8>(&data, (3, "pol", "|b1"), boolean)?,
    };
    let offset = data.new_dataset::<f64>().scalar().create("\"tsOffset\"")?;
    offset.write_raw(&[ts_offset_s])?;
    describe(&offset, 4, "4", "<f8")?;
    Ok(columns)
}

/// The attributes by which hickle converts a dataset back into a dictionary's value.
fn describe(
    dataset: &H5Dataset,
    index: i64,
    type_number: &str,
    np_dtype: &str,
) -> Result<(), rust_hdf5::Hdf5Error> {
    refer(dataset, "type", type_number)?;
    dataset
        .new_attr::<rust_hdf5::types::VarLenUnicode>()
        .create("key_base_type")?
        .write_string("str")?;
    dataset
        .new_attr::<i64>()
        .create("key_idx")?
        .write_numeric(&index)?;
    dataset
        .new_attr::<rust_hdf5::types::VarLenUnicode>()
        .create("np_dtype")?
        .write_string(np_dtype)
}

/// Sets an attribute that refers to an entry of the types table.
fn refer(dataset: &H5Dataset, attribute: &str, entry: &str) -> Result<(), rust_hdf5::Hdf5Error> {
    dataset
        .new_attr::<u64>()
        .shape(())
        .create(attribute)?
        .write_object_references(&[&format!("/{TYPES}/{entry}")])
}

/// A Python class as pickle protocol 4 stores it: PROTO, FRAME, two memoized strings, STACK_GLOBAL, STOP.
fn pickled_class(module: &str, class: &str) -> Vec<u8> {
    let mut body = Vec::new();
    for text in [module, class] {
        body.extend([0x8c, text.len() as u8]);
        body.extend(text.bytes());
        body.push(0x94);
    }
    body.extend([0x93, 0x94, b'.']);
    let mut pickle = vec![0x80, 4, 0x95];
    pickle.extend((body.len() as u64).to_le_bytes());
    pickle.extend(body);
    pickle
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_are_pickled_as_python_does() {
        let known: &[u8] =
            b"\x80\x04\x95\x15\0\0\0\0\0\0\0\x8c\x08builtins\x94\x8c\x04dict\x94\x93\x94.";
        assert_eq!(pickled_class("builtins", "dict"), known);
    }
}
