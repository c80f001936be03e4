//! The HTML page as a whole: size, self-containment, escaping, empty input.

mod support;

use skinrig_report::{ReportInput, html};

fn input(analysis: &skinrig_analysis::result::Analysis) -> ReportInput<'_> {
    ReportInput {
        analysis,
        provenance: support::provenance(),
    }
}

/// 2,500 presses, two cameras: 250 locations are not a square, 256 are near enough.
#[test]
fn a_campaign_fits_into_three_megabytes() {
    let analysis = support::analysis(16, 10);
    let page = html(&input(&analysis)).unwrap();
    if let Some(folder) = std::env::var_os("SKINRIG_REPORT_OUT") {
        std::fs::write(std::path::Path::new(&folder).join("campaign.html"), &page).unwrap();
    }
    assert!(page.len() < 3_000_000, "{} bytes", page.len());
}
