//! Owns downloads: the tables of `skinrig export`, cut to a window where they are long.

use serde::Deserialize;
use skinrig_export::table::{Table, Values};
use skinrig_export::{CsvFiles, Folder, NpzFile, Source, TableName, TableWriter};
use skinrig_model::{Polarity, PoseSample};

use crate::events::Window;
use crate::open_session::OpenSession;
use crate::poses::Interval;
use crate::problem::Problem;

/// A table to download.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum DownloadTable {
    /// All presses.
    Presses,
    /// The robot's path in the window.
    Pose,
    /// Events of camera 1 in the window.
    EventsCamera1,
    /// Events of camera 2 in the window.
    EventsCamera2,
}

/// Format of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Format {
    /// CSV with a header line.
    Csv,
    /// An archive of numpy with one structured array.
    Npz,
}

/// A download.
#[derive(Debug, Clone, Copy, Deserialize)]
pub(crate) struct Request {
    pub what: DownloadTable,
    pub format: Format,
    /// Start of the window, s of session time.
    pub from_s: f64,
    /// End of the window, s.
    pub to_s: f64,
}

/// Name and bytes of the file.
pub(crate) fn file(opened: &OpenSession, request: Request) -> Result<(String, Vec<u8>), Problem> {
    let place = tempfile::tempdir().map_err(Problem::internal)?;
    let stem = crate::folder::name_of(&opened.path);
    let stem = stem.trim_end_matches(skinrig_recorder::SESSION_SUFFIX);
    let folder = Folder::new(place.path(), stem, false)?;
    let path = match request.format {
        Format::Csv => {
            let mut files = CsvFiles::new(folder);
            write(opened, request, &mut files)?;
            files.into_paths().pop()
        }
        Format::Npz => {
            let mut archive = NpzFile::create(folder)?;
            write(opened, request, &mut archive)?;
            Some(archive.finish()?)
        }
    };
    let path = path.ok_or_else(|| Problem::internal("expected a table, found none"))?;
    let bytes = std::fs::read(&path).map_err(Problem::internal)?;
    Ok((crate::folder::name_of(&path), bytes))
}

fn write(opened: &OpenSession, request: Request, to: &mut dyn TableWriter) -> Result<(), Problem> {
    let known = &opened.known;
    let Request { from_s, to_s, .. } = request;
    let events = |camera: u8| {
        events_table(
            opened,
            Window {
                camera,
                from_s,
                to_s,
            },
        )
    };
    match request.what {
        DownloadTable::Presses => {
            let analysis = known.analysis.as_ref();
            let source = Source {
                reader: &opened.reader,
                header: &known.header,
                analysis: analysis.map(|a| (a, &known.leg_starts[..])),
            };
            source.write(TableName::Presses, to)?;
        }
        DownloadTable::Pose => {
            let samples = crate::poses::read(opened, Interval { from_s, to_s })?;
            pose_table(&samples).write(to)?;
        }
        DownloadTable::EventsCamera1 => events(1)?.write(to)?,
        DownloadTable::EventsCamera2 => events(2)?.write(to)?,
    }
    Ok(())
}

/// Columns as in the table of all events.
fn events_table(opened: &OpenSession, window: Window) -> Result<Table, Problem> {
    let camera = window.check()?;
    let events = crate::events::read(opened, &window)?;
    let time = |t: u64| i64::try_from(t).unwrap_or(i64::MAX);
    let columns = [
        (
            "t_us",
            Values::Int(events.iter().map(|(_, e)| time(e.t_us)).collect()),
        ),
        (
            "x_px",
            Values::Pixel(events.iter().map(|(_, e)| e.x).collect()),
        ),
        (
            "y_px",
            Values::Pixel(events.iter().map(|(_, e)| e.y).collect()),
        ),
        (
            "on",
            Values::Flag(
                events
                    .iter()
                    .map(|(_, e)| e.polarity == Polarity::On)
                    .collect(),
            ),
        ),
    ];
    Ok(Table {
        name: TableName::Events(camera).name(),
        columns: columns
            .map(|(name, values)| (name.to_owned(), values))
            .into(),
    })
}

fn pose_table(samples: &[PoseSample]) -> Table {
    let real = |of: fn(&PoseSample) -> f64| Values::Real(samples.iter().map(of).collect());
    let columns = [
        ("t_ns", Values::Int(samples.iter().map(|s| s.t.0).collect())),
        ("commanded_x_mm", real(|s| s.commanded.x_mm)),
        ("commanded_y_mm", real(|s| s.commanded.y_mm)),
        ("commanded_z_mm", real(|s| s.commanded.z_mm)),
        ("measured_x_mm", real(|s| s.measured.x_mm)),
        ("measured_y_mm", real(|s| s.measured.y_mm)),
        ("measured_z_mm", real(|s| s.measured.z_mm)),
        ("force_n", real(|s| s.force_n)),
    ];
    Table {
        name: TableName::Pose.name(),
        columns: columns
            .map(|(name, values)| (name.to_owned(), values))
            .into(),
    }
}
