//! Pictures of the terminal in the documentation: the real output of the main commands, with colours.
//! `SKINRIG_WRITE_DOCS=1 cargo test -p skinrig pictur` writes them.
#![cfg(unix)]

use std::process::Command;

use crate::support::{Lab, files, program, text};
use crate::terminal_picture::assert_picture;

/// A folder with the demonstration at a fifth of its places, and what commands print in it.
struct Scene(Lab);

impl Scene {
    fn new() -> Self {
        let scene = Self(Lab::new());
        scene.print(&["new", "demo", "short.yaml"], 0);
        let mut protocol = std::fs::read_to_string(scene.0.path("short.yaml")).unwrap();
        for (long, short) in [
            ("name: demo", "name: short"),
            ("pitch: 7 mm", "pitch: 12 mm"),
            ("columns: 9", "columns: 4"),
            ("rows: 9", "rows: 4"),
        ] {
            assert!(protocol.contains(long), "{long}");
            protocol = protocol.replace(long, short);
        }
        scene.write("short.yaml", &protocol);
        scene
    }

    /// Both streams of a command, with colours, one after the other. Times, sizes and names that differ between runs are replaced.
    fn print(&self, arguments: &[&str], code: i32) -> String {
        let mut command: Command = program(arguments);
        command
            .env("CLICOLOR_FORCE", "1")
            .env_remove("NO_COLOR")
            .current_dir(self.0.path(""));
        let output = command.output().unwrap();
        let [out, err] = [output.stdout, output.stderr].map(|t| String::from_utf8(t).unwrap());
        assert_eq!(output.status.code(), Some(code), "{out}{err}");
        let progress = |line: &&str| !line.starts_with("press ") && !line.starts_with("preflight ");
        let err: Vec<&str> = err.lines().filter(progress).collect();
        fixed(&format!("{out}{}\n", err.join("\n")))
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.0.path(name), text).unwrap();
    }
}

/// The same on every day: times of day, and identifiers that follow from them.
fn fixed(text: &str) -> String {
    let words = text.split_inclusive([' ', '\n', '/', ';', ',']);
    let one = |word: &str| {
        let digits = |from: usize, n: usize| {
            let part = word.get(from..from + n);
            part.is_some_and(|p| p.bytes().all(|b| b.is_ascii_digit()))
        };
        let stamp = digits(0, 8) && digits(9, 6) && word.get(8..9) == Some("T");
        let time = digits(0, 4) && digits(5, 2) && word.get(10..11) == Some("T");
        let id = word.len() == 9 && word[..8].bytes().all(|b| b.is_ascii_hexdigit());
        match (stamp, time) {
            _ if id => format!("01234567{}", &word[8..]),
            (true, _) => format!("20260101T090000{}", &word[15..]),
            (_, true) => format!("2026-01-01T09:00:00{}", &word[19..]),
            _ => word.to_owned(),
        }
    };
    words.map(one).collect()
}

/// Replaces the number before each `unit`.
fn redact(text: &str, unit: &str, number: &str) -> String {
    let mut parts: Vec<String> = text.split(unit).map(str::to_owned).collect();
    let last = parts.len() - 1;
    for part in &mut parts[..last] {
        let start = part.rfind([' ', '\n']).map_or(0, |at| at + 1);
        part.replace_range(start.., number);
    }
    parts.join(unit)
}

#[test]
fn help_and_an_error_look_as_in_their_pictures() {
    let scene = Scene::new();
    assert_picture("help", "skinrig --help", &scene.print(&["--help"], 0));
    scene.print(&["new", "quick-check", "mine.yaml"], 0);
    let protocol = std::fs::read_to_string(scene.0.path("mine.yaml")).unwrap();
    let wrong = protocol
        .replace("depth: 1 mm", "depth: 1")
        .replace("period:", "perod:");
    scene.write("mine.yaml", &wrong);
    let error = scene.print(&["check", "mine.yaml"], 2);
    assert_picture("error", "skinrig check mine.yaml", &error);
}

/// A short demonstration with two skins, in the folder `sessions`.
#[test]
fn a_run_and_what_follows_it_look_as_in_their_pictures() {
    let scene = Scene::new();
    let run = ["run", "short.yaml"];
    let skin = |id: &str, seed: &str, code: i32, more: &[&str]| {
        let id = format!("prototype.id={id}");
        let own = ["--set", &id, "--seed", seed];
        scene.print(&[&run[..], &own, more].concat(), code)
    };
    let printed = skin("mold 1", "1", 0, &[]);
    assert_picture("run", "skinrig run short.yaml", &printed);
    skin("mold 2", "2", 0, &["--no-analysis"]);

    let compare = scene.print(&["compare", "mold 1", "mold 2"], 0);
    assert_picture("compare", "skinrig compare \"mold 1\" \"mold 2\"", &compare);

    let [one, _] = <[_; 2]>::try_from(files(&scene.0.path("sessions"), ".session.sqlite")).unwrap();
    let tradeoff = [
        "tradeoff",
        &text(&one),
        "--cost",
        "bytes",
        "--target-rmse",
        "3mm",
    ];
    let printed = redact(&scene.print(&tradeoff, 0), " ms of CPU time", "0.020");
    // The rest of the table depends on the speed of the computer.
    let (chosen, _) = printed.split_once("\nRig: ").unwrap();
    let command = "skinrig tradeoff SESSION --cost bytes --target-rmse 3mm";
    assert_picture("tradeoff", command, chosen);
}

/// A run that failed and has not ended well: a camera that stalls.
#[test]
fn a_failing_run_looks_as_in_its_pictures() {
    let scene = Scene::new();
    let fault = [
        "--fault",
        "camera1-drops@hold:4",
        "--fault",
        "camera1-stalled@hold:9",
    ];
    scene.print(
        &[&["run", "short.yaml", "--no-analysis"][..], &fault].concat(),
        3,
    );
    for command in ["watch", "status"] {
        let printed = redact(&scene.print(&[command, "sessions"], 0), " GB free", "250.0");
        assert_picture(command, &format!("skinrig {command}"), &printed);
    }
}
