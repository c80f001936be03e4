//! A whole suite.

use std::path::Path;

use serde::Serialize;
use sha2::{Digest, Sha256};
use skinrig_model::{HostDuration, Occasion};
use skinrig_settings::{Choice, Collector, Diagnostics, Field, Settings, open};

use super::catalogue;
use super::check::{Check, Measure};
use crate::file::hex;
use crate::notify::Notify;

/// A skinrig suite: checks of a bench, with limits set before the measurement.
#[derive(Debug, Clone, PartialEq, Serialize, Settings)]
#[settings(
    name = "suite",
    version = "skinrig_suite",
    check(Self::nights_are_notified)
)]
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
    /// Free text about the suite.
    pub description: Option<String>,
    /// Time limit of the whole suite, repeats included. A check that no longer fits is not started.
    #[setting(above = 0, max = 86_400, example = "20 min")]
    pub budget: HostDuration,
    /// Rules for repeating a check.
    #[setting(default)]
    pub repeats: Repeats,
    /// The checks, each with its limits.
    #[setting(shape = catalogue::CHECKS, read = catalogue::checks)]
    pub checks: Vec<Check>,
    /// Messages about nights; absent: the rig file's.
    pub notify: Option<Notify>,
}

/// Rules for repeating a failed check, and for the resulting verdict. The result keeps every attempt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Settings)]
#[settings(check(Self::can_pass, "at_most", "must_pass"))]
pub struct Repeats {
    /// Most repeats of a failed check; 0: never.
    #[setting(default = "2", max = 10)]
    pub at_most: u32,
    /// Consecutive passes after which a failed check counts as MARGINAL.
    #[setting(default = "2", min = 1, max = 10)]
    pub must_pass: u32,
}

impl Repeats {
    /// Rejects repeats after which no check can pass.
    fn can_pass(at_most: &u32, must_pass: &u32, root: &Field, out: &mut Collector) {
        if *at_most > 0 && must_pass > at_most {
            let field = root.at("must_pass");
            out.error(
                field.span,
                field.path.as_str(),
                "no repeated check can pass",
            )
            .expected(format!("at most the number of repeats ({at_most})"))
            .found(must_pass.to_string())
            .help("raise `at_most`, lower `must_pass`, or write `at_most: 0`: no repeats");
        }
    }
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

    /// Rejects a `notify` that no night would use.
    fn nights_are_notified(root: &Field, out: &mut Collector) {
        let on = root.at("notify.on");
        let occasions = on.items().iter().filter_map(Field::as_word);
        let occasions: Vec<Occasion> = occasions.filter_map(Occasion::from_word).collect();
        if on.path == "notify.on" && !occasions.iter().any(|o| o.is_of_a_night()) {
            let message = "no night has any of these occasions";
            out.error(on.span, on.path.as_str(), message)
                .expected("at least one of `night_...` and `trend_alarm`")
                .found("occasions of runs alone");
        }
    }

    /// Resolves paths against the folder of the file.
    fn in_folder(mut self, folder: &Path) -> Self {
        for check in &mut self.checks {
            if let Measure::Golden { protocol } | Measure::Reaction { protocol } =
                &mut check.measure
            {
                *protocol = folder.join(&protocol);
            }
        }
        if let Some(notify) = &mut self.notify {
            notify.in_folder(folder);
        }
        self
    }
}
