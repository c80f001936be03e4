//! The report of a real run on the simulated rig, in a headless Chromium. Screenshots for visual inspection are in
//! `target/browser/`.
#![expect(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test that cannot drive the browser must fail, and one that has none must say so"
)]

mod acting;
mod comparison;
mod downloads;
mod latency;
mod reading;
mod view;

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use serde_json::Value;
use skinrig::exit::Exit;
use skinrig_browser::{Browser, BrowserError, Page, Size};

/// A run at two depths, its results and its report.
struct Session {
    report: PathBuf,
    results: Value,
}

impl Session {
    fn presses(&self) -> &[Value] {
        self.results["analysis"]["presses"].as_array().unwrap()
    }

    /// Number of presses that `like` accepts.
    fn count(&self, like: impl Fn(&Value) -> bool) -> usize {
        self.presses().iter().filter(|p| like(p)).count()
    }

    fn id(&self) -> &str {
        self.results["provenance"]["session_id"].as_str().unwrap()
    }
}

/// True for the presses shown in the error figures.
fn counted(press: &Value) -> bool {
    press["role"] == "score"
        && press["verdict"] == "valid"
        && !press["truth"].is_null()
        && press["location_outcome"]["at"].is_object()
}

fn picture_folder() -> PathBuf {
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().unwrap();
    target.join("browser")
}

fn skinrig(arguments: &[&str]) {
    let all = std::iter::once("skinrig").chain(arguments.iter().copied());
    let exit = skinrig::main_with(all.map(OsString::from));
    assert!(matches!(exit, Exit::Ok), "skinrig {arguments:?}");
}

/// The session shared by all tests of this program.
fn session() -> &'static Session {
    static SESSION: OnceLock<Session> = OnceLock::new();
    SESSION.get_or_init(|| {
        let folder = picture_folder().join("session");
        let _ = std::fs::remove_dir_all(&folder);
        let protocol = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../protocols/depth-sweep.yaml"
        );
        let to = folder.to_str().unwrap();
        skinrig(&[
            "run",
            protocol,
            "--sessions",
            to,
            "--set",
            "path.random.count=12",
            "--set",
            "depths=[1 mm, 2 mm]",
        ]);
        let ending = |ending: &str| {
            let files = std::fs::read_dir(&folder)
                .unwrap()
                .map(|f| f.unwrap().path());
            let mut found = files.filter(|f| f.to_string_lossy().ends_with(ending));
            found.next().unwrap()
        };
        let file = ending(".session.sqlite");
        let file = file.to_str().unwrap();
        skinrig(&["tradeoff", file, "--repeats", "1"]);
        skinrig(&["report", file]);
        let results = std::fs::read(ending(".results.json")).unwrap();
        Session {
            report: ending(".report.html"),
            results: serde_json::from_slice(&results).unwrap(),
        }
    })
}

/// Runs a test on a page; prints a note and passes without a browser, before `file` is called.
fn with_page<'a>(file: impl FnOnce() -> &'a Path, test: impl FnOnce(&mut Page<'_>)) {
    let mut browser = match Browser::start() {
        Ok(browser) => browser,
        Err(BrowserError::Absent(reason)) => {
            println!("skipped: no browser: {reason}");
            return;
        }
        Err(e) => panic!("{e}"),
    };
    let file = file();
    let mut page = browser.page().unwrap();
    page.open(file).unwrap();
    test(&mut page);
}

/// Runs a test with the report open.
fn with_report(test: impl FnOnce(&mut Page<'_>, &Session)) {
    with_page(|| &session().report, |page| test(page, session()));
}

/// Asserts that a page on a phone does not scroll sideways, and saves its picture.
fn check_phone(page: &mut Page<'_>, name: &str) {
    page.resize(Size::PHONE).unwrap();
    let width = page
        .evaluate("document.documentElement.scrollWidth")
        .unwrap();
    assert!(
        width.as_u64().unwrap() <= u64::from(Size::PHONE.width),
        "{width}"
    );
    save_picture(page, name, true);
    let misfits = reading::misfits(page);
    assert!(misfits.is_empty(), "{misfits:#?}");
}

/// Saves a screenshot of the page.
fn save_picture(page: &mut Page<'_>, name: &str, whole: bool) {
    let folder = picture_folder();
    std::fs::create_dir_all(&folder).unwrap();
    let picture = page.picture(whole).unwrap();
    std::fs::write(folder.join(format!("{name}.png")), picture).unwrap();
}
