//! A whole suite.

use std::path::Path;

use serde::Serialize;
use sha2::{Digest, Sha256};
use skinrig_model::HostDuration;
use skinrig_settings::{Diagnostics, Settings, open};

use super::catalogue;
use super::check::{Check, Measure};
use crate::file::hex;

/// A skinrig suite: what is checked on a bench, with limits that are stated before anything is measured.
#[derive(Debug, Clone, PartialEq, Serialize, Settings)]
#[settings(name = "suite", version = "skinrig_suite")]
pub struct Suite {
    /// The file's name as given to [`Suite::parse`].
    #[setting(skip)]
    pub file_name: String,
    /// The text as the user wrote it, byte for byte.
    #[setting(skip)]
    pub text: String,
    /// Lower-case hex SHA-256 of the text.
    #[setting(skip)]
    pub sha256: String,
    /// Name of the suite. Every result shows it.
    #[setting(example = "nightly")]
    pub name: String,
    /// Anything worth keeping about it.
    pub description: Option<String>,
    /// How long the whole suite may take, repeats included. A check that no longer fits is not started.
    #[setting(above = 0, max = 86_400, example = "20 min")]
    pub budget: HostDuration,
    /// When a check is repeated.
    #[setting(default)]
    pub repeats: Repeats,
    /// The checks, each with its limits.
    #[setting(shape = catalogue::CHECKS, read = catalogue::checks)]
    pub checks: Vec<Check>,
}

/// When a check that did not pass is repeated, and when that changes its verdict. Every attempt stays in the result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Settings)]
pub struct Repeats {
    /// How often a check that did not pass is repeated; 0: never.
    #[setting(default = "2", max = 10)]
    pub at_most: u32,
    /// Attempts in a row that must pass before a check counts as passed after a failure, and then as MARGINAL.
    #[setting(default = "2", min = 1, max = 10)]
    pub must_pass: u32,
}

impl Suite {
    /// Reads a suite from the bytes of a file named `name`. Paths in it are relative to its folder.
    ///
    /// # Errors
    /// [`Diagnostics`] with every finding at once.
    pub fn parse(name: &str, bytes: &[u8]) -> Result<Self, Diagnostics> {
        let (mut out, root) = open(name, bytes, &[], Self::TABLE)?;
        match root.and_then(|root| Self::from_mapping(&root, &mut out)) {
            Some(suite) if out.is_clean() => Ok(Self {
                file_name: name.to_owned(),
                text: String::from_utf8_lossy(bytes).into_owned(),
                sha256: hex(&Sha256::digest(bytes)),
                ..suite.in_folder(Path::new(name).parent().unwrap_or(Path::new("")))
            }),
            _ => Err(out.finish()),
        }
    }

    /// Resolves paths against the folder of the file.
    fn in_folder(mut self, folder: &Path) -> Self {
        for check in &mut self.checks {
            if let Measure::Golden { protocol } = &mut check.measure {
                *protocol = folder.join(&protocol);
            }
        }
        self
    }
}
