//! Owns the browser process: finding, starting and ending it.

use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

use serde_json::json;
use tempfile::TempDir;

use crate::devtools::{BrowserError, Devtools};
use crate::page::Page;

/// Executable names used by distributions.
const NAMES: [&str; 5] = [
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
];

/// No network access, and identical rendering on every machine.
const FLAGS: [&str; 14] = [
    "--headless=new",
    "--remote-debugging-pipe",
    // There is no sandbox for root and in containers; only files of the tests are opened.
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

/// The browser of this machine: `SKINRIG_CHROMIUM`, or the first common name in `PATH`.
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

/// A running browser with its own profile; dropping this value ends it.
#[derive(Debug)]
pub struct Browser {
    process: Child,
    pub(crate) devtools: Devtools,
    profile: TempDir,
}

impl Browser {
    /// Starts the browser.
    ///
    /// # Errors
    /// [`BrowserError`] when there is no browser, or it does not start.
    pub fn start() -> Result<Self, BrowserError> {
        let program = find()?;
        let profile = tempfile::tempdir()?;
        // It reads from descriptor 3 and writes to 4; the shell connects our two pipes.
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

    /// Folder of downloads.
    #[must_use]
    pub fn downloads(&self) -> PathBuf {
        self.profile.path().join("downloads")
    }

    /// Opens an empty page.
    ///
    /// # Errors
    /// [`BrowserError`].
    pub fn page(&mut self) -> Result<Page<'_>, BrowserError> {
        Page::new(self)
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // Ask it to close first, so that its helper processes end too and leave the profile alone.
        let requested = self.devtools.call(None, "Browser.close", json!({}));
        if requested.is_err() {
            let _ = self.process.kill();
        }
        let _ = self.process.wait();
    }
}
