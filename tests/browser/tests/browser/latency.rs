//! Time from an event to its pixel on the page of `skinrig view`, with ten pages open. Takes as long as the run, so it is ignored.

use std::path::{Path, PathBuf};

use serde_json::json;
use skinrig::library::Program;
use skinrig_browser::{Browser, BrowserError, Page};
use skinrig_view::{Options, Server};

use crate::{picture_folder, save_picture, skinrig};

/// Open pages, in two browsers.
const PAGES: usize = 10;
/// Step of the times at which events are assumed, s.
const STEP_S: f64 = 0.001;

/// Collects when pictures were taken by the run, and when they were on the screen, s since 1970.
const COLLECT: &str = "window.drawn = []; new PerformanceObserver(list => { for (const mark of list.getEntriesByName('pictures')) \
    if (mark.detail) window.drawn.push([mark.detail, (performance.timeOrigin + mark.startTime) / 1000]); }).observe({ entryTypes: ['mark'] }); true";

/// Ages at the time of display of events that are spread evenly over the run, s, in order.
fn ages(drawn: &[(f64, f64)]) -> Vec<f64> {
    let mut ages = Vec::new();
    for pair in drawn.windows(2) {
        let (before, (taken, shown)) = (pair[0].0, pair[1]);
        let steps = ((taken - before) / STEP_S).round() as u32;
        // Events between two pictures wait for the later one.
        ages.extend((0..steps).map(|n| shown - before - f64::from(n) * STEP_S));
    }
    ages.sort_by(f64::total_cmp);
    ages
}

fn session_in(folder: &Path) -> PathBuf {
    loop {
        let files = std::fs::read_dir(folder).into_iter().flatten();
        let mut files = files.map(|f| f.unwrap().path());
        if let Some(file) = files.find(|f| f.to_string_lossy().ends_with(".session.sqlite")) {
            return file;
        }
        std::thread::yield_now();
    }
}

/// A browser, if there is one.
fn browser() -> Option<Browser> {
    match Browser::start() {
        Ok(browser) => Some(browser),
        Err(BrowserError::Absent(reason)) => {
            println!("skipped: no browser: {reason}");
            None
        }
        Err(e) => panic!("{e}"),
    }
}

/// Opens `count` tabs of the page.
fn open_tabs(page: &mut Page<'_>, link: &str, count: usize) {
    for _ in 0..count {
        page.call("Target.createTarget", json!({ "url": link }))
            .unwrap();
    }
}

#[test]
#[ignore = "a run in real time: SKINRIG_CI_LONG=1 .ci/run, or cargo test --workspace --locked --test browser -- --ignored --nocapture"]
fn events_reach_the_page_soon_and_none_is_lost() {
    let (Some(mut first), Some(mut second)) = (browser(), browser()) else {
        return;
    };
    let folder = picture_folder().join("live");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    let to = folder.to_str().unwrap().to_owned();
    let run = std::thread::spawn(move || {
        let protocol = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../protocols/depth-sweep.yaml"
        );
        let run = [
            "run",
            protocol,
            "--sessions",
            &to,
            "--real-time",
            "--no-analysis",
        ];
        let set = ["--set", "path.random.count=4", "--set", "depths=[2 mm]"];
        skinrig(&[&run[..], &set].concat());
    });
    let session = session_in(&folder);
    let name = session.file_name().unwrap().to_str().unwrap();
    let options = Options {
        folder: folder.clone(),
        first: Some(name.to_owned()),
        bind: Options::LOOPBACK,
        control: false,
    };
    let server = Server::open(options, Program).unwrap();
    let link = server.link();
    std::thread::spawn(move || server.run_until(std::future::pending()));
    let (mut page, mut other) = (first.page().unwrap(), second.page().unwrap());
    // A browser opens six connections to a server at most.
    open_tabs(&mut page, &link, PAGES / 2 - 1);
    open_tabs(&mut other, &link, PAGES / 2);
    page.call("Page.bringToFront", json!({})).unwrap();
    page.visit(&link).unwrap();
    page.evaluate(COLLECT).unwrap();
    page.wait_for("window.drawn.length > 200").unwrap();
    save_picture(&mut page, "view-live", true);
    run.join().unwrap();
    let drawn = page.evaluate("window.drawn").unwrap();
    let drawn: Vec<(f64, f64)> = serde_json::from_value(drawn).unwrap();
    let ages = ages(&drawn);
    let quantile = |share: f64| ages[((ages.len() - 1) as f64 * share) as usize] * 1e3;
    println!(
        "{} pictures; event to pixel: median {:.0} ms, p95 {:.0} ms, p99 {:.0} ms; {PAGES} pages",
        drawn.len(),
        quantile(0.5),
        quantile(0.95),
        quantile(0.99),
    );
    let reader = skinrig_recorder::SessionReader::open(&session).unwrap();
    for camera in skinrig_model::CameraId::ALL {
        let chunks = reader.chunk_index(camera).unwrap();
        assert!(!chunks.is_empty());
        assert_eq!(chunks.iter().map(|c| c.lost_before).sum::<u64>(), 0);
    }
    let notes = reader.notes().unwrap();
    assert!(
        !notes.iter().any(|n| n.text.starts_with("recorder:")),
        "{notes:?}"
    );
    skinrig(&["verify", session.to_str().unwrap()]);
}
