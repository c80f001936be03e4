//! The HTML page as a whole: size, self-containment, escaping, empty input.

mod compare;
mod indentation;
mod traces;

use crate::support;
use skinrig_analysis::exclusion::Exclusion;
use skinrig_model::{CameraId, ExcludedReason, Verdict};
use skinrig_report::{ReportInput, html};

fn input(analysis: &skinrig_analysis::result::Analysis) -> ReportInput<'_> {
    ReportInput {
        analysis,
        provenance: support::provenance(),
        tradeoff: None,
        scene: None,
    }
}

/// 2,500 presses, two cameras: 250 locations do not form a square, 256 are close enough.
#[test]
fn a_campaign_fits_into_two_and_a_half_megabytes() {
    let analysis = support::analysis(16, 10);
    let page = html(&input(&analysis));
    if let Some(folder) = std::env::var_os("SKINRIG_REPORT_OUT") {
        std::fs::write(std::path::Path::new(&folder).join("campaign.html"), &page).unwrap();
    }
    assert!(page.len() < 2_500_000, "{} bytes", page.len());
}

const HOSTILE: &str = "</script><img src=x onerror=alert(1)>\"'><!--]]>&{{ 7*7 }}\u{2028}\u{0}";

/// Only the SVG namespace may be an address.
#[test]
fn the_page_refers_to_nothing_outside() {
    let analysis = support::analysis(5, 3);
    let page = html(&input(&analysis));
    let rest = page.replace("http://www.w3.org/2000/svg", "");
    for forbidden in [
        "http:", "https:", "src=", "@import", "<link", "<iframe", "<object", "<embed",
    ] {
        assert!(!rest.contains(forbidden), "found `{forbidden}`");
    }
    assert!(
        !rest.contains("url(") || rest.matches("url(").count() == rest.matches("url(#").count()
    );
}

#[test]
fn hostile_text_stays_text() {
    let mut analysis = support::analysis(4, 3);
    analysis.warnings = vec![support::warning(HOSTILE.into())];
    for press in &mut analysis.presses {
        if press.cause.is_some() {
            press.cause = Some(Exclusion::Excluded(ExcludedReason::Recorded {
                text: format!("{HOSTILE} in full"),
            }));
        }
    }
    if let Some(c) = &mut analysis.calibration {
        c.names[0] = HOSTILE.into();
    }
    let text = || HOSTILE.to_owned();
    let mut provenance = support::provenance();
    provenance.session_id = text();
    provenance.prototype = text();
    provenance.operator = text();
    provenance.rig_name = text();
    provenance.rig_kind = text();
    provenance.protocol_name = text();
    provenance.command_line = text();
    provenance.run_end = text();
    provenance.run_end_reason = Some(text());
    provenance.overrides = vec![text()];
    provenance.notes[0].text = text();
    provenance.interruptions[0].reason = text();
    provenance.interruptions[0].kind = text();
    provenance.devices[0].model = text();
    let input = ReportInput {
        analysis: &analysis,
        provenance,
        tradeoff: None,
        scene: None,
    };
    let page = html(&input);
    assert!(!page.contains("<img"), "an element came through");
    assert!(!page.contains("<!--"));
    assert!(!page.contains("49}}") && page.contains("7*7"));
    // Only the page's own three scripts, and no other end tag.
    assert_eq!(page.matches("<script").count(), 3);
    assert_eq!(page.matches("</script>").count(), 3);
    let data = page
        .split("id=\"report-data\">")
        .nth(1)
        .unwrap()
        .split("</script>")
        .next()
        .unwrap();
    let data: serde_json::Value = serde_json::from_str(data).unwrap();
    assert_eq!(data["session"], *skinrig_model::text::visible(HOSTILE));
    for figure in skinrig_report::figures::all(&input) {
        assert!(
            !figure.svg.contains("<img") && !figure.svg.contains("<script"),
            "{}",
            figure.id
        );
        assert!(!figure.svg.contains('\u{0}'), "{}", figure.id);
    }
}

