//! Owns `Session`: one session file as tables, arrays and texts.

use std::ffi::CString;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::prelude::*;
use serde_json::json;
use skinrig::exit::Failure;
use skinrig::library;
use skinrig_export::{Source, TableName};
use skinrig_model::{CameraId, RunHeader};
use skinrig_recorder::SessionReader;
use skinrig_results::{ChunkIndex, Origin, events_between};

use crate::error::{InputError, no_table, raised, unreadable, warn_invalid, why_invalid};
use crate::events::PackedEvents;
use crate::options::{results_to_python, to_python};
use crate::table::Columns;

/// A session file, opened for reading, sealed or still growing.
///
/// Tables have the columns of `skinrig export`, which docs/reference/exports.md defines. `presses`, `results` and `events` need
/// the session's analysis: the results beside the session if they are of this version, else it is analysed once, in memory. The
/// tables of an INVALID session raise `InvalidSessionWarning`.
#[pyclass(frozen, module = "skinrig")]
pub(crate) struct Session {
    path: PathBuf,
    reader: SessionReader,
    header: RunHeader,
    session_id: String,
    analysed: Mutex<Option<Arc<AnalysisTables>>>,
    chunks: [Mutex<Option<Arc<ChunkIndex>>>; 2],
}

/// Tables that depend on the analysis.
struct AnalysisTables {
    presses: Columns,
    results: Columns,
    /// Why none of their numbers may be used.
    invalid: Option<CString>,
}

impl Session {
    fn source(&self) -> Source<'_> {
        Source {
            reader: &self.reader,
            header: &self.header,
            analysis: None,
        }
    }

    fn analysed(&self) -> PyResult<Arc<AnalysisTables>> {
        let mut analysed = self.analysed.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(analysed) = &*analysed {
            return Ok(Arc::clone(analysed));
        }
        let (analysis, legs) =
            library::analysis_for_tables(&self.path, &self.reader, &self.session_id)
                .map_err(raised)?;
        let source = Source {
            analysis: Some((&analysis, &legs)),
            ..self.source()
        };
        let found = Arc::new(AnalysisTables {
            presses: Columns::of(&source, TableName::Presses).map_err(no_table)?,
            results: Columns::of(&source, TableName::Results).map_err(no_table)?,
            invalid: library::invalid(&self.path, &analysis).and_then(why_invalid),
        });
        *analysed = Some(Arc::clone(&found));
        Ok(found)
    }

    /// The tables, after a warning if the session is INVALID.
    fn warned(&self, py: Python<'_>) -> PyResult<Arc<AnalysisTables>> {
        let analysed = py.detach(|| self.analysed())?;
        if let Some(why) = &analysed.invalid {
            warn_invalid(py, why)?;
        }
        Ok(analysed)
    }

    /// Calls `then` with a table, read without the interpreter's lock.
    fn with_table<'py>(
        &self,
        py: Python<'py>,
        name: &str,
        then: impl Fn(&Columns) -> PyResult<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        match name {
            "presses" => then(&self.warned(py)?.presses),
            "results" => then(&self.warned(py)?.results),
            "poses" => {
                let poses = py.detach(|| Columns::of(&self.source(), TableName::Pose));
                then(&poses.map_err(no_table)?)
            }
            "marks" => {
                let marks = py.detach(|| self.reader.marks_sent());
                then(&Columns::of_marks(&marks.map_err(unreadable)?))
            }
            _ => Err(InputError::new_err(format!(
                "error: expected the table presses, results, poses or marks, found `{name}`"
            ))),
        }
    }

    fn pandas<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        self.with_table(py, name, |table| table.to_pandas(py))
    }

    fn chunks(&self, camera: CameraId) -> PyResult<Arc<ChunkIndex>> {
        let mut chunks = self.chunks[camera.index()]
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        if let Some(chunks) = &*chunks {
            return Ok(Arc::clone(chunks));
        }
        let format = self.header.stream_formats[camera.index()];
        let read = ChunkIndex::read(&self.reader, camera, format).map_err(unreadable)?;
        Ok(Arc::clone(chunks.insert(Arc::new(read))))
    }

    fn events_around(
        &self,
        press: u32,
        camera: CameraId,
        margin_us: f64,
    ) -> PyResult<PackedEvents> {
        let analysed = self.analysed()?;
        let moment = |what: &str| {
            let column = format!("camera{}_{what}_us", camera.number());
            analysed.presses.real_of_press(&column, press)
        };
        let (Some(contact_us), Some(release_us)) = (moment("contact"), moment("release")) else {
            return Err(raised(Failure::input(format!(
                "{}: expected contact and release of press {press} on the clock of {camera}, found none: the plan has no such \
                 press, it was not made, or the clocks are not aligned",
                self.path.display()
            ))));
        };
        // Camera times are whole microseconds from 0.
        let from_us = (contact_us - margin_us).ceil().max(0.0) as u64;
        let to_us = (release_us + margin_us).floor().max(0.0) as u64;
        let mut events = PackedEvents::default();
        let chunks = self.chunks(camera)?;
        events_between(&self.reader, &chunks, (from_us, to_us), |event| {
            events.push(event);
        })
        .map_err(unreadable)?;
        Ok(events)
    }

    fn facts(&self) -> PyResult<String> {
        let header = &self.header;
        let end = self.reader.end().map_err(unreadable)?;
        let seal = self.reader.seal().map_err(unreadable)?;
        let facts = json!({
            "session_id": self.session_id,
            "prototype": header.prototype,
            "operator": header.operator,
            "started": header.started_at,
            "protocol": header.protocol_name,
            "protocol_sha256": header.protocol_sha256,
            "overrides": header.overrides,
            "plan_sha256": header.plan_sha256,
            "seed": header.seed,
            "presses": header.presses.len(),
            "rig": header.rig_name,
            "origin": Origin::of(header).map(Origin::name),
            "host": header.host,
            "software": header.software,
            "command_line": header.command_line,
            "stream_formats": header.stream_formats.map(|format| format.name()),
            "sealed": seal.is_some(),
            "end": end.map(|(_, end)| end.name()),
        });
        Ok(facts.to_string())
    }
}

