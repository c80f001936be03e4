//! A night on a terminal and as a page: order, content of each check, and escaping.

mod trends;

use skinrig_model::Limit;
use skinrig_nightly::judge::{RepeatRule, judge_attempt};
use skinrig_nightly::rules::apply_cross_check_rules;
use skinrig_nightly::{
    Cause, CheckResult, Evidence, EvidenceKind, GoldenSession, Measurement, Night, NightExit, Part,
    Verdict, Versions,
};
use skinrig_report::night::{Trends, html, tree};
use skinrig_text::Paint;

fn measured(metric: &str, value: Option<f64>, unit: &str, limit: Option<Limit>) -> Measurement {
    Measurement {
        metric: metric.to_owned(),
        value,
        unit: unit.to_owned(),
        interval: value.map(|v| [v * 0.9, v * 1.1]),
        n: Some(20),
        needs: 5,
        limit,
        verdict: Verdict::of_measurement(value, Some(20), 5, limit.as_ref()),
        note: None,
    }
}

fn part(subject: &str, measurements: Vec<Measurement>) -> Part {
    Part {
        subject: subject.to_owned(),
        verdict: Verdict::worst(measurements.iter().map(|m| m.verdict)),
        measurements,
    }
}

/// A check with the parts and evidence of each attempt.
fn check(name: &str, about: Cause, found: Vec<(Vec<Part>, Vec<Evidence>)>) -> CheckResult {
    let rule = RepeatRule {
        at_most: 2,
        must_pass: 2,
    };
    let attempts: Vec<_> = found
        .into_iter()
        .map(|(parts, evidence)| judge_attempt((0.0, 4.2), parts, evidence, about))
        .collect();
    let combined = rule.combine(&attempts);
    CheckResult {
        name: name.to_owned(),
        title: name.replace('_', " "),
        planned_s: 5.0,
        skipped: None,
        verdict: combined.verdict,
        repeats: combined.explanation,
        cause: combined.cause,
        rule: combined.rule,
        attempts,
        witnesses: Vec::new(),
    }
}

fn jitter(us: [Option<f64>; 2]) -> Vec<Part> {
    let limit = Some(Limit::at_most(20e-6).with_margin(5e-6));
    let one = |name, us: Option<f64>| {
        part(
            name,
            vec![
                measured(
                    "lost_pulses",
                    us.map(|_| 0.0),
                    "",
                    Some(Limit::at_most(0.0)),
                ),
                measured("jitter", us.map(|v| v * 1e-6), "s", limit),
            ],
        )
    };
    vec![one("camera1", us[0]), one("camera2", us[1])]
}

fn night(checks: Vec<CheckResult>) -> Night {
    let mut night = Night {
        version: 1,
        id: "2026-11-20T02-00-00Z-nightly".to_owned(),
        suite: "nightly".to_owned(),
        suite_sha256: "5".repeat(64),
        rig: "emulated".to_owned(),
        rig_kind: "emulated".to_owned(),
        rig_sha256: "7".repeat(64),
        versions: Versions {
            software: "skinrig 0.1.0".to_owned(),
            analysis: 3,
            firmware: vec![("robot".to_owned(), "3.1".to_owned())],
            skin: Some("golden <1>".to_owned()),
        },
        started: "2026-11-20T02:00:00Z".to_owned(),
        took_s: 371.0,
        planned_s: 340.0,
        budget_s: 1200.0,
        finished: true,
        ended_early: None,
        lease_note: None,
        notifications: Vec::new(),
        checks,
        golden: Some(GoldenSession {
            session: "golden.session.sqlite".to_owned(),
            report: Some("golden.report.html".to_owned()),
            results_sha256: None,
        }),
        verdict: Verdict::Fail,
        exit: NightExit::Fail,
    };
    apply_cross_check_rules(&mut night.checks);
    night.update_verdict();
    night
}

