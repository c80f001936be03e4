//! bimvee containers: fixtures of three hickle versions, the writer's output, and bad files.
#![expect(clippy::unwrap_used, reason = "tests")]

use std::path::{Path, PathBuf};

use proptest::prelude::*;
use rust_hdf5::H5File;
use skinrig_formats::hdf5::{Container, EventWriter};
use skinrig_formats::{FormatsError, Geometry};
use skinrig_model::{CdEvent, Polarity};

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/fixtures")
        .join(name)
}

fn read(path: &Path, choice: Option<&str>) -> Result<Vec<CdEvent>, FormatsError> {
    read_within(path, choice, Geometry::EVK1)
}

fn read_within(
    path: &Path,
    choice: Option<&str>,
    geometry: Geometry,
) -> Result<Vec<CdEvent>, FormatsError> {
    let mut reader = Container::open(path)?.events(choice, geometry)?;
    let mut all = Vec::new();
    loop {
        match reader.next_batch()? {
            [] => return Ok(all),
            batch => all.extend_from_slice(batch),
        }
    }
}

/// The content written by `make_fixtures.py`.
fn expected(shift: u64) -> Vec<CdEvent> {
    (0..64)
        .map(|i| CdEvent {
            t_us: i * i + shift,
            x: ((i * 37 + shift) % 640) as u16,
            y: (i * 29 % 480) as u16,
            polarity: Polarity::from_bit(i % 3 == 0),
        })
        .collect()
}

/// The message, without the directory of the file.
fn message(error: &FormatsError, path: &Path) -> String {
    let directory = format!("{}/", path.parent().expect("a directory").display());
    error.to_string().replace(&directory, "")
}

fn failure(path: &Path, choice: Option<&str>) -> String {
    let error = read(path, choice).expect_err("a bad container must be rejected");
    message(&error, path)
}

#[test]
fn all_hickle_layouts_and_types_are_read() {
    for name in [
        "hickle3.hdf5",
        "hickle4.hdf5",
        "hickle5.hdf5",
        "hickle5-uint16.hdf5",
        "hickle5-gzip.hdf5",
    ] {
        assert_eq!(read(&fixture(name), None).unwrap(), expected(0), "{name}");
        let container = Container::open(&fixture(name)).unwrap();
        assert_eq!(container.entries()[0].ts_offset_s, Some(-12.5), "{name}");
        assert_eq!(container.entries()[0].name, "", "{name}");
        let version = format!("hickle {}", &name[6..7]);
        assert!(container.written_by().starts_with(&version), "{name}");
    }
}

#[test]
fn several_dictionaries_need_a_choice() {
    for name in [
        "hickle3-stereo.hdf5",
        "hickle4-stereo.hdf5",
        "hickle5-stereo.hdf5",
    ] {
        let path = fixture(name);
        assert_eq!(read(&path, Some("data/left/dvs")).unwrap(), expected(0));
        assert_eq!(read(&path, Some("data/right/dvs")).unwrap(), expected(1));
        assert_eq!(
            failure(&path, None),
            format!(
                "{name}: expected one dictionary of events, or the name of one, found \
                 `data/left/dvs`, `data/right/dvs`: choose one of them"
            )
        );
        assert!(failure(&path, Some("left")).contains("named `left`, found `data/left/dvs`"));
    }
    let list = fixture("hickle5-list.hdf5");
    assert_eq!(read(&list, Some("0")).unwrap(), expected(0));
    assert_eq!(read(&list, Some("1")).unwrap(), expected(1));
}

#[test]
fn a_shared_array_is_followed() {
    // y is the same object as x in that file, so rows reach 640.
    let path = fixture("hickle5-shared.hdf5");
    let shared: Vec<_> = expected(0)
        .into_iter()
        .map(|e| CdEvent { y: e.x, ..e })
        .collect();
    assert_eq!(read_within(&path, None, Geometry::ANY).unwrap(), shared);
    let found = failure(&path, None);
    assert!(
        found.contains("dataset data/\"y\", row 13: expected 0..=479 but for at most 1 %")
            && found.ends_with("found 481"),
        "{found}"
    );
}

