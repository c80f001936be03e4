//! Owns tables in memory, and their way into Python: numpy arrays, lists of text, pandas DataFrames.

use pyo3::prelude::*;
use pyo3::types::{PyByteArray, PyDict, PyList};
use skinrig_export::table::{Layout, TableWriter, Values};
use skinrig_export::{ExportError, Source, TableName};
use skinrig_model::SentMark;

/// Named columns.
#[derive(Default)]
pub(crate) struct Columns(Vec<(String, Values)>);

impl Columns {
    /// A table of an export.
    pub(crate) fn of(source: &Source<'_>, table: TableName) -> Result<Self, ExportError> {
        let mut columns = Self::default();
        source.write(table, &mut columns)?;
        Ok(columns)
    }

    /// The marks that the trigger box sent.
    pub(crate) fn of_marks(marks: &[SentMark]) -> Self {
        let int = |of: fn(&SentMark) -> i64| Values::Int(marks.iter().map(of).collect());
        let kind = |m: &SentMark| Some(m.mark.kind.name().to_owned());
        Self(vec![
            (
                "kind".to_owned(),
                Values::Text(marks.iter().map(kind).collect()),
            ),
            (
                "press".to_owned(),
                int(|m| i64::from(m.mark.press.number())),
            ),
            ("t_ns".to_owned(), int(|m| m.t.0)),
            ("uncertainty_ns".to_owned(), int(|m| m.uncertainty_ns)),
        ])
    }

    /// A number of the row of press `number`; `None` if it is missing there.
    pub(crate) fn real_of_press(&self, column: &str, number: u32) -> Option<f64> {
        let values = |name: &str| self.0.iter().find(|(n, _)| n == name).map(|(_, v)| v);
        let (Values::Int(presses), Values::Real(found)) = (values("press")?, values(column)?)
        else {
            return None;
        };
        let row = presses.iter().position(|p| *p == i64::from(number))?;
        found.get(row).copied().filter(|value| value.is_finite())
    }

    /// Numpy arrays by name; text as lists, with `None` where it is missing.
    pub(crate) fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for (name, values) in &self.0 {
            dict.set_item(name, column(py, values)?)?;
        }
        Ok(dict)
    }

    /// A pandas DataFrame.
    pub(crate) fn to_pandas<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let pandas = py.import("pandas")?;
        let dict = self.to_dict(py)?;
        for (name, values) in &self.0 {
            if let Values::Text(texts) = values
                && texts.iter().all(Option::is_none)
            {
                // A text behind the column, cut off again, makes it a column of text.
                let texts = texts.iter().map(Option::as_deref).chain([Some("")]);
                let texts: Vec<Option<&str>> = texts.collect();
                let series = pandas.call_method1("Series", (texts,))?;
                dict.set_item(name, series.call_method1("head", (-1,))?)?;
            }
        }
        pandas.call_method1("DataFrame", (dict,))
    }
}

impl TableWriter for Columns {
    fn begin(&mut self, layout: &Layout, _: u64) -> Result<(), ExportError> {
        let empty = layout.columns.iter();
        self.0 = empty
            .map(|column| (column.name.clone(), Values::Real(Vec::new())))
            .collect();
        Ok(())
    }

    fn append(&mut self, batch: &[Values]) -> Result<(), ExportError> {
        for ((_, values), more) in self.0.iter_mut().zip(batch) {
            match (values, more) {
                (Values::Int(all), Values::Int(more)) => all.extend(more),
                (Values::Pixel(all), Values::Pixel(more)) => all.extend(more),
                (Values::Flag(all), Values::Flag(more)) => all.extend(more),
                (Values::Count(all), Values::Count(more)) => all.extend(more),
                (Values::Real(all), Values::Real(more)) => all.extend(more),
                (Values::Text(all), Values::Text(more)) => all.extend_from_slice(more),
                // The first batch: every column is still empty.
                (values, more) => *values = more.clone(),
            }
        }
        Ok(())
    }

    fn end(&mut self) -> Result<(), ExportError> {
        Ok(())
    }
}

fn column<'py>(py: Python<'py>, values: &Values) -> PyResult<Bound<'py, PyAny>> {
    match values {
        Values::Int(v) => numbers(py, "=i8", v, |n| n.to_ne_bytes()),
        Values::Pixel(v) => numbers(py, "=u2", v, |n| n.to_ne_bytes()),
        Values::Flag(v) => numbers(py, "?", v, |n| [u8::from(n)]),
        // As pandas reads an optional integer: a float where any is missing.
        Values::Count(v) => match v.iter().copied().collect::<Option<Vec<i64>>>() {
            Some(all) => numbers(py, "=i8", &all, |n| n.to_ne_bytes()),
            None => numbers(py, "=f8", v, |n| {
                n.map_or(f64::NAN, |n| n as f64).to_ne_bytes()
            }),
        },
        Values::Real(v) => numbers(py, "=f8", v, |n| n.to_ne_bytes()),
        Values::Text(v) => Ok(PyList::new(py, v)?.into_any()),
    }
}

/// A numpy array of `dtype` with these values.
fn numbers<'py, T: Copy, const N: usize>(
    py: Python<'py>,
    dtype: &str,
    values: &[T],
    bytes: impl Fn(T) -> [u8; N],
) -> PyResult<Bound<'py, PyAny>> {
    let buffer = PyByteArray::new_with(py, values.len() * N, |to| {
        for (to, value) in to.as_chunks_mut::<N>().0.iter_mut().zip(values) {
            *to = bytes(*value);
        }
        Ok(())
    })?;
    array(py, buffer, dtype.into_pyobject(py)?.into_any())
}

/// A writable numpy array over `buffer`.
pub(crate) fn array<'py>(
    py: Python<'py>,
    buffer: Bound<'py, PyByteArray>,
    dtype: Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    py.import("numpy")?
        .call_method1("frombuffer", (buffer, dtype))
}