fn bad_night() -> Night {
    let absent = || {
        Evidence::new(
            EvidenceKind::Absent,
            "camera2",
            "expected an EVK1 with serial 00000002, found no camera <script>alert(1)</script>",
        )
        .next("look at the camera's cable and its port (USB 3, no hub), then `skinrig doctor`")
    };
    let mut drill = check("stop_drill", Cause::Rig, Vec::new());
    drill.verdict = Verdict::Skipped;
    drill.cause = None;
    drill.skipped = Some("the rig file does not permit it (`hil.drills`)".to_owned());
    let rmse = Some(Limit::at_most(5.0).with_margin(1.0));
    night(vec![
        check(
            "identity",
            Cause::Rig,
            vec![(
                vec![part(
                    "robot",
                    vec![measured(
                        "differences",
                        Some(0.0),
                        "",
                        Some(Limit::at_most(0.0)),
                    )],
                )],
                vec![],
            )],
        ),
        check(
            "trigger_loopback",
            Cause::Rig,
            vec![
                (jitter([Some(3.2), None]), vec![absent()]),
                (jitter([Some(3.1), Some(31.4)]), vec![]),
            ],
        ),
        check(
            "clocks",
            Cause::Rig,
            vec![
                (jitter([Some(30.0), Some(3.0)]), vec![]),
                (jitter([Some(3.0), Some(3.0)]), vec![]),
                (jitter([Some(3.0), Some(17.0)]), vec![]),
            ],
        ),
        check(
            "golden",
            Cause::Skin,
            vec![(
                vec![part(
                    "skin",
                    vec![
                        measured("rmse", Some(7.31), "mm", rmse),
                        measured("press_events", Some(123_456.0), "ev/s", None),
                    ],
                )],
                vec![],
            )],
        ),
        drill,
    ])
}

fn good_night() -> Night {
    let good = || (jitter([Some(3.2), Some(2.9)]), vec![]);
    night(vec![check("trigger_loopback", Cause::Rig, vec![good()])])
}

#[test]
fn the_tree_of_a_bad_night() {
    let text = tree(&bad_night(), Paint::new(false));
    for line in text.lines() {
        assert!(line.chars().count() <= 80, "{line}");
    }
    insta::assert_snapshot!("bad_night", text);
}

#[test]
fn the_tree_of_a_good_night() {
    insta::assert_snapshot!("good_night", tree(&good_night(), Paint::new(false)));
}

#[test]
fn colours_are_all_that_a_terminal_adds() {
    let coloured = tree(&bad_night(), Paint::new(true));
    let mut plain = String::new();
    let mut rest = coloured.as_str();
    while let Some((before, after)) = rest.split_once('\u{1b}') {
        plain.push_str(before);
        rest = after.split_once('m').map_or("", |(_, rest)| rest);
    }
    plain.push_str(rest);
    assert!(coloured.len() > plain.len());
    assert_eq!(plain, tree(&bad_night(), Paint::new(false)));
}

#[test]
fn what_a_device_says_neither_moves_the_cursor_nor_becomes_markup() {
    let mut night = bad_night();
    night.checks[1].attempts[0].evidence[0].what = "\u{1b}[2J<b>x</b> \u{7}".to_owned();
    assert!(!tree(&night, Paint::new(false)).contains(['\u{1b}', '\u{7}']));
    let page = html(&night, Trends::NotRequested);
    assert!(page.contains("&lt;b&gt;x"), "{page}");
    assert!(!page.contains("<b>x</b>"));
    assert!(!page.contains("<script>alert"));
}

/// Keeps a page for a look, in the folder that the variable names.
fn keep(name: &str, page: &str) {
    if let Some(folder) = std::env::var_os("SKINRIG_REPORT_OUT") {
        let _ = std::fs::write(std::path::Path::new(&folder).join(name), page);
    }
}

/// States of the four causes on the page: `rig bad, skin unknown, ...`.
fn places(page: &str) -> Vec<&str> {
    let after = page.split("class=\"card place ").skip(1);
    after.filter_map(|p| p.split('"').next()).collect()
}

#[test]
fn the_page_says_first_where_to_look() {
    let bad = html(&bad_night(), Trends::NotRequested);
    assert!(bad.contains("<h1 data-testid=\"headline\">Look at the rig</h1>"));
    // Skin: its campaign is unusable because the rig was at fault.
    assert_eq!(places(&bad), ["bad", "unknown", "ok", "ok"]);
    assert!(bad.contains("href=\"golden.report.html\""));
    assert!(bad.contains("data-testid=\"emulated\""));
    let good = html(&good_night(), Trends::NotRequested);
    keep("night-bad.html", &bad);
    keep("night-good.html", &good);
    assert!(good.contains(">All within limits</h1>"));
    assert_eq!(places(&good), ["ok", "unknown", "ok", "ok"]);
    let mut unfinished = good_night();
    unfinished.finished = false;
    let page = html(&unfinished, Trends::NotRequested);
    assert!(page.contains("data-testid=\"unfinished\""));
}

#[test]
fn the_page_loads_nothing_and_runs_only_its_own_script() {
    let page = html(&bad_night(), Trends::NotRequested);
    assert!(page.contains("default-src 'none'"));
    assert!(page.contains("script-src 'sha256-"));
    for foreign in ["http://", "https://", "src=\"", "@import", "<link"] {
        assert!(!page.contains(foreign), "{foreign}");
    }
}
