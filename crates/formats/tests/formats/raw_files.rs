//! RAW files: headers of old and new tools, and the writer's output.

use std::path::Path;

use proptest::prelude::*;
use skinrig_formats::Geometry;
use skinrig_formats::raw::{RawHeader, RawMetadata, RawReader, RawWriter};
use skinrig_model::StreamFormat;

fn parse(text: &str) -> Result<RawHeader, String> {
    RawHeader::parse(text.as_bytes(), Path::new("x.raw")).map_err(|e| e.to_string())
}

const EVK1_ERA: &str = "% date 2022-03-01 10:11:12\n% evt 2.0\n% firmware_version 3.0.0\n\
    % format EVT2\n% geometry 640x480\n% integrator_name Prophesee\n\
    % plugin_name hal_plugin_gen31_fx3\n% sensor_generation 3.1\n% serial_number 00001621\n\
    % subsystem_ID 2418019331\n% system_ID 28\n";

#[test]
fn old_headers_end_at_the_first_word() {
    let mut file = EVK1_ERA.as_bytes().to_vec();
    file.extend([0x25, 0x21, 0, 0x80]);
    let header = RawHeader::parse(&file, Path::new("x.raw")).unwrap();
    assert_eq!(header.length, EVK1_ERA.len() as u64);
    assert!(!header.has_end);
    assert_eq!(header.format, StreamFormat::Evt2);
    assert_eq!(header.geometry, Some(Geometry::EVK1));
    assert_eq!(header.serial_number(), Some("00001621"));
    assert_eq!(header.get("subsystem_ID"), Some("2418019331"));
    assert_eq!(header.entries.len(), 11);
}

#[test]
fn headers_end_at_their_end_mark() {
    let text = "% format EVT3;height=720;width=1280\n% strange   two   words\n% end\n% \x01";
    let header = parse(text).unwrap();
    assert!(header.has_end);
    assert_eq!(header.length as usize, text.len() - 3);
    assert_eq!(header.format, StreamFormat::Evt3);
    let size = Geometry {
        width: 1280,
        height: 720,
    };
    assert_eq!(header.geometry, Some(size));
    assert_eq!(header.get("strange"), Some("two words"));
}

#[test]
fn byte_order_and_format_follow_the_keys() {
    let format = |text: &str| parse(text).map(|h| h.format);
    use StreamFormat::{Evt2, Evt3, Evt21, Evt21Legacy};
    for (text, expected) in [
        ("% evt 2.1\n", Evt21),
        ("% evt 2.1\n% endianness legacy\n", Evt21Legacy),
        (
            "% format EVT21;endianness=legacy;height=1;width=1\n",
            Evt21Legacy,
        ),
        (
            "% evt 2.1\n% integrator_name Prophesee\n% system_ID 49\n",
            Evt21Legacy,
        ),
        (
            "% evt 2.1\n% integrator_name Prophesee\n% system_ID 55\n",
            Evt21,
        ),
        (
            "% evt 2.1\n% integrator_name Other\n% system_ID 49\n",
            Evt21,
        ),
        (
            "% evt 2.1\n% camera_integrator_name Prophesee\n% endianness little\n% system_ID 49\n",
            Evt21,
        ),
        ("% system_ID 28\n", Evt2),
        ("% system_ID 40\n", Evt3),
    ] {
        assert_eq!(format(text), Ok(expected), "{text}");
    }
    assert_eq!(
        parse("% system_ID 28\n").unwrap().geometry,
        Some(Geometry::EVK1)
    );
    assert_eq!(parse("% evt 2.0\n").unwrap().geometry, None);
}

