//! Downloads: every figure as SVG, its data as CSV.

use serde_json::{Value, json};
use skinrig_browser::Page;

use crate::{counted, with_report};

pub(crate) fn rows(bytes: &[u8]) -> (Vec<String>, usize) {
    // The reader rejects rows with another length than the header.
    let mut reader = csv::Reader::from_reader(bytes);
    let head = reader
        .headers()
        .unwrap()
        .iter()
        .map(str::to_owned)
        .collect();
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    (head, rows.len())
}

/// Files per page: after ten downloads a browser asks for permission.
pub(crate) const AT_A_TIME: usize = 8;

pub(crate) fn buttons(page: &mut Page<'_>, kind: &str) -> Vec<String> {
    let found = page
        .evaluate(&format!("[...document.querySelectorAll('[data-save={kind}]')].map(b => b.closest('[data-figure]').dataset.figure)"))
        .unwrap();
    let found = found.as_array().unwrap().iter();
    found.map(|f| f.as_str().unwrap().to_owned()).collect()
}

#[test]
fn every_figure_is_a_drawing_of_its_own_and_names_its_session() {
    with_report(|page, session| {
        let figures = page
            .evaluate("document.querySelectorAll('svg.fig').length")
            .unwrap();
        let all = buttons(page, "svg");
        assert_eq!(json!(all.len()), figures);
        for (k, figure) in all.into_iter().enumerate() {
            if k % AT_A_TIME == AT_A_TIME - 1 {
                page.open(&session.report).unwrap();
            }
            let (name, bytes) = page
                .download(&format!("[data-figure={figure}] [data-save=svg]"))
                .unwrap();
            assert!(
                name.ends_with(&format!("{figure}.svg")) && name.contains(session.id()),
                "{name}"
            );
            let text = String::from_utf8(bytes).unwrap();
            assert!(
                text.contains(session.id()) && text.contains("simulated"),
                "{figure}"
            );
            assert!(!text.contains("var("), "{figure} needs the page's style");
            let parsed = page
                .evaluate(&format!(
                    "(() => {{ const d = new DOMParser().parseFromString({}, 'image/svg+xml'); \
                     return [d.documentElement.localName, d.querySelectorAll('parsererror').length, d.querySelectorAll('text').length]; }})()",
                    json!(text)
                ))
                .unwrap();
            assert_eq!(
                (&parsed[0], &parsed[1]),
                (&json!("svg"), &json!(0)),
                "{figure}"
            );
            assert!(parsed[2].as_u64().unwrap() > 5, "{figure}");
        }
    });
}

#[test]
fn every_figure_gives_its_data() {
    with_report(|page, session| {
        let all = buttons(page, "csv");
        assert!(all.len() > 20, "{all:?}");
        let a = &session.results["analysis"];
        let length = |v: &Value| v.as_array().unwrap().len();
        for (k, figure) in all.iter().enumerate() {
            if k % AT_A_TIME == AT_A_TIME - 1 {
                page.open(&session.report).unwrap();
            }
            let (name, bytes) = page
                .download(&format!("[data-figure={figure}] [data-save=csv]"))
                .unwrap();
            assert!(name.ends_with(".csv"), "{name}");
            let (head, n) = rows(&bytes);
            assert!(
                head.iter().all(|h| !h.is_empty()) && n > 0,
                "{figure}: {head:?}, {n} rows"
            );
            let expected = match figure.as_str() {
                "skin-map" | "press-table" | "error-scatter" => session.presses().len(),
                "error-distribution" => session.count(counted),
                "models" => length(&a["calibration"]["compared"]),
                "latency-onsets" => length(&a["latency"]["onsets"]),
                _ => continue,
            };
            assert_eq!(n, expected, "{figure}");
        }
    });
}

#[test]
fn filtered_data_are_downloaded_filtered_and_labelled() {
    with_report(|page, session| {
        page.evaluate("(() => { const s = document.querySelector('[data-testid=filter-depth]'); s.value = '1'; s.dispatchEvent(new Event('input')); })()")
            .unwrap();
        let shallow = |p: &Value| p["depth_mm"] == 1.0;
        let (name, bytes) = page.download("[data-testid=press-table-csv]").unwrap();
        assert!(name.ends_with("press-table_filtered.csv"), "{name}");
        assert_eq!(rows(&bytes).1, session.count(shallow));
        let (_, bytes) = page
            .download("[data-testid=error-distribution-csv]")
            .unwrap();
        assert_eq!(rows(&bytes).1, session.count(|p| shallow(p) && counted(p)));
        let (name, bytes) = page.download("[data-testid=skin-map-svg]").unwrap();
        assert!(name.ends_with("skin-map_filtered.svg"), "{name}");
        assert!(String::from_utf8(bytes).unwrap().contains("depth (mm) 1"));
    });
}
