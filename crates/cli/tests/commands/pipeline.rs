//! From a protocol to results and exports.

use std::path::Path;
use std::process::{Command, Stdio};

use skinrig_formats::hdf5::Container;
use skinrig_formats::raw::RawReader;
use skinrig_formats::{Decoder, Geometry};
use skinrig_model::{CameraId, CdEvent, StreamFormat};
use skinrig_recorder::SessionReader;

use crate::support::{Lab, SMALL, chunks, files, only, read_json, show, skinrig, text};

/// The number before `word` in `text`.
#[track_caller]
fn number_before(text: &str, word: &str) -> u64 {
    let before = text.split(word).next().unwrap();
    let digits = before.split_whitespace().last().unwrap();
    digits.parse().unwrap()
}

#[test]
fn a_run_ends_with_results_that_add_up_and_files_that_exist() {
    let lab = Lab::new();
    let run_output = skinrig(&["run", "-v", SMALL, "--sessions", &lab.text("s")]).code(0);
    let out = &run_output.out;
    for part in [
        "presses   10: 0 calibrate, 8 score, 2 sync",
        "path ",
        "duration ",
        "expected ",
    ] {
        assert!(out.contains(part), "the plan in a few lines: {part}\n{out}");
    }
    // RMSE  2.44 mm  [1.52, 3.18]  8 presses
    let rmse = out.lines().find(|l| l.starts_with("RMSE ")).unwrap();
    let numbers: Vec<f64> = rmse
        .split(|c: char| !(c.is_ascii_digit() || c == '.'))
        .filter_map(|w| w.parse().ok())
        .collect();
    let [value, low, high, n] = numbers[..] else {
        panic!("expected a value with its interval and n, found {rmse}")
    };
    assert!(
        low <= value && value <= high && low > 0.0 && n == 8.0,
        "{rmse}"
    );
    for part in [
        "RMSE along x",
        "RMSE along y",
        "std between repetitions",
        "located rate",
    ] {
        assert!(out.contains(part), "{part}\n{out}");
    }
    let counts = out.lines().find(|l| l.contains(" planned = ")).unwrap();
    let count = |word| number_before(counts, word);
    assert_eq!(count(" planned"), 8);
    assert_eq!(
        count(" planned"),
        count(" valid") + count(" missed") + count(" invalid") + count(" excluded"),
        "{counts}"
    );
    for camera in ["clock 1", "clock 2"] {
        let fit = out.lines().find(|l| l.starts_with(camera)).unwrap();
        assert!(fit.contains("residual rms"), "{fit}");
    }
    for (key, ending) in [
        ("session   ", ".session.sqlite"),
        ("results   ", ".results.json"),
        ("report    ", ".report.html"),
    ] {
        let line = out.lines().rfind(|l| l.starts_with(key)).unwrap();
        assert_eq!(line[key.len()..], text(&only(&lab.path("s"), ending)));
    }

    // Table, results file and session agree.
    let session = only(&lab.path("s"), ".session.sqlite");
    let results = read_json(&only(&lab.path("s"), ".results.json"));
    let stored = results["analysis"]["scored"]["rmse_mm"]["value"]
        .as_f64()
        .unwrap();
    assert!((stored - value).abs() < 0.006, "{stored} {value}");
    assert_eq!(results["analysis"]["counts"]["planned"], 8);
    assert_eq!(results["provenance"]["session_id"], show(&session)["id"]);
    let html = std::fs::read_to_string(only(&lab.path("s"), ".report.html")).unwrap();
    for foreign in ["src=\"http", "href=\"http", "url(http", "@import"] {
        assert!(
            !html.contains(foreign),
            "the report must be self-contained: {foreign}"
        );
    }
    assert!(html.contains(show(&session)["id"].as_str().unwrap()));
}

