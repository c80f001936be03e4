//! Shared helpers: running the program, a temporary folder, and a small campaign.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};

use serde_json::Value;
use sha2::{Digest, Sha256};
use skinrig_catalogue::results_digest::with_digest;
use skinrig_model::CameraId;
use skinrig_recorder::SessionReader;
use tempfile::TempDir;

/// Workspace root: holds the protocols and is the program's working directory.
pub(crate) const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
/// Two repetitions of four presses, and two sync presses; 17 s of rig time.
pub(crate) const SMALL: &str = "crates/cli/tests/fixtures/small.yaml";

/// Exit code (`None` if killed), standard output and standard error of one call.
#[derive(Debug)]
pub(crate) struct ProgramOutput {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
}

impl ProgramOutput {
    /// Asserts the exit code and that nothing panicked.
    #[track_caller]
    pub(crate) fn code(self, expected: i32) -> Self {
        assert_eq!(self.code, Some(expected), "{self:#?}");
        assert!(!self.err.contains("panicked"), "{self:#?}");
        self
    }

    /// Standard output as JSON.
    #[track_caller]
    pub(crate) fn json(&self) -> Value {
        match serde_json::from_str(&self.out) {
            Ok(value) => value,
            Err(e) => panic!("expected JSON on standard output, found {e}\n{}", self.out),
        }
    }

    /// Asserts that standard error contains all `parts`.
    #[track_caller]
    pub(crate) fn expect_stderr(self, parts: &[&str]) -> Self {
        for part in parts {
            assert!(self.err.contains(part), "expected {part:?} in {self:#?}");
        }
        self
    }
}

/// Command for the program with these arguments, not yet started.
pub(crate) fn program<S: AsRef<OsStr>>(arguments: &[S]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_skinrig"));
    command.current_dir(ROOT).args(arguments);
    // Each call has its own leases: tests run in parallel on benches of the same name.
    command.env("SKINRIG_LEASES", leases());
    command
}

/// Creates a new folder for leases.
fn leases() -> PathBuf {
    static MADE: AtomicUsize = AtomicUsize::new(0);
    let name = format!(
        "leases-{}-{}",
        std::process::id(),
        MADE.fetch_add(1, Ordering::Relaxed)
    );
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// Runs the program to its end, without a terminal.
pub(crate) fn skinrig<S: AsRef<OsStr>>(arguments: &[S]) -> ProgramOutput {
    run_to_end(program(arguments))
}

/// Runs `command` to its end.
pub(crate) fn run_to_end(mut command: Command) -> ProgramOutput {
    let output = command.output().unwrap();
    ProgramOutput {
        code: output.status.code(),
        out: String::from_utf8(output.stdout).unwrap(),
        err: String::from_utf8(output.stderr).unwrap(),
    }
}

/// Temporary folder of one test.
pub(crate) struct Lab(TempDir);

impl Lab {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// A path in the folder.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// A path in the folder as text, for arguments.
    pub(crate) fn text(&self, name: &str) -> String {
        text(&self.path(name))
    }

    /// Records the small campaign with `more` arguments, without analysis; returns the session's path.
    #[track_caller]
    pub(crate) fn record(&self, folder: &str, more: &[&str]) -> PathBuf {
        let sessions = self.text(folder);
        let mut arguments = vec!["run", SMALL, "--sessions", &sessions, "--no-analysis"];
        arguments.extend_from_slice(more);
        skinrig(&arguments).code(0);
        only(&self.path(folder), ".session.sqlite")
    }
}

/// A path as text, for arguments.
pub(crate) fn text(path: &Path) -> String {
    path.to_str().unwrap().to_owned()
}

/// Files of `folder` whose names end with `ending`, sorted.
pub(crate) fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return Vec::new();
    };
    let mut found: Vec<PathBuf> = entries
        .map(|e| e.unwrap().path())
        .filter(|p| text(p).ends_with(ending))
        .collect();
    found.sort();
    found
}

/// The only file of `folder` whose name ends with `ending`.
#[track_caller]
pub(crate) fn only(folder: &Path, ending: &str) -> PathBuf {
    let found = files(folder, ending);
    assert_eq!(found.len(), 1, "expected one *{ending}, found {found:?}");
    found[0].clone()
}

/// Writes results that were edited, with the digest of their new content.
#[track_caller]
pub(crate) fn write_results(path: &Path, mut document: Value) {
    document.as_object_mut().unwrap().remove("sha256");
    let text = serde_json::to_string_pretty(&document).unwrap();
    std::fs::write(path, with_digest(&text)).unwrap();
}

/// Parses a JSON file.
#[track_caller]
pub(crate) fn read_json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

/// `show --json --presses` of a session.
#[track_caller]
pub(crate) fn show(session: &Path) -> Value {
    skinrig(&["show", "--json", "--presses", &text(session)])
        .code(0)
        .json()
}

/// The bytes of each chunk of a camera.
pub(crate) fn chunks(session: &Path, camera: CameraId) -> Vec<Vec<u8>> {
    let reader = SessionReader::open(session).unwrap();
    let mut chunks = Vec::new();
    reader
        .for_each_chunk(camera, 0, |_, bytes| chunks.push(bytes.to_vec()))
        .unwrap();
    chunks
}

/// Lower-case hex SHA-256.
pub(crate) fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes)
        .iter()
        .map(|b| format!("{b:02x}"))
        .collect()
}

/// A small seeded generator of 64-bit numbers (SplitMix64, Steele, Lea and Flood 2014), for test data only.
pub(crate) struct SeededRandom(pub u64);

impl SeededRandom {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform below `n`, which is far below 2^64.
    pub(crate) fn below(&mut self, n: u64) -> u64 {
        self.next() % n
    }

    /// Uniform in 0..1.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }
}
