//! Owns the browser as a process: where it is, how it starts, that it ends.

use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

use serde_json::json;
use tempfile::TempDir;

use crate::devtools::{BrowserError, Devtools};
use crate::page::Page;

/// Names under which distributions install it.
const NAMES: [&str; 5] = [
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
];

/// Nothing that asks the network, and the same picture on every machine.
const FLAGS: [&str; 14] = [
    "--headless=new",
    "--remote-debugging-pipe",
    // As root, and in containers, there is no sandbox to be had; only files of the tests are opened.
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--disable-quic",
    "--disable-sync",
    "--disable-extensions",
    "--disable-component-update",
    "--disable-background-networking",
    "--no-first-run",
    "--no-default-browser-check",
    "--hide-scrollbars",
    "--force-color-profile=srgb",
];

/// The browser of this machine: what `SKINRIG_CHROMIUM` names, or else the first of the usual names in `PATH`.
///
/// # Errors
/// [`BrowserError::Absent`].
pub fn find() -> Result<PathBuf, BrowserError> {
    if let Some(named) = std::env::var_os("SKINRIG_CHROMIUM") {
        return Ok(named.into());
    }
    let folders = std::env::var_os("PATH").unwrap_or_default();
    let places = std::env::split_paths(&folders).collect::<Vec<_>>();
    let all = NAMES
        .iter()
        .flat_map(|name| places.iter().map(move |folder| folder.join(name)));
    all.into_iter().find(|path| path.is_file()).ok_or_else(|| {
        BrowserError::Absent(format!(
            "expected one of {} in PATH, or SKINRIG_CHROMIUM, found none",
            NAMES.join(", ")
        ))
    })
}

/// A running browser with a profile of its own; it ends with this value.
#[derive(Debug)]
pub struct Browser {
    process: Child,
    pub(crate) devtools: Devtools,
    profile: TempDir,
}

impl Browser {
    /// Starts it.
    ///
    /// # Errors
    /// [`BrowserError`] when there is none, or it does not start.
    pub fn start() -> Result<Self, BrowserError> {
        let program = find()?;
        let profile = tempfile::tempdir()?;
        // It reads from descriptor 3 and writes to 4: the shell lays our two pipes there.
        let mut process = Command::new("sh")
            .arg("-c")
            .arg(r#"exec "$0" "$@" 3<&0 4>&1 </dev/null >/dev/null"#)
            .arg(&program)
            .args(FLAGS)
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg("about:blank")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()?;
        let (Some(to), Some(from)) = (process.stdin.take(), process.stdout.take()) else {
            return Err(BrowserError::Silent("its pipes".into()));
        };
        let mut browser = Self {
            process,
            devtools: Devtools::new(to, from),
            profile,
        };
        let folder = browser.downloads();
        std::fs::create_dir(&folder)?;
        browser.devtools.call(
            None,
            "Browser.setDownloadBehavior",
            json!({ "behavior": "allow", "downloadPath": folder, "eventsEnabled": true }),
        )?;
        Ok(browser)
    }

    /// Where downloads go.
    #[must_use]
    pub fn downloads(&self) -> PathBuf {
        self.profile.path().join("downloads")
    }

    /// An empty page.
    ///
    /// # Errors
    /// [`BrowserError`].
    pub fn page(&mut self) -> Result<Page<'_>, BrowserError> {
        Page::new(self)
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // Asked first, so that its helpers go too and leave the profile alone.
        let asked = self.devtools.call(None, "Browser.close", json!({}));
        if asked.is_err() {
            let _ = self.process.kill();
        }
        let _ = self.process.wait();
    }
}