#[test]
fn a_recorded_session_can_be_verified_listed_and_shown() {
    let lab = Lab::new();
    let session = lab.record("s", &[]);
    let verified = skinrig(&["verify", &text(&session)]).code(0).out;
    assert!(verified.contains("sound, sealed; 10 presses"), "{verified}");
    let listed = skinrig(&["sessions", &lab.text("s")]).code(0).out;
    let row = listed.lines().nth(1).unwrap();
    for part in [
        "test skin",
        "small.yaml",
        "8/8",
        session.file_name().unwrap().to_str().unwrap(),
    ] {
        assert!(row.contains(part), "{part}: {row}");
    }
    assert!(
        !row.contains("cut off") && !row.contains("not sealed"),
        "{row}"
    );
    let other = skinrig(&["sessions", &lab.text("s"), "--prototype", "another"]).code(0);
    assert!(
        other.out.starts_with("no matching sessions in ") && other.out.trim().ends_with("1 in all"),
        "{other:?}"
    );

    let shown = skinrig(&["show", &text(&session), "--presses", "--protocol"])
        .code(0)
        .out;
    for part in [
        "prototype  test skin",
        "by tests",
        "end        completed",
        "8 planned = 8 valid + 0 missed + 0 invalid + 0 excluded; 2 sync",
        "bias_diff_on",
        "0 bytes lost",
        "name: small",
    ] {
        assert!(shown.contains(part), "{part}\n{shown}");
    }
    // The build is the one running here.
    let version = skinrig(&["--version"]).code(0).out;
    let build = version.trim_end().split_once(" (commit ").unwrap().1;
    assert!(
        build == "unknown)" || build.len() >= 9 && build.ends_with(')'),
        "{version}"
    );
    let line = format!("software   {} on ", version.trim_end());
    assert!(shown.contains(&line), "{line}\n{shown}");
    // One line per press, each cell under its heading.
    let mut table = shown
        .lines()
        .skip_while(|l| !l.contains("press  role"))
        .take(11);
    let column = table.next().unwrap().find("verdict").unwrap();
    let rows: Vec<&str> = table.collect();
    assert_eq!(rows.len(), 10);
    for row in rows {
        assert_eq!(row.find("valid"), Some(column), "{shown}");
    }
}

#[test]
fn analyze_and_report_are_reproducible_and_depend_on_settings() {
    let lab = Lab::new();
    let session = lab.record("s", &[]);
    assert!(files(&lab.path("s"), ".results.json").is_empty());
    let path = text(&session);
    let answer = skinrig(&["analyze", &path]).code(0).out;
    assert!(answer.starts_with("RMSE  "), "{answer}");
    assert!(answer.lines().count() <= 12, "{answer}");
    let first = read_json(&only(&lab.path("s"), ".results.json"));
    skinrig(&["report", &path, "--out", &lab.text("r.html")]).code(0);
    assert!(std::fs::metadata(lab.path("r.html")).unwrap().len() > 10_000);
    let hash = |v: &serde_json::Value| v["provenance"]["results_hash"].as_str().unwrap().to_owned();
    let repeated = read_json(&only(&lab.path("s"), ".results.json"));
    assert_eq!(hash(&first), hash(&repeated));
    let other = lab.text("other.json");
    skinrig(&[
        "analyze",
        &path,
        "--out",
        &other,
        "--set",
        "analysis.centroid=all_clusters",
    ])
    .code(0);
    let other = read_json(Path::new(&other));
    assert_ne!(hash(&first), hash(&other));
    assert_ne!(first["analysis"]["settings"], other["analysis"]["settings"]);
    // The official results and the session are unchanged.
    assert_eq!(
        hash(&first),
        hash(&read_json(&only(&lab.path("s"), ".results.json")))
    );
    skinrig(&["verify", &path]).code(0);
    skinrig(&["analyze", &path, "--set", "depth=1 mm"])
        .code(2)
        .expect_stderr(&["analysis."]);
}

fn events_of(session: &Path, camera: CameraId) -> Vec<CdEvent> {
    let mut decoder = Decoder::new(StreamFormat::Evt2);
    let mut events = Vec::new();
    for chunk in chunks(session, camera) {
        decoder.for_each_slice(&chunk, |e| events.extend_from_slice(e));
    }
    events
}

