//! The tutorials, run as printed in an empty folder: every command, its exit code, and the lines that the page promises.
//!
//! A block of `sh` is run line by line; `# exit code N` at the end of a line names a code other than 0. A block of `text` after it
//! lists lines of its output, in order; `...` stands for any text. A block of `yaml` replaces sections of the files that its
//! first line names. Blocks of `python` need the package: without it they are left to `tests/python/package`.
#![cfg(unix)]

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::{Lab, ROOT, files, only, program, run_to_end};

/// A fenced block of a page.
#[derive(Debug)]
struct Block {
    language: String,
    text: String,
}

/// The fenced blocks of a page, those in lists without their indent.
fn blocks(page: &str) -> Vec<Block> {
    let mut blocks = Vec::new();
    let mut lines = page.lines();
    while let Some(line) = lines.next() {
        let Some(language) = line.trim_start().strip_prefix("```") else {
            continue;
        };
        let indent = line.len() - line.trim_start().len();
        let inside = lines.by_ref().take_while(|l| l.trim_start() != "```");
        let inside = inside.map(|l| l.get(indent..).unwrap_or_default().to_owned() + "\n");
        blocks.push(Block {
            language: language.to_owned(),
            text: inside.collect(),
        });
    }
    blocks
}

/// A reader at a terminal, who follows a page.
struct Reader {
    lab: Lab,
    /// Current folder.
    folder: PathBuf,
    /// Output of the last block of commands.
    printed: String,
    commands: usize,
    promises: usize,
}

impl Reader {
    fn new() -> Self {
        let lab = Lab::new();
        Self {
            folder: lab.path("").canonicalize().unwrap(),
            lab,
            printed: String::new(),
            commands: 0,
            promises: 0,
        }
    }

    /// Follows the page of this name to its end.
    #[track_caller]
    fn follow(mut self, page: &str) -> Self {
        let text = std::fs::read_to_string(format!("{ROOT}/docs/tutorial/{page}")).unwrap();
        for block in blocks(&text) {
            match block.language.as_str() {
                "sh" => self.run(&block.text),
                "text" => self.compare(&block.text),
                "yaml" => self.edit(&block.text),
                "python" => self.plot(&block.text),
                other => panic!("{page}: no test for a block of {other:?}"),
            }
        }
        self
    }

    fn run(&mut self, script: &str) {
        self.printed.clear();
        for line in script.replace("\\\n", " ").lines() {
            let (_, code) = line.split_once("# exit code ").unwrap_or(("", "0"));
            self.commands += 1;
            // The shell tells in which folder it ends.
            let end = self.lab.text("folder-at-end");
            let mut shell = Command::new("bash");
            let words = format!("{line}\ncode=$?\npwd >'{end}'\nexit $code\n");
            shell.args(["-c", &words]).current_dir(&self.folder);
            let ours = program::<&str>(&[]);
            let bin = Path::new(ours.get_program()).parent().unwrap();
            let path = std::env::var("PATH").unwrap();
            shell.env("PATH", format!("{}:{path}", bin.display()));
            for (name, value) in ours.get_envs() {
                shell.env(name, value.unwrap());
            }
            let output = run_to_end(shell).code(code.trim().parse().unwrap());
            self.printed += &output.out;
            self.printed += &output.err;
            self.folder = std::fs::read_to_string(&end).unwrap().trim().into();
        }
    }

    /// Asserts that the last commands printed these lines.
    fn compare(&mut self, promised: &str) {
        let mut printed = self.printed.lines();
        for line in promised.lines().filter(|l| *l != "...") {
            self.promises += 1;
            assert!(
                printed.any(|p| matches(line, p)),
                "expected {line:?} in this order in\n{}",
                self.printed
            );
        }
    }

    /// Replaces sections of a protocol; its other sections stay.
    fn edit(&self, sections: &str) {
        let (names, sections) = sections.split_once('\n').unwrap();
        for name in names.strip_prefix("# ").unwrap().split(' ') {
            self.replace_sections(name, sections);
        }
    }

