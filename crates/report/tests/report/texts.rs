//! Snapshots of the terminal table and the JSON document.

use crate::support;
use skinrig_analysis::result::AlignmentViolation;
use skinrig_analysis::timebase::CameraClockError;
use skinrig_model::CameraId;
use skinrig_report::{
    JSON_VERSION, Provenance, ReportInput, Variant, json, terminal_summary, terminal_table,
};

#[test]
fn terminal_table_reads_like_this() {
    let analysis = support::analysis(16, 10);
    let input = ReportInput {
        analysis: &analysis,
        provenance: support::provenance(),
        tradeoff: None,
        scene: None,
    };
    let table = terminal_table(&input, false);
    insta::assert_snapshot!("terminal_table", table);
    assert!(table.lines().all(|l| l.chars().count() <= 80), "{table}");
    let colored = terminal_table(&input, true);
    assert!(colored.contains("\x1b[33m"));
    let bare = colored
        .replace("\x1b[33m", "")
        .replace("\x1b[1m", "")
        .replace("\x1b[0m", "");
    assert_eq!(bare, table, "colour changes the layout");
}

#[test]
fn terminal_table_of_an_empty_session() {
    let analysis = support::empty();
    let provenance = Provenance {
        run_end: "faulted".into(),
        run_end_reason: Some("camera 2 stopped answering".into()),
        ..Default::default()
    };
    let input = ReportInput {
        analysis: &analysis,
        provenance,
        tradeoff: None,
        scene: None,
    };
    insta::assert_snapshot!("terminal_table_empty", terminal_table(&input, false));
}

#[test]
fn a_terminal_gets_no_foreign_control_characters() {
    let mut analysis = support::analysis(3, 2);
    analysis.warnings = ["\x1b]0;title\x07 and\x1b[2J".to_owned(), "w".repeat(300)]
        .map(support::warning)
        .into();
    let mut provenance = support::provenance();
    provenance.session_id = "a\x1b[31mb".into();
    let table = terminal_table(
        &ReportInput {
            analysis: &analysis,
            provenance,
            tradeoff: None,
            scene: None,
        },
        false,
    );
    assert!(
        table.chars().all(|c| c == '\n' || !c.is_control()),
        "{table:?}"
    );
    assert!(table.lines().all(|l| l.chars().count() <= 80), "{table}");
}

#[test]
fn counts_that_do_not_add_up_are_called_out() {
    let mut analysis = support::analysis(3, 2);
    analysis.counts.valid += 1;
    let input = ReportInput {
        analysis: &analysis,
        provenance: support::provenance(),
        tradeoff: None,
        scene: None,
    };
    assert!(terminal_table(&input, false).contains("do not add up"));
    assert!(skinrig_report::html(&input).contains("do not add up"));
}