#[test]
fn other_containers_are_named() {
    for (name, kind) in [("dsec.hdf5", "DSEC"), ("metavision.hdf5", "Metavision")] {
        let text = failure(&fixture(name), None);
        assert!(text.contains(kind) && text.contains("convert"), "{text}");
    }
    let text = failure(&fixture("README.md"), None);
    assert!(text.contains("expected a readable HDF5 file"), "{text}");
    assert!(matches!(
        read(&fixture("absent.hdf5"), None),
        Err(FormatsError::Io { .. })
    ));
}

/// A flat file without hickle's attributes, with arbitrary columns.
fn plain(path: &Path, ts: &[f64], x: &[i64], y: &[i64], pol: Option<&[u8]>) {
    let file = H5File::create(path).unwrap();
    let dataset = file.new_dataset::<f64>().shape([ts.len()]).create("ts");
    dataset.unwrap().write_raw(ts).unwrap();
    for (name, values) in [("x", x), ("y", y)] {
        let dataset = file.new_dataset::<i64>().shape([values.len()]).create(name);
        dataset.unwrap().write_raw(values).unwrap();
    }
    if let Some(values) = pol {
        let dataset = file.new_dataset::<u8>().shape([values.len()]).create("pol");
        dataset.unwrap().write_raw(values).unwrap();
    }
    file.close().unwrap();
}

#[test]
fn bad_rows_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("bad.hdf5");
    let n = 20_000;
    let ts: Vec<f64> = (0..n).map(|i| i as f64 / 1e6).collect();
    let check = |row: usize, field: &str, value: f64, text: &str| {
        let (mut ts, mut pixels, mut pol) = (ts.clone(), [vec![1; n], vec![2; n]], vec![1; n]);
        match field {
            "ts" => ts[row] = value,
            "x" => pixels[0][row] = value as i64,
            "y" => pixels[1][row] = value as i64,
            _ => pol[row] = value as u8,
        }
        plain(&path, &ts, &pixels[0], &pixels[1], Some(&pol));
        let found = failure(&path, None);
        let start = format!("bad.hdf5: dataset {field}, row {row}: expected ");
        assert!(
            found.starts_with(&start) && found.ends_with(text),
            "{found}"
        );
    };
    check(9_000, "ts", f64::NAN, "found NaN");
    check(n - 1, "ts", f64::INFINITY, "found inf");
    check(0, "ts", -1e-6, "found -0.000001");
    check(16_384, "ts", 0.0, "from 0.016383 to 315360000, found 0");
    check(16_383, "ts", 1e9, "found 1000000000");
    check(2, "pol", 2.0, "expected 0..=1, found 2");
}

#[test]
fn single_events_outside_the_sensor_are_delivered_and_counted() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("off.hdf5");
    let n = 20_000;
    let ts: Vec<f64> = (0..n).map(|i| i as f64 * 1e-6).collect();
    let mut x = vec![1; n];
    (x[12], x[19_999], x[10_000]) = (640, -1, 65_536 * 3 + 5);
    let mut y = vec![2; n];
    y[1] = 480;
    let pol = vec![1; n];
    plain(&path, &ts, &x, &y, Some(&pol));
    let container = Container::open(&path).unwrap();
    let mut reader = container.events(None, Geometry::EVK1).unwrap();
    let mut events = Vec::new();
    loop {
        let batch = reader.next_batch().unwrap();
        if batch.is_empty() {
            break;
        }
        events.extend_from_slice(batch);
    }
    assert_eq!((events.len(), reader.outside()), (n, 4));
    let at = |row: usize| (events[row].x, events[row].y);
    assert_eq!((at(12), at(1)), ((640, 2), (1, 480)));
    assert_eq!((at(19_999).0, at(10_000).0), (u16::MAX, u16::MAX));
    // Above one percent, it is another sensor's recording.
    x[..400].fill(700);
    let path = dir.path().join("other.hdf5");
    plain(&path, &ts, &x, &y, Some(&pol));
    let found = failure(&path, None);
    assert!(
        found.contains("row 0: expected 0..=639 but for at most 1 %"),
        "{found}"
    );
}

