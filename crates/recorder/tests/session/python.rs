//! `docs/reference/press_events.py` reads the same events as the reader.

use std::process::Command;

use skinrig_model::CameraId;
use skinrig_recorder::SessionReader;

use crate::common::{ALIGNMENT_US, sealed};

const CODE: &str = include_str!("../../../../docs/reference/press_events.py");

#[test]
fn the_documented_python_reads_the_events_of_a_press() {
    let has_numpy = Command::new("python3")
        .args(["-c", "import numpy"])
        .output();
    if !has_numpy.is_ok_and(|o| o.status.success()) {
        println!("skipped: python3 with numpy is not installed");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.session.sqlite");
    sealed(&path, 6);
    let script = format!(
        "{CODE}
import sys
for press in range(4):
    t, x, y, p = press_events(sys.argv[1], press, 2, 10_000)
    print(len(t), int(t.sum()), int(x.sum()), int(y.sum()), int(p.sum()))"
    );
    let output = Command::new("python3")
        .args(["-c", &script, path.to_str().unwrap()])
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let found = String::from_utf8(output.stdout).unwrap();

    let reader = SessionReader::open(&path).unwrap();
    let mut events = Vec::new();
    let mut base = 0;
    reader
        .for_each_chunk(CameraId::Two, 0, |_, bytes| {
            for word in bytes.as_chunks::<4>().0 {
                let w = u64::from(u32::from_le_bytes(*word));
                match w >> 28 {
                    8 => base = (w & 0x0FFF_FFFF) << 6,
                    p @ (0 | 1) => {
                        events.push((base | (w >> 22 & 63), w >> 11 & 0x7FF, w & 0x7FF, p))
                    }
                    _ => {}
                }
            }
        })
        .unwrap();
    // The last event of a chunk is 16 µs before the end of the chunk; the time base has steps of 64 µs.
    let last = reader.chunk_index(CameraId::Two).unwrap();
    let lag = last
        .iter()
        .map(|m| m.host_time.0 / 1000 - m.facts.last_us.unwrap() as i64)
        .min()
        .unwrap();
    assert!((lag + ALIGNMENT_US as i64 - 16).abs() < 64, "{lag}");
    let mut expected = String::new();
    for press in 0..4i64 {
        let from = press * 20_000 + 4_000 - lag - 10_000;
        let to = press * 20_000 + 15_000 - lag + 10_000;
        let decoded: Vec<_> = events
            .iter()
            .filter(|e| (from..=to).contains(&(e.0 as i64)))
            .collect();
        let sum = |f: fn(&(u64, u64, u64, u64)) -> u64| decoded.iter().map(|e| f(e)).sum::<u64>();
        assert!(decoded.len() > 5);
        expected += &format!(
            "{} {} {} {} {}\n",
            decoded.len(),
            sum(|e| e.0),
            sum(|e| e.1),
            sum(|e| e.2),
            sum(|e| e.3)
        );
    }
    assert_eq!(found, expected);
}
