//! Trends on the page of a night: drift comes first, and names are escaped.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on must fail")]

use skinrig_nightly::trend::{History, NightSummary, Point, Report, judge};
use skinrig_nightly::{Night, Verdict};
use skinrig_report::night::{Trends, html};
use skinrig_report::trend::Links;

use crate::night::{bad_night, good_night, keep};

const HOSTILE: &str = "golden/<b>\u{1b}[2J/press_events";

/// Nights of two series of this check; those from `change` on are lower by a fifth.
fn report(series: &[&str], nights: usize, change: usize) -> Report {
    let mut history = History::default();
    for at in 0..nights {
        for name in series {
            let level = if at < change { 1.0 } else { 0.8 };
            let point = Point {
                night: at,
                value: Some(level * (1e5 + 1e3 * (at * 7 % 5) as f64)),
                interval: None,
                n: None,
                limit: None,
                verdict: Verdict::Pass,
                part: Verdict::Pass,
                attempts: 1,
            };
            history.add(name, "ev/s", point);
        }
        let mut night = good_night();
        night.id = format!("night-{at}");
        night.started = format!("2026-10-{:02}T02:00:00Z", at + 1);
        history.nights.push(NightSummary::of(&night, ""));
    }
    judge(&history)
}

fn page(night: &Night, report: &Report) -> String {
    let links = vec![
        Links {
            session: Some("a\"b".to_owned()),
            ..Links::default()
        };
        report.alarms.len()
    ];
    let trends = Trends::Available {
        report,
        links: &links,
        page: "trends.html",
    };
    html(night, trends)
}

fn headline(page: &str) -> &str {
    let after = page.split("<h1 data-testid=\"headline\">").nth(1).unwrap();
    after.split("</h1>").next().unwrap()
}

#[test]
fn what_moved_stands_in_the_headline_and_at_its_place() {
    let moved = report(&[HOSTILE], 30, 26);
    let good = page(&good_night(), &moved);
    keep("night-moved.html", &good);
    assert_eq!(
        headline(&good),
        "All within limits, but the skin probably moved"
    );
    assert_eq!(
        headline(&page(&bad_night(), &moved)),
        "Look at the rig; the skin probably moved"
    );
    assert_eq!(good.matches("has not moved").count(), 3);
    let skin = good.split("data-testid=\"place-2\"").nth(1).unwrap();
    let skin = skin.split("</div>").next().unwrap();
    assert!(
        skin.contains("probably moved, since the night of 2026-10-27"),
        "{skin}"
    );
    assert!(good.contains("href=\"a&quot;b\""));
    assert!(!good.contains('\u{1b}'));
    assert!(good.contains("&lt;b&gt;\\u{1b}[2J"), "{good}");

    let names = ["a", "b", "c", "d", "e", "f"].map(|m| format!("golden/skin/{m}"));
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    assert!(page(&good_night(), &report(&names, 30, 26)).contains("; and 2 more</p>"));
}

#[test]
fn nothing_is_said_to_have_stood_still_before_there_is_a_reference() {
    let steady = page(&good_night(), &report(&[HOSTILE], 30, 30));
    assert_eq!(headline(&steady), "All within limits");
    assert_eq!(steady.matches("has not moved").count(), 4);
    assert!(steady.contains("Trend: nothing moved in 30 nights (1 series)."));
    let young = page(&good_night(), &report(&[HOSTILE], 11, 11));
    assert!(young.contains("too few nights for trends: 11 of the 12"));
    assert!(!young.contains("has not moved"));
    let unavailable = html(&good_night(), Trends::Unavailable("<i>no</i> history"));
    assert!(unavailable.contains("No trends tonight: &lt;i&gt;no"));
    assert!(!unavailable.contains("has not moved"));
}
