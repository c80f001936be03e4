//! Shared by the tests of this crate: shipped files and a loader.

use std::path::{Path, PathBuf};

use skinrig_protocol::{Diagnostics, Protocol};

/// The folder of shipped protocols.
pub(crate) fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../protocols")
}

/// The text of a shipped file.
pub(crate) fn shipped(name: &str) -> String {
    std::fs::read_to_string(folder().join(name)).unwrap()
}

/// A loader that finds no file.
pub(crate) fn no_file(_: &Path) -> std::io::Result<Vec<u8>> {
    Err(std::io::Error::from(std::io::ErrorKind::NotFound))
}

/// Parses a text with overrides.
pub(crate) fn parse(text: &str, overrides: &[&str]) -> Result<Protocol, Diagnostics> {
    let overrides: Vec<String> = overrides.iter().map(|s| (*s).to_owned()).collect();
    Protocol::parse("test.yaml", text.as_bytes(), &overrides, &no_file)
}

/// The demo with overrides; panics with its findings if there are any.
pub(crate) fn demo(overrides: &[&str]) -> Protocol {
    parse(&shipped("demo.yaml"), overrides).unwrap_or_else(|e| panic!("{e}"))
}
