//! What foreign bytes can do to skinrig: nothing. One target per kind of input, and the mutations that make inputs hostile.
//!
//! A [`Target`] takes any bytes and returns. It must not panic, must not hold more memory than [`Bound`] says, and must end.
//! The driver in `tests/hostile` runs every target over its corpus and over seeded mutations of it; a target function is also
//! what libFuzzer wants: `fuzz_target!(|data: &[u8]| skinrig_fuzz::target("raw").run(data))`.

pub mod mutate;
mod targets;

use std::path::{Path, PathBuf};

pub use targets::{all, target};

/// Most memory that a target may hold at once, in bytes allocated by Rust code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bound {
    /// Whatever the input.
    pub fixed: usize,
    /// More for each of its bytes.
    pub per_byte: usize,
}

impl Bound {
    /// The bound for an input of this length.
    #[must_use]
    pub const fn of(self, input: usize) -> usize {
        self.fixed + self.per_byte * input
    }
}

/// One kind of foreign input.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// Its name, and that of its folder in the corpus.
    pub name: &'static str,
    /// Takes any bytes.
    pub function: fn(&[u8]),
    /// Most memory that it may hold.
    pub bound: Bound,
    /// Mutations that a bounded run makes, so that all targets together take seconds.
    pub cases: u64,
    /// Longest input that is made.
    pub longest: usize,
    /// Words of the format.
    pub dictionary: &'static [&'static [u8]],
    /// Further files of the corpus elsewhere in the workspace: folder and ending.
    pub elsewhere: &'static [(&'static str, &'static str)],
}

impl Target {
    /// Gives it these bytes.
    pub fn run(&self, bytes: &[u8]) {
        (self.function)(bytes);
    }

    /// The files of its corpus, sorted.
    ///
    /// # Errors
    /// When a folder cannot be listed.
    pub fn corpus(&self) -> std::io::Result<Vec<PathBuf>> {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let own = format!("tests/fuzz/corpus/{}", self.name);
        let mut files = Vec::new();
        for (folder, ending) in [(own.as_str(), "")].iter().chain(self.elsewhere) {
            let entries = match std::fs::read_dir(root.join(folder)) {
                // Some kinds have all of theirs elsewhere.
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
