//! Presentation of trends: names are escaped, and every line fits a terminal of 80 columns.

use skinrig_nightly::trend::{History, NightSummary, Point, Report, judge};
use skinrig_nightly::{Verdict, Versions};
use skinrig_report::trend::{Links, Style, page, terminal};

const HOSTILE: &str = "golden/<script>alert(1)</script>\u{1b}[2J/press_events";

/// 40 nights; the last four are lower by a fifth.
fn report() -> Report {
    after(40)
}

fn after(nights: usize) -> Report {
    let mut history = History::default();
    for night in 0..nights {
        let wobble = (night * 7 % 5) as f64;
        let level = if night < 36 { 1.0 } else { 0.8 };
        for name in [HOSTILE, "disk/computer/write_rate"] {
            let level = if name == HOSTILE { level } else { 1.0 };
            let point = Point {
                night,
                value: Some(level * (1e5 + 1e3 * wobble)),
                interval: None,
                n: None,
                limit: None,
                verdict: Verdict::Pass,
                part: Verdict::Pass,
                attempts: 1,
            };
            history.add(name, "ev/s", point);
        }
        history.nights.push(NightSummary {
            id: format!("night-{night}"),
            started: format!("2026-10-{:02}T02:00:00Z", night % 31 + 1),
            suite: "nightly".to_owned(),
            suite_sha256: String::new(),
            rig: "<b>".to_owned(),
            rig_kind: "emulated".to_owned(),
            rig_sha256: String::new(),
            versions: Versions::default(),
            verdict: Verdict::Pass,
            folder: String::new(),
            golden: None,
        });
    }
    judge(&history)
}

#[test]
fn the_page_shows_the_alarm_first_and_names_as_text() {
    let report = report();
    let links = Links {
        night: Some("a\"b".to_owned()),
        session: None,
        commands: vec!["skinrig run --replay 'x<y'".to_owned()],
        missing: None,
    };
    let html = page(&report, &[links], &[]);
    if let Some(folder) = std::env::var_os("SKINRIG_REPORT_OUT") {
        std::fs::write(std::path::Path::new(&folder).join("trends.html"), &html).unwrap();
    }
    // Only the page's own script, and nothing else that starts like one.
    assert_eq!(html.matches("<script").count(), 1);
    assert!(!html.contains("<b>") && !html.contains('\u{1b}'));
    assert!(html.contains("href=\"a&quot;b\"") && html.contains("x&lt;y"));
    let alarm = html.find("data-testid=\"alarm\"").unwrap();
    assert!(alarm < html.find("data-testid=\"series\"").unwrap());
    assert!(html.contains("-20 %"));
}

/// A first night has no references: its series are there on request, under names instead of identifiers.
#[test]
fn series_without_a_reference_are_folded_and_have_names() {
    let html = page(&after(1), &[], &[]);
    let (_, rest) = html.split_once("data-testid=\"learning\"").unwrap();
    let (folded, _) = rest.split_once("</details>").unwrap();
    assert!(folded.starts_with('>'), "open: {}", &folded[..20]);
    assert!(
        folded.contains(">computer: write rate (disk)</th>"),
        "{folded}"
    );
    assert!(!html.contains("data-testid=\"series\""));
    let known = page(&report(), &[Links::default()], &[]);
    assert!(!known.contains("data-testid=\"learning\""));
    assert!(known.contains(">computer: write rate (disk)</th>"));
    assert!(!known.contains(">disk/computer/write_rate"));
}

#[test]
fn a_terminal_of_80_columns_holds_it_with_ascii_alone() {
    let report = report();
    let style = Style {
        unicode: false,
        color: false,
        nights: 60,
    };
    let text = terminal(&report, &[Links::default()], |_| true, style);
    assert!(text.contains("probable cause: the skin"), "{text}");
    for line in text.lines() {
        assert!(line.chars().count() <= 80, "{line}");
    }
    assert!(text.is_ascii() || text.contains('\u{fffd}'), "{text}");
    let only = terminal(
        &report,
        &[Links::default()],
        |n| n.starts_with("disk"),
        style,
    );
    let after = only.split("series  ").last().unwrap();
    assert!(after.contains("disk/computer/write_rate") && !after.contains("press_events"));
    let wide = Style {
        unicode: true,
        ..style
    };
    assert!(terminal(&report, &[Links::default()], |_| true, wide).contains('●'));
}
