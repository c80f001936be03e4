//! The section on depth and force, and its line in the terminal.

use skinrig_analysis::result::{
    Analysis, Indentation, NoQuantity, PressIndentation, Quantity, QuantityAtDepth, QuantityErrors,
    Ranged, ZeroReturn,
};
use skinrig_model::PressRole;
use skinrig_report::{html, terminal_summary};

use super::input;
use crate::support;

fn with_depths(drifts: bool) -> Analysis {
    let mut analysis = support::analysis(4, 3);
    let estimate = |value: f64| support::studies::estimate(value, 0.01, 32);
    let errors = QuantityErrors {
        rmse: estimate(0.123),
        bias: estimate(0.02),
        relative_percent: estimate(7.1),
        covered: estimate(0.95),
    };
    let rows = analysis
        .presses
        .iter()
        .filter(|p| p.role != PressRole::Sync);
    let presses = rows.map(|p| {
        let ranged = Ranged {
            value: 2.1,
            interval: Some([1.9, 2.4]),
        };
        PressIndentation {
            press: p.press,
            depth_mm: Some(ranged),
            force_n: None,
            left_out_mm: (p.role == PressRole::Calibrate).then_some(ranged),
            measured_mm: Some(2.0),
            measured_n: None,
            rest_mm: Some(0.01),
        }
    });
    let depth = Quantity {
        scored: errors,
        left_out: errors,
        depths: vec![QuantityAtDepth {
            depth_mm: 2.0,
            scored: errors,
            left_out: errors,
        }],
        taught_by: 16,
        taught: [1.0, 2.0],
        beyond: 0,
    };
    analysis.indentation = Some(Indentation {
        depth: Some(depth),
        no_depth: None,
        force: None,
        no_force: Some(NoQuantity::NotReported),
        zero: Some(ZeroReturn {
            after_s: 2.5,
            mean_mm: estimate(0.08),
            rms_mm: estimate(0.09),
            trend_mm: Some(0.01),
            drifts,
        }),
        presses: presses.collect(),
    });
    analysis
}

#[test]
fn depths_have_a_section_a_figure_and_a_line() {
    let analysis = with_depths(true);
    let page = html(&input(&analysis));
    for part in [
        "id=\"indentation\"",
        "Estimated depth",
        "Depth error by planned depth",
        "0.123",
        "drift",
        "no measured force",
    ] {
        assert!(page.contains(part), "{part}");
    }
    let text = terminal_summary(&input(&analysis), false);
    assert!(text.contains("0.12 mm") && text.contains("drift"), "{text}");
    let still = html(&input(&with_depths(false)));
    assert!(still.contains("The skin returns to zero."));
}

/// Presses beyond what the calibration presses taught have no error, and intervals that do not hold are said to.
#[test]
fn what_was_not_taught_and_does_not_hold_is_said() {
    let mut analysis = with_depths(false);
    let depth = |a: &mut Analysis, change: fn(&mut Quantity)| {
        change(a.indentation.as_mut().unwrap().depth.as_mut().unwrap());
    };
    let text = |a: &Analysis| -> String {
        let shown = terminal_summary(&input(a), false);
        shown.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    assert!(!text(&analysis).contains("taught"));
    assert!(!text(&analysis).contains("intervals hold"));
    depth(&mut analysis, |depth| {
        depth.beyond = 8;
        depth.scored.covered = support::studies::estimate(0.5, 0.1, 32);
    });
    let shown = text(&analysis);
    let expected = "n 32 presses (8 more beyond the 1.0 to 2.0 mm taught), 0.12 mm at left-out locations; intervals hold for 50 %";
    assert!(shown.contains(expected), "{shown}");
    let page = html(&input(&analysis));
    assert!(page.contains("Of the depth (mm): 8 of 40 scored presses are left out"));
    depth(&mut analysis, |depth| depth.scored.rmse.n = 0);
    let none = text(&analysis);
    let expected =
        "all 8 scored presses beyond the 1.0 to 2.0 mm taught, 0.12 mm at left-out locations";
    assert!(none.contains(expected), "{none}");
}

#[test]
fn a_session_of_one_depth_has_none_of_it() {
    let analysis = support::analysis(4, 3);
    assert!(!html(&input(&analysis)).contains("Estimated depth"));
    assert!(!terminal_summary(&input(&analysis), false).contains("left-out locations"));
}
