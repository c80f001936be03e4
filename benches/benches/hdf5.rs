//! Reads events from a bimvee container, compared with a plain read of the file and h5py, on the same file.
#![expect(clippy::print_stdout, reason = "a bench prints its table")]

use std::fs::File;
use std::hint::black_box;
use std::io::Read as _;
use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use skinrig_bench::Table;
use skinrig_bench::python::{Python, interpreter};
use skinrig_formats::Geometry;
use skinrig_formats::hdf5::{Container, EventWriter};
use skinrig_model::{CdEvent, Polarity};

const EVENTS: usize = 7_000_000;

/// Reads like a Python user: four arrays in memory. One read per input line (a path); the answer is its duration in seconds.
const H5PY: &str = r#"
import sys, time, h5py
print(h5py.__version__, flush=True)
for line in sys.stdin:
    arrays = None
    start = time.perf_counter()
    with h5py.File(line.rstrip("\n")) as f:
        d = f["data"]
        arrays = [d['"%s"' % k][:] for k in ("ts", "x", "y", "pol")]
    seconds = time.perf_counter() - start
    print('{"seconds": %r, "rows": %d}' % (seconds, len(arrays[0])), flush=True)
"#;

/// Layout of the published files: contiguous columns, as h5py writes them.
const CONTIGUOUS: &str = r#"
import sys, h5py
with h5py.File(sys.argv[1]) as a, h5py.File(sys.argv[2], "w") as b:
    for k in ("ts", "x", "y", "pol"):
        v = a["data"]['"%s"' % k][:]
        b['data/"%s"' % k] = v.astype("i8") if k in "xy" else v
"#;

/// Reads the file and returns the duration in seconds, as measured by Python.
fn read(h5py: &mut Python, path: &Path) -> f64 {
    let answer = h5py.query(&path.display().to_string()).expect("an answer");
    assert_eq!(answer["rows"].as_u64(), Some(EVENTS as u64));
    answer["seconds"].as_f64().expect("a number of seconds")
}

fn write(path: &Path) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    let mut writer = EventWriter::create(path, 0).expect("a new file");
    let mut t_us = 0;
    let mut batch = Vec::new();
    for _ in 0..EVENTS / 10_000 {
        batch.clear();
        batch.extend((0..10_000).map(|_| {
            t_us += rng.random_range(0..250);
            CdEvent {
                t_us,
                x: rng.random_range(0..640),
                y: rng.random_range(0..480),
                polarity: Polarity::from_bit(rng.random()),
            }
        }));
        writer.append(&batch).expect("sorted events");
    }
    writer.finish().expect("a complete file");
}

fn measure(title: &str, path: &Path) {
    let megabytes = std::fs::metadata(path).expect("the file").len() as f64 / 1e6;
    let mev = EVENTS as f64 / 1e6;
    let title = format!("{title}: {mev:.1} M events, {megabytes:.0} MB");
    let method = "one core each, file in the page cache, rounds in turn; ours checks every value and delivers \
                  slices of CdEvent; h5py runs in a process of its own, which waits while others are measured";
    let mut table = Table::new(&title, "Mev", method);
    match Python::start(["-c", H5PY]) {
        Some(mut h5py) => {
            let what = format!("h5py {}, four arrays, unchecked", h5py.versions());
            table.baseline_timed(&what, mev, move || read(&mut h5py, path));
        }
        None => println!(
            "h5py: not measured (no python3 with h5py; SKINRIG_BENCH_PYTHON names another)"
        ),
    }
    table.row("Container::events", mev, || {
        let container = Container::open(path).expect("a container");
        let mut events = container
            .events(None, Geometry::EVK1)
            .expect("one dictionary");
        let mut count = 0;
        loop {
            match events.next_batch().expect("good rows") {
                [] => break,
                batch => count += black_box(batch).len(),
            }
        }
        assert_eq!(count, EVENTS);
    });
    let mut buffer = vec![0; 256 * 1024];
    table.row(
        "plain read of the file, 256 KiB at a time",
        mev,
        move || {
            let mut file = File::open(path).expect("the file");
            while file.read(&mut buffer).expect("readable") > 0 {
                black_box(&buffer);
            }
        },
    );
    println!("{}", table.run(10));
}

fn main() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let ours = dir.path().join("ours.hdf5");
    write(&ours);
    measure(
        "bimvee container as written here (chunked, u16 pixels)",
        &ours,
    );
    let theirs = dir.path().join("theirs.hdf5");
    let rewritten = interpreter()
        .args(["-c", CONTIGUOUS])
        .args([&ours, &theirs])
        .status();
    if rewritten.is_ok_and(|s| s.success()) {
        measure(
            "bimvee container as h5py writes it (contiguous, i64 pixels)",
            &theirs,
        );
    }
}
