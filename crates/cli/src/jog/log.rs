//! The log of a jog: every command, every reply, and the tip position ten times a second.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use skinrig_model::{HostTime, PoseSample};

use crate::exit::Failure;

/// An open log.
pub(super) struct Log {
    path: PathBuf,
    file: File,
    broken: bool,
}

impl Log {
    /// A new log at `path`, which must not exist.
    ///
    /// # Errors
    /// [`Failure::internal`] when it cannot be created.
    pub(super) fn create(path: &Path) -> Result<Self, Failure> {
        let refused = |e: std::io::Error| {
            Failure::internal(format!(
                "cannot write the log {}: {e}\n  next: choose another file with --log",
                path.display()
            ))
        };
        if let Some(folder) = path.parent().filter(|f| !f.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder).map_err(refused)?;
        }
        Ok(Self {
            path: path.to_owned(),
            file: File::create_new(path).map_err(refused)?,
            broken: false,
        })
    }

    /// Path of the log.
    #[must_use]
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Writes one line.
    pub(super) fn line(&mut self, t: HostTime, kind: &str, text: &str) {
        let text = text.replace('\n', " | ");
        let written = writeln!(self.file, "{:.3}\t{kind}\t{text}", t.as_secs_f64());
        // A log that fails must not strand the robot: warn once and continue.
        if written.is_err() && !std::mem::replace(&mut self.broken, true) {
            errln!("warning: cannot write the log {}", self.path.display());
        }
    }

    /// Writes the positions of the tip.
    pub(crate) fn path_of_tip(&mut self, trace: &[PoseSample]) {
        for p in trace {
            let [x, y, z] = p.measured.to_array();
            let text = format!("{x:.3} {y:.3} {z:.3} mm {:.3} N", p.force_n);
            self.line(p.t, "tip", &text);
        }
    }
}