#[test]
fn simulated_is_said_in_page_and_in_every_figure() {
    let analysis = support::analysis(4, 3);
    let mut input = input(&analysis);
    assert!(html(&input).contains("data-testid=\"simulated\""));
    for figure in skinrig_report::figures::all(&input) {
        assert!(figure.svg.contains("simulated rig"), "{}", figure.id);
        assert!(
            figure.svg.contains("2026-03-02_14-05-09_meander"),
            "{}",
            figure.id
        );
        assert!(figure.standalone().contains("<style>"), "{}", figure.id);
        assert!(!figure.standalone().contains("var("), "{}", figure.id);
    }
    input.provenance.simulated = false;
    input.provenance.rig_kind = "bench".into();
    assert!(!html(&input).contains("data-testid=\"simulated\""));
    assert!(
        skinrig_report::figures::all(&input)
            .iter()
            .all(|f| !f.svg.contains("simulated rig"))
    );
}

#[test]
fn emulated_is_said_as_plainly_and_the_preflight_is_shown() {
    let a = support::analysis(3, 2);
    let mut input = input(&a);
    input.provenance.simulated = false;
    input.provenance.emulated = true;
    input.provenance.preflight = vec![skinrig_model::PreflightCheck::new(
        "camera 2: clock",
        "advancing",
        "<no time>",
        false,
        "power-cycle it",
    )];
    let page = html(&input);
    for part in [
        "data-testid=\"emulated\"",
        "software that replaces the hardware",
        "data-testid=\"preflight\"",
        "camera 2: clock",
        "&lt;no time&gt;",
        "power-cycle it",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert!(!page.contains("data-testid=\"simulated\""));
    for figure in skinrig_report::figures::all(&input) {
        assert!(figure.svg.contains("emulated rig"), "{}", figure.id);
    }
    let table = skinrig_report::terminal_table(&input, false);
    assert!(
        table.contains("EMULATED, not measured on hardware"),
        "{table}"
    );
}

#[test]
fn a_session_without_presses_says_so() {
    let analysis = support::empty();
    let page = html(&input(&analysis));
    if let Some(folder) = std::env::var_os("SKINRIG_REPORT_OUT") {
        std::fs::write(std::path::Path::new(&folder).join("empty.html"), &page).unwrap();
    }
    assert!(page.contains("This session has no presses"));
    assert!(page.contains("no scored press was located"));
    assert!(page.contains("no events in this camera"));
    assert!(page.contains("not aligned"));
    assert!(
        !page.contains("NaN") && !page.contains("inf "),
        "a number leaked"
    );
}

#[test]
fn presses_without_estimates_and_broken_numbers_are_drawn_as_absent() {
    let mut analysis = support::analysis(4, 3);
    for (i, press) in analysis.presses.iter_mut().enumerate() {
        press.location_outcome = if i % 2 == 0 {
            skinrig_analysis::result::LocationOutcome::Missing
        } else {
            let at = skinrig_model::Point2::new(f64::NAN, f64::INFINITY);
            skinrig_analysis::result::LocationOutcome::Outside { at, sine: f64::NAN }
        };
        if let Some(view) = &mut press.views[0] {
            view.centroid_u = Some(f64::NAN);
        }
    }
    for series in &mut analysis.rates {
        series.mean_per_s[3] = f32::NAN;
        series.peak_per_s[4] = f32::INFINITY;
    }
    analysis.scored.rmse_mm.value = Some(f64::NAN);
    let page = html(&input(&analysis));
    assert!(page.contains("no scored press was located"));
    let figures: String = skinrig_report::figures::all(&input(&analysis))
        .iter()
        .map(|f| f.svg.clone())
        .collect();
    assert!(!figures.contains("NaN") && !figures.contains("inf"));
}

#[test]
fn everything_a_browser_test_needs_has_a_name() {
    let analysis = support::analysis(4, 3);
    let page = html(&input(&analysis));
    for id in [
        "results",
        "counts",
        "notices",
        "exclusions",
        "provenance",
        "metric-rmse",
        "figure-skin-map",
        "figure-event-rates",
        "figure-error-distribution",
        "figure-error-scatter",
        "figure-centroid-tracks",
        "figure-repeat-map",
        "figure-press-rates",
        "figure-press-pictures",
        "clocks",
        "calibration",
        "coverage",
        "cmre",
        "bit-rates",
        "fit-table",
        "model-table",
        "reduction-table",
        "latency-table",
        "latency-from-contact",
        "comparison-msows",
        "comparison-skins",
        "comparison-sensors",
        "audit-silent",
        "figure-activity",
        "figure-models",
        "figure-correlation",
        "figure-residuals",
        "figure-threshold",
        "figure-reduction",
        "figure-latency-course",
        "figure-latency-roc",
        "figure-latency-onsets",
        "figure-clock-residuals",
        "figure-pose-course",
        "figure-pose-presses",
        "no-tradeoff",
        "press-table",
        "inspector",
        "filters",
        "filter-repetition",
        "filter-depth",
        "filter-outcome",
        "filter-verdict",
        "filter-role",
        "filter-press",
        "filter-reset",
        "filter-state",
        "theme",
    ] {
        assert_eq!(
            page.matches(&format!("data-testid=\"{id}\"")).count(),
            1,
            "{id}"
        );
    }
    assert_eq!(
        page.matches("<title id=").count(),
        page.matches("role=\"img\"").count()
    );
}

/// A violation comes before every number, with fault, evidence and advice; the public code's numbers appear only if
/// computed.
#[test]
fn findings_come_first_and_reference_numbers_only_when_asked_for() {
    let mut analysis = support::analysis(4, 3);
    assert!(!html(&input(&analysis)).contains("data-testid=\"reference"));
    analysis.findings = support::studies::findings();
    analysis.reference = Some(support::studies::reference());
    let page = html(&input(&analysis));
    let at = |text: &str| page.find(text).unwrap_or_else(|| panic!("no {text}"));
    assert!(at("data-testid=\"findings\"") < at("data-testid=\"metric-rmse\""));
    assert!(at("Likely: cameras swapped.") < at("off with cameras exchanged"));
    assert!(at("Likely: clock wrong, camera 2.") < at("check the alignment of camera 2"));
    assert!(!page.contains("data-testid=\"audit-silent\""));
    assert!(at("data-testid=\"reference-table\"") < at("data-testid=\"reference-reduction\""));
}

/// Every ID occurs once, and every reference has its target.
#[test]
fn ids_are_unique_and_references_lead_somewhere() {
    let analysis = support::analysis(4, 3);
    let page = html(&input(&analysis));
    let values = |attribute: &str| -> Vec<String> {
        page.split(&format!(" {attribute}=\""))
            .skip(1)
            .filter_map(|s| s.split('"').next())
            .map(str::to_owned)
            .collect()
    };
    let ids = values("id");
    let mut unique = ids.clone();
    unique.sort();
    unique.dedup();
    assert_eq!(unique.len(), ids.len());
    for target in values("aria-labelledby").iter().flat_map(|v| v.split(' ')) {
        assert!(ids.iter().any(|i| i == target), "{target}");
    }
    for target in values("href").iter().filter_map(|v| v.strip_prefix('#')) {
        assert!(ids.iter().any(|i| i == target), "{target}");
    }
}

#[test]
fn figures_that_disagree_with_the_headline_are_called_out() {
    let mut analysis = support::analysis(4, 3);
    assert!(!html(&input(&analysis)).contains("Disagreement"));
    analysis.scored.rmse_mm.n += 1;
    assert!(html(&input(&analysis)).contains("Disagreement"));
}

/// The mean of the map's spreads is the headline's: same definition (computed by hand here).
#[test]
fn spread_at_a_location_is_the_sample_standard_deviation() {
    let mut analysis = support::analysis(2, 3);
    let mut estimates = [(1.0, 2.0), (3.0, 2.0)].into_iter();
    for p in analysis
        .presses
        .iter_mut()
        .filter(|p| p.location.index() == 1)
    {
        if p.role == skinrig_model::PressRole::Score {
            let (x, y) = estimates.next().unwrap();
            p.truth = Some(skinrig_model::Point2::new(0.0, 0.0));
            let at = skinrig_model::Point2::new(x, y);
            p.location_outcome =
                skinrig_analysis::result::LocationOutcome::Located { at, sine: 0.5 };
        }
    }
    let summaries = skinrig_report::derive::locations(&analysis);
    let summary = summaries.iter().find(|l| l.location.index() == 1).unwrap();
    assert!((summary.std_mm.unwrap() - 2f64.sqrt()).abs() < 1e-12);
    assert!((summary.mean_error_mm - (5f64.sqrt() + 13f64.sqrt()) / 2.0).abs() < 1e-12);
    assert_eq!(summary.n, 2);
}

/// Presses rejected by a rule form one row with a count and an example; sync presses are listed separately.
#[test]
fn presses_that_do_not_count_are_grouped_by_rule() {
    let mut analysis = support::analysis(6, 3);
    for (i, press) in analysis.presses.iter_mut().enumerate() {
        if i % 10 == 1 {
            press.verdict = Verdict::Excluded;
            press.cause = Some(Exclusion::NoResponse {
                camera: CameraId::Two,
                found: i as u32,
                expected: 800.0,
                standard_error: 40.0,
            });
        } else if press.verdict != Verdict::Valid {
            press.verdict = Verdict::Valid;
        }
    }
    let outside = |sync: bool| skinrig_report::derive::rejections(&analysis, sync);
    let (counted, sync) = (outside(false), outside(true));
    assert_eq!((counted.len(), sync.len()), (1, 1));
    let all = analysis
        .presses
        .iter()
        .filter(|p| p.verdict != Verdict::Valid)
        .count() as u32;
    assert_eq!((counted[0].n + sync[0].n, sync[0].n), (all, 1));
    let page = html(&input(&analysis));
    let card = page.split("data-testid=\"exclusions\"").nth(1).unwrap();
    let card = card.split("data-testid=\"provenance\"").next().unwrap();
    assert_eq!(card.matches("<tr><th scope=\"row\"").count(), 2, "{card}");
    assert!(
        card.contains("for example: no response: 11 events"),
        "{card}"
    );
    assert!(card.contains("Sync presses, counted apart"));
}

#[test]
fn the_head_names_protocol_prototype_and_extent() {
    let analysis = support::analysis(4, 3);
    let page = html(&input(&analysis));
    assert!(page.contains("<h1 data-testid=\"heading\">meander</h1>"));
    let head = page.split("</header>").next().unwrap();
    assert!(head.contains("waveguide 3, second pour"));
    assert!(head.contains("3 repetitions, 16 locations"));
    assert!(head.contains("<code>2026-03-02_14-05-09_meander</code>"));
}

/// A camera without a clock fit is not on the host's time axis.
#[test]
fn an_unaligned_camera_is_drawn_from_its_first_event() {
    let mut analysis = support::analysis(4, 3);
    let panel = "clock not aligned: time since its first event";
    assert!(!html(&input(&analysis)).contains(panel));
    analysis.clocks[1] = None;
    analysis.rates[1].start_s = 5e6;
    let figures = skinrig_report::figures::all(&input(&analysis));
    let rates = figures.iter().find(|f| f.id == "event-rates").unwrap();
    assert_eq!(rates.svg.matches(panel).count(), 1);
    let axis = rates.svg.split("data-x=\"").nth(1).unwrap();
    let end: f64 = axis.split(' ').nth(1).unwrap().parse().unwrap();
    assert!(end < 1000.0, "{end}");
}

#[test]
fn the_reason_that_ended_the_run_is_said_once() {
    let analysis = support::analysis(3, 2);
    let mut input = input(&analysis);
    input.provenance.run_end = "faulted".into();
    input.provenance.run_end_reason = Some("the belt tore".into());
    input.provenance.interruptions[0].kind = "fault".into();
    input.provenance.interruptions[0].reason = "the belt tore".into();
    input.provenance.interruptions[0].ended_run = true;
    let page = html(&input);
    assert_eq!(page.matches("the belt tore").count(), 1);
    assert!(page.contains("Run faulted at 1803.2 s."));
    let table = skinrig_report::terminal_table(&input, false);
    assert_eq!(table.matches("the belt tore").count(), 1, "{table}");
    assert!(table.contains("fault at 1803.2 s"), "{table}");
}

/// A lower error with fewer events is explained only if the intervals do not overlap.
#[test]
fn less_error_with_fewer_events_is_explained() {
    let caption = |rmse: f64, spread: f64| {
        let mut analysis = support::analysis(4, 3);
        let study = analysis.reduction.as_mut().unwrap();
        let row = &mut study.curves[0].rows[1];
        row.rmse_mm = support::studies::estimate(rmse, spread, 16);
        html(&input(&analysis)).contains("A has its minimum at k = 2 (")
    };
    assert!(caption(0.5, 0.01));
    assert!(!caption(0.5, 50.0));
    assert!(!caption(500.0, 0.01));
}

/// An ellipse is as large as its region and turned like it; a page of thousands draws some of them.
#[test]
fn regions_are_ellipses_of_their_size_on_the_skin_map() {
    let mut analysis = support::analysis(4, 3);
    let ellipses = |analysis: &skinrig_analysis::result::Analysis| -> Vec<Vec<f64>> {
        let page = html(&input(analysis));
        let Some((_, rest)) = page.split_once("<path class=\"region\" d=\"M") else {
            return Vec::new();
        };
        // The first in the page is the map's: its layer comes before the legend.
        let (path, _) = rest.split_once('"').unwrap();
        let numbers = |one: &str| {
            let words = one.split(|c: char| !(c.is_ascii_digit() || c == '.' || c == '-'));
            words.filter_map(|w| w.parse().ok()).collect()
        };
        path.split('M').map(numbers).collect()
    };
    let without = ellipses(&analysis);
    assert_eq!(without.len(), 1, "only the legend's");
    let region = skinrig_analysis::result::Region {
        semi_axes_mm: [6.0, 2.0],
        angle_deg: 30.0,
    };
    for press in &mut analysis.presses {
        press.region = Some(region);
    }
    let drawn = ellipses(&analysis);
    let counted = analysis.scored.rmse_mm.n as usize;
    assert_eq!(drawn.len(), counted);
    for one in drawn {
        // Start, then semi-axes, turn and flags, and the way to the other end of the longer axis.
        let [_, _, major, minor, turn, _, _, dx, dy, ..] = one[..] else {
            panic!("{one:?}");
        };
        assert!(
            (major / minor - 3.0).abs() < 0.05 && (turn + 30.0).abs() < 1e-9,
            "{one:?}"
        );
        assert!(
            (libm::hypot(dx, dy) - 2.0 * major).abs() < 0.1 && dx > 0.0 && dy < 0.0,
            "{one:?}"
        );
    }
}

/// The probed area is drawn around the locations behind its number.
#[test]
fn the_probed_area_is_drawn_as_it_is_counted() {
    let mut analysis = support::analysis(4, 3);
    let cells = |analysis: &skinrig_analysis::result::Analysis| {
        let page = html(&input(analysis));
        let (_, mask) = page.split_once("<mask id=\"skin-map-probed\"").unwrap();
        let (mask, _) = mask.split_once("</mask>").unwrap();
        mask.matches('M').count()
    };
    assert_eq!(cells(&analysis), 16);
    if let Some(coverage) = &mut analysis.coverage {
        coverage.places.truncate(11);
    }
    assert_eq!(cells(&analysis), 11);
}
