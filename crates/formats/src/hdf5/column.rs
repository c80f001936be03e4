//! A column of whole numbers in a dvs dictionary, of any type and width.

use std::path::Path;

use rust_hdf5::{DatatypeMessage, H5Dataset, Hdf5Error};

use crate::error::FormatsError;

/// A column of pixels or polarities, read slice by slice into a reused buffer.
pub(super) struct IntColumn {
    dataset: H5Dataset,
    pub name: String,
    buffer: Buffer,
}

macro_rules! buffers {
    ($($variant:ident $int:ty, $size:literal $signed:literal;)*) => {
        enum Buffer { $($variant(Vec<$int>),)* F32(Vec<f32>), F64(Vec<f64>) }

        impl Buffer {
            fn of_type(size: u32, signed: bool) -> Option<Self> {
                match (size, signed) {
                    $(($size, $signed) => Some(Self::$variant(Vec::new())),)*
                    _ => None,
                }
            }

            /// Reads `rows` values from `start` on and stores them in `out`. Values that do not fit become
            /// `u16::MAX`, which is never valid. Returns the first row whose value is not a whole number.
            fn read(
                &mut self,
                dataset: &H5Dataset,
                start: usize,
                out: &mut [u16],
            ) -> Result<Option<usize>, Hdf5Error> {
                match self {
                    $(Self::$variant(values) => {
                        values.resize(out.len(), 0);
                        dataset.read_slice_into(values, &[start], &[out.len()])?;
                        let mut beyond = 0;
                        for (out, value) in out.iter_mut().zip(&*values) {
                            *out = *value as u16;
                            // 0 for every value that fits u16; the sign extends.
                            beyond |= *value as u64 >> 16;
                        }
                        if beyond != 0 {
                            for (out, value) in out.iter_mut().zip(&*values) {
                                if *value as u64 >> 16 != 0 {
                                    *out = u16::MAX;
                                }
                            }
                        }
                    })*
                    Self::F32(values) => {
                        values.resize(out.len(), 0.0);
                        dataset.read_slice_into(values, &[start], &[out.len()])?;
                        return Ok(store_whole(values.iter().map(|v| f64::from(*v)), out));
                    }
                    Self::F64(values) => {
                        values.resize(out.len(), 0.0);
                        dataset.read_slice_into(values, &[start], &[out.len()])?;
                        return Ok(store_whole(values.iter().copied(), out));
                    }
                }
                Ok(None)
            }

            /// The value at `row` of the last slice, for messages.
            fn value(&self, row: usize) -> Option<String> {
                match self {
                    $(Self::$variant(values) => values.get(row).map(ToString::to_string),)*
                    Self::F32(values) => values.get(row).map(ToString::to_string),
                    Self::F64(values) => values.get(row).map(ToString::to_string),
                }
            }
        }
    };
}

/// Stores floating-point values as whole numbers; returns the first row whose value is not one.
fn store_whole(values: impl Iterator<Item = f64>, out: &mut [u16]) -> Option<usize> {
    let mut broken = None;
    for (row, (value, out)) in values.zip(out).enumerate() {
        if value.is_nan() || value.fract() != 0.0 {
            broken = broken.or(Some(row));
        }
        // Saturates; negative numbers are invalid pixels too.
        *out = if value < 0.0 { u16::MAX } else { value as u16 };
    }
    broken
}

/// Description of a datatype, for messages.
pub(super) fn type_name(datatype: &DatatypeMessage) -> String {
    match datatype {
        DatatypeMessage::FixedPoint { size, signed, .. } => {
            let sign = if *signed { "signed" } else { "unsigned" };
            format!("{sign} integers of {} bits", 8 * size)
        }
        DatatypeMessage::FloatingPoint { size, .. } => {
            format!("floating-point numbers of {} bits", 8 * size)
        }
        DatatypeMessage::FixedString { .. } | DatatypeMessage::VarLenString { .. } => {
            "text".to_owned()
        }
        DatatypeMessage::Compound { .. } => "compound values".to_owned(),
        DatatypeMessage::Enum { base, .. } => format!("an enumeration of {}", type_name(base)),
        DatatypeMessage::Opaque { size, .. } => format!("opaque values of {size} bytes"),
        _ => "values that are not numbers".to_owned(),
    }
}

buffers! {
    I8 i8, 1 true;
    U8 u8, 1 false;
    I16 i16, 2 true;
    U16 u16, 2 false;
    I32 i32, 4 true;
    U32 u32, 4 false;
    I64 i64, 8 true;
    U64 u64, 8 false;
}

impl IntColumn {
    /// Accepts an open dataset of integers, of an enumeration (h5py's booleans), or of floating-point numbers, which must
    /// be whole.
    pub(super) fn new(dataset: H5Dataset, name: &str, path: &Path) -> Result<Self, FormatsError> {
        let wrong = |found: String| FormatsError::Dataset {
            path: path.into(),
            dataset: name.into(),
            expected: "whole numbers or booleans".into(),
            found,
        };
        let datatype = dataset.datatype().map_err(|e| wrong(e.to_string()))?;
        let integer = match &datatype {
            DatatypeMessage::Enum { base, .. } => base,
            other => other,
        };
        let buffer = match integer {
            DatatypeMessage::FixedPoint { size, signed, .. } => Buffer::of_type(*size, *signed),
            DatatypeMessage::FloatingPoint { size: 4, .. } => Some(Buffer::F32(Vec::new())),
            DatatypeMessage::FloatingPoint { size: 8, .. } => Some(Buffer::F64(Vec::new())),
            _ => None,
        };
        Ok(Self {
            buffer: buffer.ok_or_else(|| wrong(type_name(&datatype)))?,
            dataset,
            name: name.into(),
        })
    }

    /// Reads the values from row `start` on into `out`.
    pub(super) fn read(
        &mut self,
        start: usize,
        out: &mut [u16],
        path: &Path,
    ) -> Result<(), FormatsError> {
        let broken = self.buffer.read(&self.dataset, start, out);
        match broken.map_err(|error| unreadable(path, &self.name, start, out.len(), &error))? {
            None => Ok(()),
            Some(row) => Err(self.bad_value(start, row, "a whole number".into(), path)),
        }
    }

    /// The error for the value at `row` of the last slice, which began at `start`.
    pub(crate) fn bad_value(
        &self,
        start: usize,
        row: usize,
        expected: String,
        path: &Path,
    ) -> FormatsError {
        FormatsError::Row {
            path: path.into(),
            dataset: self.name.clone(),
            row: (start + row) as u64,
            expected,
            found: self.buffer.value(row).unwrap_or_default(),
        }
    }
}

/// The error for rows that the library cannot read, as in a truncated file.
pub(super) fn unreadable(
    path: &Path,
    dataset: &str,
    start: usize,
    rows: usize,
    error: &Hdf5Error,
) -> FormatsError {
    FormatsError::Dataset {
        path: path.into(),
        dataset: dataset.into(),
        expected: format!("readable rows {start}..{}", start + rows),
        found: error.to_string(),
    }
}