#[test]
fn missing_and_unequal_datasets_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("bad.hdf5");
    plain(&path, &[0.0, 1.0], &[1, 2], &[1, 2], None);
    assert_eq!(
        failure(&path, None),
        "bad.hdf5: expected a bimvee container: a dictionary with ts, x, y and pol, found ts, x, y \
         without [\"pol\"] beside them"
    );
    plain(&path, &[0.0, 1.0], &[1, 2], &[1, 2, 3], Some(&[0, 1]));
    assert_eq!(
        failure(&path, None),
        "bad.hdf5: dataset y: expected 2 rows as in ts, found 3"
    );
    std::fs::remove_file(&path).unwrap();
    assert_eq!(EventWriter::create(&path, 0).unwrap().finish().unwrap(), 0);
    assert_eq!(read(&path, None).unwrap(), []);
    let file = H5File::create(&path).unwrap();
    for name in ["ts", "x", "y", "pol"] {
        let dataset = file.new_dataset::<f32>().shape([1]).create(name).unwrap();
        dataset.write_raw(&[0.0_f32]).unwrap();
    }
    file.close().unwrap();
    assert!(failure(&path, None).contains("dataset ts: expected 64-bit floating point seconds"));
}

#[test]
fn a_truncated_file_is_an_error_at_every_length() {
    let whole = std::fs::read(fixture("hickle5.hdf5")).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("short.hdf5");
    for length in (0..whole.len()).step_by(61) {
        std::fs::write(&path, &whole[..length]).unwrap();
        match read(&path, None) {
            Err(_) => {}
            // Only parts without events may be missing.
            Ok(events) => assert_eq!(events, expected(0), "cut at {length}"),
        }
    }
    std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
    failure(&path, None);
}

fn events(n: u64) -> Vec<CdEvent> {
    (0..n)
        .map(|i| CdEvent {
            t_us: 5_000_000 + i * 3 / 2,
            x: (i * 7 % 640) as u16,
            y: (i * 11 % 480) as u16,
            polarity: Polarity::from_bit(i % 5 < 2),
        })
        .collect()
}

#[test]
fn written_events_read_back() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("out.hdf5");
    let all = events(150_000);
    let mut writer = EventWriter::create(&path, 5_000_000).unwrap();
    for part in all.chunks(70_001) {
        writer.append(part).unwrap();
    }
    let late = writer.append(&all[..1]).unwrap_err().to_string();
    assert_eq!(
        late,
        "expected items in time order, found 5000000 µs after 5224998 µs was written"
    );
    assert_eq!(writer.finish().unwrap(), 150_000);
    let mut back = read(&path, None).unwrap();
    for event in &mut back {
        event.t_us += 5_000_000;
    }
    assert_eq!(back, all);
    let container = Container::open(&path).unwrap();
    assert_eq!(container.entries()[0].ts_offset_s, Some(-5.0));
    assert!(matches!(
        EventWriter::create(&path, 0),
        Err(FormatsError::Io { .. })
    ));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn damaged_containers_never_panic(
        name in prop::sample::select(vec!["hickle3.hdf5", "hickle4.hdf5", "hickle5-shared.hdf5", "hickle5-gzip.hdf5"]),
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..40),
    ) {
        let mut bytes = std::fs::read(fixture(name)).unwrap();
        for (at, value) in damage {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("damaged.hdf5");
        std::fs::write(&path, &bytes).unwrap();
        let _ = read(&path, None);
    }
}
