//! Results of `inspect` for RAW and HDF5 files, and rejection of others.

use std::path::Path;

use skinrig_formats::evt2::Encoder;
use skinrig_formats::inspect::{FileKind, Gap, inspect};
use skinrig_formats::raw::{RawMetadata, RawWriter};
use skinrig_formats::{Discontinuity, Geometry};
use skinrig_model::{CdEvent, Polarity, StreamFormat, TriggerEdge};

#[test]
fn a_raw_file_is_described() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.raw");
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(1_000_000);
    let on = Polarity::On;
    for k in 0..100 {
        let t_us = 1_000_000 + k * 1_000 + if k >= 60 { 50_000 } else { 0 };
        let polarity = if k % 4 == 0 { on } else { Polarity::Off };
        let event = CdEvent {
            t_us,
            x: 5,
            y: 6,
            polarity,
        };
        encoder.cd(event, &mut bytes).unwrap();
        if k % 50 == 0 {
            let edge = TriggerEdge {
                t_us,
                channel: 6,
                rising: true,
            };
            encoder.trigger(edge, &mut bytes).unwrap();
        }
    }
    bytes.extend(0x8000_0000_u32.to_le_bytes());
    bytes.extend([0xff, 0xff, 0xff]);
    let mut writer = RawWriter::create(&path, &RawMetadata::evk1("d", "00000007")).unwrap();
    writer.write(&bytes).unwrap();
    writer.finish().unwrap();

    let found = inspect(&path, 10_000).unwrap();
    assert_eq!(found.kind, FileKind::Raw);
    assert_eq!(found.format, Some(StreamFormat::Evt2));
    assert_eq!(found.geometry, Some(Geometry::EVK1));
    assert!(
        found
            .header
            .contains(&("serial_number".into(), "00000007".into()))
    );
    let stream = &found.streams[0];
    assert_eq!((stream.stats.cd_on, stream.stats.cd_off), (25, 75));
    assert_eq!(stream.stats.triggers[6], 2);
    assert_eq!(stream.stats.trailing_bytes, 3);
    assert_eq!(stream.first_us, Some(1_000_000));
    assert_eq!(stream.gap_count, 1);
    let gap = Gap {
        from_us: 1_059_000,
        to_us: 1_110_000,
    };
    assert_eq!(stream.gaps, [gap]);
    let step = Discontinuity {
        from_us: 1_148_992,
        to_us: 0,
    };
    assert_eq!(stream.discontinuities, [step]);
    assert_eq!((stream.last_us, stream.span_s()), (Some(0), None));
}

/// The second half of a recording, then the first: from its first event to its last is no span.
#[test]
fn a_recording_whose_time_steps_back_has_no_rate() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("swapped.raw");
    let mut bytes = Vec::new();
    for from_us in [50_000_000, 0] {
        let mut encoder = Encoder::new(from_us);
        for k in 0..100 {
            let event = CdEvent {
                t_us: from_us + k * 550_000,
                x: 5,
                y: 6,
                polarity: Polarity::On,
            };
            encoder.cd(event, &mut bytes).unwrap();
        }
    }
    let mut writer = RawWriter::create(&path, &RawMetadata::evk1("d", "00000007")).unwrap();
    writer.write(&bytes).unwrap();
    writer.finish().unwrap();

    let stream = &inspect(&path, 1_000_000).unwrap().streams[0];
    assert_eq!(stream.first_us, Some(50_000_000));
    assert!(stream.last_us > Some(54_000_000), "{:?}", stream.last_us);
    assert_eq!((stream.span_s(), stream.mean_rate_hz()), (None, None));
}

#[test]
fn an_hdf5_file_is_described() {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures");
    let found = inspect(&fixtures.join("hickle4-stereo.hdf5"), 120).unwrap();
    assert_eq!(found.kind, FileKind::Hdf5);
    assert_eq!(found.header, [("written by".into(), "hickle 4.0.4".into())]);
    let names: Vec<_> = found.streams.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names, ["data/left/dvs", "data/right/dvs"]);
    let right = &found.streams[1];
    assert_eq!((right.stats.cd_on, right.stats.cd_off), (22, 42));
    assert_eq!(
        (right.first_us, right.last_us),
        (Some(1), Some(63 * 63 + 1))
    );
    assert_eq!(right.ts_offset_s, Some(-12.5));
    // Steps are 1, 3, 5, ... 125 µs: those of 121, 123 and 125 are longer than 120.
    assert_eq!((right.gap_count, right.gaps.len()), (3, 3));
    let rate = right.mean_rate_hz().unwrap();
    assert!((rate - 64.0 / 3969e-6).abs() < 1e-6, "{rate}");
}

#[test]
fn other_files_are_rejected_by_kind() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("x");
    for (bytes, kind, text) in [
        (
            &b"SQLite format 3\0..."[..],
            FileKind::Sqlite,
            "found an SQLite database",
        ),
        (b"PK", FileKind::Unknown, "found another kind of file"),
        (b"", FileKind::Unknown, "found another kind of file"),
    ] {
        std::fs::write(&path, bytes).unwrap();
        assert_eq!(FileKind::detect(&path).unwrap(), kind);
        let error = inspect(&path, 1).unwrap_err().to_string();
        assert!(error.contains(text), "{error}");
    }
    assert!(inspect(&dir.path().join("absent"), 1).is_err());
}

#[test]
fn the_sample_recordings_are_read_completely() {
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/sample-grid");
    if !shared.exists() {
        println!("skipped: {} not found", shared.display());
        return;
    }
    for camera in 1..=2 {
        let path = shared.join(format!("grid_path2_v2_camera{camera}.hdf5"));
        let found = inspect(&path, 1_000_000).unwrap();
        let stream = &found.streams[0];
        println!(
            "{camera}: {:?} {:?} s",
            stream.stats.cd_events(),
            stream.span_s()
        );
        assert!(stream.stats.cd_events() > 100_000);
        assert!((800.0..1000.0).contains(&stream.span_s().unwrap()));
    }
}