#[pymethods]
impl Session {
    #[new]
    fn open(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        py.detach(|| {
            let reader = SessionReader::open_checked(&path)?;
            Ok(Self {
                header: reader.header()?,
                session_id: reader.session_id()?,
                analysed: Mutex::default(),
                chunks: Default::default(),
                reader,
                path,
            })
        })
        .map_err(unreadable)
    }

    /// Path of the file.
    #[getter]
    fn path(&self) -> &Path {
        &self.path
    }

    /// The protocol or schedule, as the user wrote it.
    #[getter]
    fn protocol(&self) -> &str {
        &self.header.protocol_text
    }

    /// Facts of the session: `session_id`, `prototype`, `operator`, `started` (RFC 3339), `seed`, `rig`, `sealed`, `end` and others.
    #[getter]
    fn header<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &py.detach(|| self.facts())?)
    }

    /// One row per planned press, with its analysis: a pandas DataFrame, lengths in mm, host times in s, camera times in µs.
    #[getter]
    fn presses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.pandas(py, "presses")
    }

    /// One row per metric, with its 95 % interval: a pandas DataFrame.
    #[getter]
    fn results<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.pandas(py, "results")
    }

    /// One row per pose sample of the robot: a pandas DataFrame, `t_ns` on the host clock, positions in mm, force in N.
    #[getter]
    fn poses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.pandas(py, "poses")
    }

    /// One row per mark that the trigger box sent: a pandas DataFrame with `kind`, `press`, `t_ns` and `uncertainty_ns`.
    #[getter]
    fn marks<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.pandas(py, "marks")
    }

    /// The table `presses`, `results`, `poses` or `marks` without pandas: a dict of numpy arrays, and of lists of text with `None`
    /// where it is missing. `polars.DataFrame` and `pyarrow.table` take it.
    fn columns<'py>(&self, py: Python<'py>, table: &str) -> PyResult<Bound<'py, PyAny>> {
        self.with_table(py, table, |columns| Ok(columns.to_dict(py)?.into_any()))
    }

    /// Events of camera 1 or 2 from `margin_ms` before the contact of a press to `margin_ms` after its release: a structured numpy
    /// array with `t_us` (on this camera's clock), `x_px`, `y_px` and `on`.
    #[pyo3(signature = (press, camera, margin_ms=50.0))]
    fn events<'py>(
        &self,
        py: Python<'py>,
        press: u32,
        camera: u8,
        margin_ms: f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let known = CameraId::ALL.into_iter().find(|c| c.number() == camera);
        let Some(camera) = known else {
            return Err(InputError::new_err(format!(
                "error: expected camera 1 or 2, found {camera}"
            )));
        };
        if !(margin_ms.is_finite() && margin_ms >= 0.0) {
            return Err(InputError::new_err(format!(
                "error: expected a margin of 0 ms or more, found {margin_ms}"
            )));
        }
        py.detach(|| self.events_around(press, camera, margin_ms * 1e3))?
            .to_array(py)
    }

    /// Names of the variants of the analysis beside the session.
    #[getter]
    fn variants(&self, py: Python<'_>) -> Vec<String> {
        py.detach(|| library::variants(&self.path, &self.session_id))
    }

    /// The results that `skinrig analyze` stored beside the session, as a dict; with a `name` those of a variant. INVALID ones raise
    /// `InvalidSessionWarning`.
    #[pyo3(signature = (name=None))]
    fn analysis<'py>(&self, py: Python<'py>, name: Option<&str>) -> PyResult<Bound<'py, PyAny>> {
        let text = py.detach(|| library::stored_results(&self.path, &self.session_id, name));
        results_to_python(py, &self.path, &text.map_err(raised)?)
    }

    fn __repr__(&self) -> String {
        format!(
            "Session({:?}): {}, {} presses",
            self.path.display().to_string(),
            self.header.prototype,
            self.header.presses.len()
        )
    }
}