#[test]
fn exports_hold_exactly_what_was_recorded_and_inspect_reads_them() {
    let lab = Lab::new();
    let session = lab.record("s", &[]);
    let out = lab.text("e");
    let run_output = skinrig(&["export", &text(&session), "--to", "all", "--out", &out]).code(0);
    let written: Vec<&str> = run_output.out.lines().collect();
    assert_eq!(written.len(), 15, "{written:#?}");
    let reader = SessionReader::open(&session).unwrap();

    for camera in CameraId::ALL {
        let recorded = events_of(&session, camera);
        assert!(recorded.len() > 10_000, "{}", recorded.len());

        let raw = only(&lab.path("e"), &format!(".camera{}.raw", camera.number()));
        let mut exported = RawReader::open(&raw).unwrap();
        assert_eq!(exported.header().format, StreamFormat::Evt2);
        assert!(
            exported
                .header()
                .serial_number()
                .unwrap()
                .starts_with("sim-")
        );
        let mut bytes = Vec::new();
        loop {
            match exported.next_chunk().unwrap() {
                [] => break,
                more => bytes.extend_from_slice(more),
            }
        }
        assert!(
            bytes == chunks(&session, camera).concat(),
            "{camera}: bytes differ"
        );

        let hdf5 = only(&lab.path("e"), &format!(".camera{}.hdf5", camera.number()));
        let container = Container::open(&hdf5).unwrap();
        let mut stream = container.events(None, Geometry::EVK1).unwrap();
        let mut repeated = Vec::new();
        loop {
            match stream.next_batch().unwrap() {
                [] => break,
                batch => repeated.extend_from_slice(batch),
            }
        }
        // Times in a container count from the first event.
        let shifted = |e: &CdEvent| CdEvent {
            t_us: e.t_us - recorded[0].t_us,
            ..*e
        };
        let expected: Vec<CdEvent> = recorded.iter().map(shifted).collect();
        assert!(repeated == expected, "{camera}: events differ");

        for (file, kind) in [(&raw, "Prophesee RAW"), (&hdf5, "bimvee HDF5")] {
            let inspected = skinrig(&["inspect", "--json", &text(file)]).code(0).json();
            assert_eq!(inspected["kind"], kind);
            assert_eq!(inspected["streams"][0]["events"], recorded.len());
        }
    }
    let inspected = skinrig(&["inspect", "--json", &text(&session)])
        .code(0)
        .json();
    for camera in CameraId::ALL {
        let stream = &inspected["streams"][camera.index()];
        let shown = &show(&session)["cameras"][camera.index()];
        assert_eq!(stream["events"], shown["events"]);
        assert_eq!(
            stream["counts"]["trigger edges, channel 0"],
            shown["trigger_edges"]
        );
    }

    let presses = only(&lab.path("e"), ".presses.csv");
    let mut table = csv::Reader::from_path(&presses).unwrap();
    let names: Vec<String> = table.headers().unwrap().iter().map(str::to_owned).collect();
    let rows: Vec<csv::StringRecord> = table.records().map(Result::unwrap).collect();
    let cell = |row: usize, name: &str| {
        let column = names.iter().position(|n| n == name).unwrap();
        rows[row][column].to_owned()
    };
    assert_eq!(rows.len(), 10);
    for (i, (planned, attempts)) in reader.presses().unwrap().iter().enumerate() {
        assert_eq!(cell(i, "press"), planned.id.number().to_string());
        let x_mm: f64 = cell(i, "x_mm").parse().unwrap();
        assert_eq!(x_mm, planned.at.x_mm);
        assert_eq!(cell(i, "verdict"), "valid");
        let timing = attempts[0].outcome.as_ref().unwrap().timing.unwrap();
        let contact_s: f64 = cell(i, "contact_s").parse().unwrap();
        assert_eq!(contact_s, timing.contact.as_secs_f64());
    }
    let pose = only(&lab.path("e"), ".pose.csv");
    let rows = csv::Reader::from_path(&pose).unwrap().records().count();
    assert_eq!(rows as u64, reader.totals().unwrap().pose_samples);

    // Repeating the same export succeeds; files it did not write are never overwritten.
    let raw = ["export", &text(&session), "--to", "raw", "--out", &out];
    skinrig(&raw).code(0);
    let camera = only(&lab.path("e"), ".camera1.raw");
    std::fs::write(&camera, "mine").unwrap();
    skinrig(&raw)
        .code(1)
        .expect_stderr(&[".camera1.raw", "--out"]);
    assert_eq!(std::fs::read(&camera).unwrap(), b"mine");
    let csv = ["export", &text(&session), "--to", "csv", "--out", &out];
    // Except with `--overwrite`, which gives the same file.
    let before = std::fs::read(&presses).unwrap();
    skinrig(&[&csv[..], &["--only", "presses", "--overwrite"]].concat()).code(0);
    assert!(before == std::fs::read(&presses).unwrap());
}

/// On a terminal each phase reports progress; in a pipe only the answer is written.
#[test]
fn slow_steps_are_shown_on_a_terminal() {
    let lab = Lab::new();
    let session = lab.record("s", &[]);
    let piped = skinrig(&["analyze", &session.display().to_string()]).code(0);
    assert_eq!(piped.err, "");

    let command = format!(
        "{} analyze {}",
        env!("CARGO_BIN_EXE_skinrig"),
        session.display()
    );
    let typescript = lab.path("typescript");
    let mut script = Command::new("script");
    script
        .args(["-qec", &command])
        .arg(&typescript)
        .env("TERM", "xterm");
    let Ok(run) = script.stdin(Stdio::null()).output() else {
        println!("skipped: no `script` of util-linux, which gives a program a terminal");
        return;
    };
    assert!(run.status.success(), "{run:?}");
    let shown = String::from_utf8_lossy(&std::fs::read(&typescript).unwrap()).into_owned();
    for part in ["analysing, ", " MB read", "writing the report", "RMSE  "] {
        assert!(shown.contains(part), "{part}: {shown}");
    }
}