/// If the clocks of a session are unknown, its numbers never appear as results.
#[test]
fn an_invalid_session_says_so_in_the_place_of_every_metric() {
    let mut analysis = support::analysis(16, 10);
    let read = |analysis: &_| {
        let input = ReportInput {
            analysis,
            provenance: support::provenance(),
            tradeoff: None,
            scene: None,
        };
        let page = skinrig_report::html(&input);
        (terminal_table(&input, false), json(&input), page)
    };
    let (table, document, page) = read(&analysis);
    let rmse = format!("{:.2}", analysis.scored.rmse_mm.value.unwrap());
    assert!(
        table.contains(&rmse) && !table.contains("INVALID"),
        "{table}"
    );
    assert_eq!(document["valid"], true);
    assert!(
        !page.contains("data-testid=\"invalid\"") && page.contains("data-testid=\"alignment\"")
    );

    analysis.alignment.status = skinrig_analysis::result::AlignmentStatus::Invalid;
    analysis.alignment.violations = vec![AlignmentViolation::NoTrainsClock {
        camera: CameraId::Two,
        why: CameraClockError::NoTrain,
    }];
    let (table, document, page) = read(&analysis);
    insta::assert_snapshot!("terminal_table_invalid", table);
    assert!(!table.contains(&rmse), "{table}");
    assert_eq!(document["valid"], false);
    assert_eq!(document["comparison"][0]["session"], "INVALID");
    let banner = "data-testid=\"invalid\"><strong>INVALID.</strong>";
    assert!(page.contains(banner) && page.contains("expected a clock, found none"));
    let hero = page.split("data-testid=\"metric-rmse\"").nth(1).unwrap();
    let hero = &hero[..hero.find("</div>").unwrap()];
    assert!(hero.contains("INVALID") && !hero.contains(&rmse), "{hero}");

    // A finding that invalidates the errors has the same effect.
    analysis.alignment.status = skinrig_analysis::result::AlignmentStatus::Valid;
    analysis.alignment.violations.clear();
    analysis.findings = support::studies::findings();
    assert!(analysis.is_valid());
    analysis.findings[0].invalidates = true;
    let (table, document, _) = read(&analysis);
    assert!(
        table.contains("INVALID   cameras swapped: ") && !table.contains(&rmse),
        "{table}"
    );
    let evidence = analysis.findings[0].evidence.to_string();
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert_eq!(words(&table).matches(&*evidence).count(), 1, "{table}");
    assert_eq!(document["valid"], false);
    assert_eq!(document["summary"]["valid"], false);
}

#[test]
fn json_document_has_this_layout() {
    let mut analysis = support::analysis(2, 2);
    analysis.presses.truncate(4);
    analysis.findings = support::studies::findings();
    let mut reference = support::studies::reference();
    reference.reduction.truncate(1);
    analysis.reference = Some(reference);
    // The layout needs one row of each kind, not hundreds.
    if let Some(latency) = &mut analysis.latency {
        latency.onsets.truncate(2);
        latency.sweep.truncate(2);
        for rates in &mut latency.course.press_per_s {
            rates.truncate(2);
        }
    }
    for curve in analysis.reduction.iter_mut().flat_map(|r| &mut r.curves) {
        curve.rows.truncate(1);
    }
    if let Some(calibration) = &mut analysis.calibration {
        calibration.correlation.truncate(1);
        calibration.compared.truncate(1);
    }
    let input = ReportInput {
        analysis: &analysis,
        provenance: support::provenance(),
        tradeoff: None,
        scene: None,
    };
    let document = json(&input);
    assert_eq!(document["format_version"], JSON_VERSION);
    insta::assert_snapshot!(
        "json",
        serde_json::to_string_pretty(&blunt(document)).unwrap()
    );
}

/// The answer comes first, and what qualifies it never scrolls it away.
#[test]
fn the_summary_answers_first_in_few_lines() {
    let mut analysis = support::analysis(16, 10);
    let summary_of = |analysis: &skinrig_analysis::Analysis, provenance: Provenance| {
        let input = ReportInput {
            analysis,
            provenance,
            tradeoff: None,
            scene: None,
        };
        let text = terminal_summary(&input, false);
        assert!(text.lines().count() <= 8, "{text}");
        assert!(text.lines().all(|l| l.chars().count() <= 80), "{text}");
        text
    };
    let summary = |analysis: &_| summary_of(analysis, support::provenance());
    insta::assert_snapshot!("terminal_summary", summary(&analysis));
    analysis.warnings = (0..20)
        .map(|i| support::warning(format!("warning {i} {}", "long ".repeat(60))))
        .collect();
    let many = summary(&analysis);
    assert!(many.starts_with("RMSE  "), "{many}");
    assert!(many.contains(" more: see the report"), "{many}");
    // Where hardly a line is left, the gravest remark is cut, not left out.
    let fault = skinrig_analysis::result::Fault::ClockWrong;
    let grave = skinrig_analysis::result::WarningCause::UnsuitableSettings { fault };
    analysis.warnings.push(grave.into());
    let mut provenance = support::provenance();
    provenance.variant = Some(Variant {
        name: "v".to_owned(),
        changed: vec!["analysis.window_before=3s".to_owned(); 3],
        reference_code: false,
        calibration_from: None,
        selection: None,
    });
    let cut = summary_of(&analysis, provenance);
    assert!(
        cut.contains("warning   the analysis settings do not suit"),
        "{cut}"
    );
    assert!(cut.contains(" more: see the report"), "{cut}");
    analysis.findings = support::studies::findings();
    let found = summary(&analysis);
    assert!(found.starts_with("FAULT     cameras swapped; "), "{found}");
    assert!(found.contains("do        check which camera"), "{found}");
}