    fn replace_sections(&self, name: &str, sections: &str) {
        let file = self.folder.join(name);
        let mut text = std::fs::read_to_string(&file).unwrap();
        for section in top_sections(sections) {
            let key = section.split_inclusive(':').next().unwrap();
            let old = top_sections(&text).into_iter().find(|s| s.starts_with(key));
            let old = old.unwrap_or_else(|| panic!("{} has no {key}", file.display()));
            text = text.replacen(&old, &section, 1);
        }
        std::fs::write(file, text).unwrap();
    }

    fn plot(&mut self, code: &str) {
        let python = std::env::var("SKINRIG_PYTHON").unwrap_or_else(|_| "python3".to_owned());
        let mut ask = Command::new(&python);
        ask.args(["-c", "import skinrig, matplotlib"]);
        if !ask.output().is_ok_and(|o| o.status.success()) {
            eprintln!("skipped: no package skinrig; tests/python/package runs this code");
            return;
        }
        let mut plot = Command::new(python);
        plot.current_dir(&self.folder).env("MPLBACKEND", "Agg");
        plot.args(["-c", code]);
        run_to_end(plot).code(0);
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }
}

/// True if `printed` is `promised`, apart from spaces, with any text for each `...`.
fn matches(promised: &str, printed: &str) -> bool {
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let (promised, printed) = (words(promised), words(printed));
    let mut parts = promised.split("...");
    let Some(mut rest) = printed.strip_prefix(parts.next().unwrap_or_default()) else {
        return false;
    };
    let mut last = None;
    for part in parts {
        let Some(at) = rest.find(part) else {
            return false;
        };
        rest = &rest[at + part.len()..];
        last = Some(part);
    }
    rest.is_empty() || last == Some("")
}

/// Sections of a YAML file, each from a key without indent to the next.
fn top_sections(text: &str) -> Vec<String> {
    let mut sections: Vec<String> = Vec::new();
    for line in text.lines() {
        let starts = line.starts_with(|c: char| c.is_ascii_alphabetic());
        match sections.last_mut() {
            Some(section) if !starts => *section += &format!("{line}\n"),
            _ => sections.push(format!("{line}\n")),
        }
    }
    sections
}

#[test]
fn promised_lines_are_matched_whole() {
    assert!(matches("RMSE ... mm", "RMSE      0.47 mm"));
    assert!(matches("... sealed", "x, sealed"));
    assert!(matches("sound, ...", "sound, sealed"));
    assert!(!matches("RMSE ... mm", "RMSE 0.47 mm, n 162"));
    assert!(!matches("sealed", "sound, sealed"));
    let page = "1. a\n\n   ```sh\n   x\n     y\n   ```\n";
    assert_eq!(blocks(page)[0].text, "x\n  y\n");
}

#[test]
fn a_student_comes_from_an_empty_folder_to_a_report_on_an_own_skin() {
    let reader = Reader::new().follow("own-skin.md");
    assert!(reader.commands >= 11 && reader.promises >= 10);
    let drawn = std::fs::read_to_string(reader.path("path.svg")).unwrap();
    assert!(drawn.contains("<svg"));
    let reports = files(&reader.path("sessions"), ".report.html");
    let [variant, official] = reports.as_slice() else {
        panic!("expected two reports, found {reports:?}");
    };
    assert!(variant.to_string_lossy().contains("analysis-clusters"));
    let page = std::fs::read_to_string(official).unwrap();
    assert!(page.contains("mold 1") && page.contains("</html>"));
    only(&reader.path("rehearsal"), ".session.sqlite");
}

#[test]
fn a_researcher_comes_from_two_skins_to_a_verdict_and_published_bundles() {
    let reader = Reader::new().follow("two-skins.md");
    assert!(reader.commands >= 7 && reader.promises >= 6);
    assert!(reader.path("sessions/comparison.html").exists());
    // A changed byte in a published file is found.
    let bundles = files(&reader.path("bundles"), "");
    assert_eq!(bundles.len(), 4);
    let table = only(&bundles[0], ".presses.csv");
    let mut bytes = std::fs::read(&table).unwrap();
    bytes[100] ^= 1;
    std::fs::write(table, bytes).unwrap();
    let mut verify = program(&["verify"]);
    verify.arg(&bundles[0]);
    run_to_end(verify).code(4);
}