#[test]
fn bad_headers_are_rejected_with_offset_and_key() {
    for (text, expected) in [
        (
            "",
            "x.raw: header, byte 0, key ``: expected a header that begins with `% `, found \"\"",
        ),
        ("RIFF", "found \"RIFF\""),
        (
            "% date x",
            "byte 0, key ``: expected a line of at most 1024 bytes, found no end of line",
        ),
        ("% \n", "expected a key, found an empty line"),
        (
            "% date x\n% geometry 640*480\n",
            "byte 9, key `geometry`: expected WIDTHxHEIGHT, found 640*480",
        ),
        (
            "% geometry 640x480\n% format EVT2;height=720;width=640\n",
            "key `format`: expected height 480 as stated elsewhere in the header",
        ),
        ("% geometry 0x480\n", "expected a width in 1..=2048"),
        (
            "% endianness middle\n",
            "expected endianness little or legacy, found middle",
        ),
        (
            "% system_ID twelve\n",
            "key `system_ID`: expected a decimal number, found twelve",
        ),
        ("% evt 4.0\n", "byte 10, key `format`: expected one of EVT2"),
        (
            "% evt 3.0\n% format EVT2\n",
            "found format `EVT2` and evt `3.0`",
        ),
        (
            "% date x\n",
            "found neither key, and no system_ID that implies it",
        ),
    ] {
        let error = parse(text).unwrap_err();
        assert!(error.contains(expected), "{text:?}: {error}");
    }
    let latin = RawHeader::parse(b"% date \xe9\n", Path::new("x")).unwrap_err();
    assert!(
        latin.to_string().contains("expected text in UTF-8"),
        "{latin}"
    );
}

#[test]
fn a_written_file_reads_back_unmodified() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("out.raw");
    let mut metadata = RawMetadata::evk1("2026-01-02 03:04:05", "00001621");
    metadata
        .more
        .push(("firmware_version".into(), "3.0.0".into()));
    let bytes: Vec<u8> = (0..700_001_u32).map(|k| (k * 31) as u8).collect();
    let mut writer = RawWriter::create(&path, &metadata).unwrap();
    for part in bytes.chunks(99_999) {
        writer.write(part).unwrap();
    }
    writer.finish().unwrap();
    assert!(
        RawWriter::create(&path, &metadata).is_err(),
        "never overwrites"
    );
    assert_eq!(
        metadata.header().unwrap(),
        "% camera_integrator_name Prophesee\n% date 2026-01-02 03:04:05\n% evt 2.0\n\
         % firmware_version 3.0.0\n% format EVT2;height=480;width=640\n% geometry 640x480\n\
         % plugin_integrator_name Prophesee\n% plugin_name hal_plugin_prophesee\n\
         % sensor_generation 3.1\n% serial_number 00001621\n% system_ID 28\n% end\n"
    );
    let mut reader = RawReader::open(&path).unwrap();
    assert_eq!(reader.header().serial_number(), Some("00001621"));
    let mut back = Vec::new();
    loop {
        match reader.next_chunk().unwrap() {
            [] => break,
            part => back.extend_from_slice(part),
        }
    }
    assert_eq!(back, bytes);
}

#[test]
fn values_that_would_not_read_back_are_rejected() {
    for (key, value) in [
        ("a b", "x"),
        ("end", "x"),
        ("a", "x\ny"),
        ("a", ""),
        ("date", "x"),
    ] {
        let mut metadata = RawMetadata::evk1("d", "s");
        metadata.more.push((key.into(), value.into()));
        assert!(metadata.header().is_err(), "{key:?} {value:?}");
    }
}

#[test]
fn every_format_is_written_and_recognised() {
    for format in [
        StreamFormat::Evt2,
        StreamFormat::Evt21,
        StreamFormat::Evt21Legacy,
        StreamFormat::Evt3,
    ] {
        let metadata = RawMetadata {
            format,
            ..RawMetadata::evk1("d", "s")
        };
        assert_eq!(parse(&metadata.header().unwrap()).unwrap().format, format);
    }
}

proptest! {
    #[test]
    fn any_bytes_give_a_header_or_an_error(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let _ = RawHeader::parse(&bytes, Path::new("x"));
        let mut headed = b"% ".to_vec();
        headed.extend(bytes);
        let _ = RawHeader::parse(&headed, Path::new("x"));
    }

    #[test]
    fn any_header_text_gives_a_header_or_an_error(
        text in "(% (format|evt|geometry|endianness|system_ID|end) ?[EVT0-9x.;=a-z ]{0,12}\n){0,5}",
    ) {
        let _ = parse(&text);
    }
}