/// The summary must contain everything that a reader needs; only details are left to the full table.
#[test]
fn the_summary_shows_what_qualifies_the_answer() {
    let mut analysis = support::analysis(16, 10);
    analysis.scored.rmse_mm.value = None;
    analysis.off_sensor[0].events = 3;
    let mut provenance = support::provenance();
    provenance.interruptions = vec![skinrig_report::InterruptionRow {
        kind: "fault".to_owned(),
        t_s: 2.5,
        reason: "camera 1 sent nothing".to_owned(),
        ended_run: false,
    }];
    let input = ReportInput {
        analysis: &analysis,
        provenance,
        tradeoff: None,
        scene: None,
    };
    insta::assert_snapshot!(
        "terminal_summary_of_an_odd_session",
        terminal_summary(&input, false)
    );
}

/// Findings come before every number.
#[test]
fn terminal_table_begins_with_findings() {
    let mut analysis = support::analysis(3, 2);
    analysis.findings = support::studies::findings();
    analysis.reference = Some(support::studies::reference());
    let input = ReportInput {
        analysis: &analysis,
        provenance: support::provenance(),
        tradeoff: None,
        scene: None,
    };
    let table = terminal_table(&input, false);
    let fault = table.find("fault     cameras swapped. Violated:").unwrap();
    assert!(fault < table.find("scored presses").unwrap(), "{table}");
    assert!(table.contains("clock wrong, camera 2."), "{table}");
    assert!(table.contains("do: check which camera"), "{table}");
    assert!(
        table.contains("3.02 mm (x 2.31, y 1.94) in-sample"),
        "{table}"
    );
    assert!(table.lines().all(|l| l.chars().count() <= 80), "{table}");
}

/// Rounds floats to six decimals: the test pins the layout, not the last bits of a platform's sine.
fn blunt(value: serde_json::Value) -> serde_json::Value {
    use serde_json::Value;
    match value {
        Value::Number(n) => match n.as_f64().filter(|_| n.is_f64()) {
            Some(f) => serde_json::json!((f * 1e6).round() / 1e6),
            None => Value::Number(n),
        },
        Value::Array(a) => a.into_iter().map(blunt).collect(),
        Value::Object(o) => o.into_iter().map(|(k, v)| (k, blunt(v))).collect(),
        other => other,
    }
}

#[test]
fn several_depths_have_lines_of_their_own_and_the_unit_says_so() {
    let mut analysis = support::analysis(3, 2);
    analysis.depths = [0.5, 2.25]
        .map(|depth_mm| skinrig_analysis::result::DepthResult {
            depth_mm,
            rmse_mm: analysis.scored.rmse_mm,
        })
        .to_vec();
    let input = ReportInput {
        analysis: &analysis,
        provenance: support::provenance(),
        tradeoff: None,
        scene: None,
    };
    let table = terminal_table(&input, false);
    assert!(table.contains("RMSE at 2.25 mm depth"), "{table}");
    assert!(table.contains("250 location-depths"), "{table}");
    assert!(table.lines().all(|l| l.chars().count() <= 80), "{table}");
    let page = skinrig_report::html(&input);
    assert!(page.contains("RMSE at depth 2.25 mm"));
    assert!(page.contains("All 2 depths together"));
}
