//! Tests of the writers: output after success, with an obstacle, and after an abort.
#![expect(clippy::unwrap_used, reason = "a failing test may panic")]

use std::path::Path;

use skinrig_export::table::{Column, Kind, Layout, Values};
use skinrig_export::{CsvFiles, ExportError, Folder, NpzFile, ParquetFiles, TableWriter};

fn layout() -> Layout {
    let column = |(name, kind): (&str, Kind)| Column {
        name: name.into(),
        kind,
    };
    let columns = [
        ("t_us", Kind::Int),
        ("on", Kind::Flag),
        ("count", Kind::Count),
        ("x_mm", Kind::Real),
        ("note", Kind::Text(4)),
    ];
    Layout {
        name: "demo",
        columns: columns.map(column).into(),
    }
}

fn rows() -> [Values; 5] {
    [
        Values::Int(vec![1, -2]),
        Values::Flag(vec![true, false]),
        Values::Count(vec![None, Some(7)]),
        Values::Real(vec![0.1, f64::NAN]),
        Values::Text(vec![Some("a,\"ä".into()), None]),
    ]
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

fn all(to: &mut dyn TableWriter, rows_said: u64) -> Result<(), ExportError> {
    to.begin(&layout(), rows_said)?;
    to.append(&rows())?;
    to.end()
}

#[test]
fn files_are_renamed_when_complete() {
    let dir = tempfile::tempdir().unwrap();
    let folder = |overwrite| Folder::new(dir.path(), "s", overwrite).unwrap();
    let mut csv = CsvFiles::new(folder(false));
    csv.begin(&layout(), 2).unwrap();
    assert_eq!(names(dir.path()), ["s.demo.csv.partial"]);
    drop(csv);
    assert_eq!(
        names(dir.path()),
        [""; 0],
        "an aborted export must leave no file"
    );

    let mut csv = CsvFiles::new(folder(false));
    all(&mut csv, 2).unwrap();
    let text = std::fs::read_to_string(&csv.into_paths()[0]).unwrap();
    let expected = "t_us,on,count,x_mm,note\n1,1,,0.1,\"a,\"\"ä\"\n-2,0,7,,\n";
    assert_eq!(text, expected);

    // Repeating an export is accepted; replacing a different file requires --overwrite.
    all(&mut CsvFiles::new(folder(false)), 2).unwrap();
    assert_eq!(names(dir.path()), ["s.demo.csv"]);
    std::fs::write(dir.path().join("s.demo.csv"), "mine").unwrap();
    assert!(matches!(
        all(&mut CsvFiles::new(folder(false)), 2),
        Err(ExportError::Exists { .. })
    ));
    all(&mut CsvFiles::new(folder(true)), 2).unwrap();
    assert_eq!(names(dir.path()), ["s.demo.csv"]);
}

#[test]
fn an_archive_of_numpy_has_aligned_headers_and_the_rows_it_promised() {
    let dir = tempfile::tempdir().unwrap();
    let folder = || Folder::new(dir.path(), "s", false).unwrap();
    let mut npz = NpzFile::create(folder()).unwrap();
    assert!(matches!(
        all(&mut npz, 3),
        Err(ExportError::Changed {
            expected: 3,
            found: 2,
            ..
        })
    ));
    drop(npz);
    assert_eq!(names(dir.path()), [""; 0]);
    let mut npz = NpzFile::create(folder()).unwrap();
    all(&mut npz, 2).unwrap();
    let bytes = std::fs::read(npz.finish().unwrap()).unwrap();
    let magic = bytes.windows(8).position(|w| w == b"\x93NUMPY\x01\x00");
    let npy = &bytes[magic.unwrap()..];
    let header = 10 + usize::from(u16::from_le_bytes([npy[8], npy[9]]));
    assert_eq!(header % 64, 0);
    assert_eq!(npy[header - 1], b'\n');
    let row = 8 + 1 + 8 + 8 + 4 * 4;
    assert_eq!(npy[header..header + 8], 1_i64.to_le_bytes());
    assert_eq!(npy[header + row..header + row + 8], (-2_i64).to_le_bytes());
    assert_eq!(
        npy[header + row + 9..header + row + 17],
        7.0_f64.to_le_bytes()
    );
}

#[test]
fn values_of_another_kind_than_their_column_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let folder = Folder::new(dir.path(), "s", false).unwrap();
    let mut parquet = ParquetFiles::new(folder.clone());
    parquet.begin(&layout(), 2).unwrap();
    let mut wrong = rows();
    wrong[0] = Values::Real(vec![1.0, 2.0]);
    assert!(parquet.append(&wrong).is_err());
    drop(parquet);
    assert_eq!(names(dir.path()), [""; 0]);
    let mut parquet = ParquetFiles::new(folder);
    all(&mut parquet, 2).unwrap();
    let bytes = std::fs::read(&parquet.into_paths()[0]).unwrap();
    assert!(bytes.starts_with(b"PAR1") && bytes.ends_with(b"PAR1"));
}
