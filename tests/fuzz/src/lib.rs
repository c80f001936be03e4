//! Fuzzing of untrusted input: one target per kind of input, and mutations that make inputs hostile.
//!
//! A [`Target`] accepts any bytes and returns. It must not panic, must not hold more memory than [`Bound`] allows, and must
//! terminate. The driver in `tests/hostile` runs every target over its corpus and over seeded mutations of it; target
//! functions also fit libFuzzer: `fuzz_target!(|data: &[u8]| skinrig_fuzz::target("raw").run(data))`.

pub mod mutate;
mod targets;

use std::path::{Path, PathBuf};

pub use targets::{all, target};

/// Maximum memory held by a target, in bytes allocated by Rust code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bound {
    /// Independent of the input.
    pub fixed: usize,
    /// Per input byte.
    pub per_byte: usize,
}

impl Bound {
    /// The bound for an input of this length.
    #[must_use]
    pub const fn of(self, input: usize) -> usize {
        self.fixed + self.per_byte * input
    }
}

/// One kind of untrusted input.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// Name, also of its folder in the corpus.
    pub name: &'static str,
    /// Processes any bytes.
    pub function: fn(&[u8]),
    /// Memory bound.
    pub bound: Bound,
    /// Number of mutations in a short run, so that all targets together take seconds.
    pub cases: u64,
    /// Maximum length of a generated input.
    pub longest: usize,
    /// Tokens of the format.
    pub dictionary: &'static [&'static [u8]],
    /// Further corpus files elsewhere in the workspace: folder and suffix.
    pub elsewhere: &'static [(&'static str, &'static str)],
}

impl Target {
    /// Runs the target on these bytes.
    pub fn run(&self, bytes: &[u8]) {
        (self.function)(bytes);
    }

    /// Corpus files, sorted.
    ///
    /// # Errors
    /// When a folder cannot be listed.
    pub fn corpus(&self) -> std::io::Result<Vec<PathBuf>> {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let own = format!("tests/fuzz/corpus/{}", self.name);
        let mut files = Vec::new();
        for (folder, ending) in [(own.as_str(), "")].iter().chain(self.elsewhere) {
            let entries = match std::fs::read_dir(root.join(folder)) {
                // Some kinds have all their files elsewhere.
                Err(e) if e.kind() == std::io::ErrorKind::NotFound && *folder == own => continue,
                entries => entries?,
            };
            for entry in entries {
                let path = entry?.path();
                if path.is_file() && path.to_string_lossy().ends_with(ending) {
                    files.push(path);
                }
            }
        }
        files.sort();
        Ok(files)
    }
}
