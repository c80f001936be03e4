//! Actions: pointing, keys, filtering, sorting, zooming.

use serde_json::{Value, json};
use skinrig_browser::Page;

use crate::{Session, counted, save_picture, with_report};

/// Content of the inspector as name and value; camera values are prefixed with their camera.
fn inspected(page: &mut Page<'_>) -> Vec<(String, String)> {
    let read = "(() => { let camera = ''; return [...document.querySelectorAll('#inspect dt')].map(dt => { \
        if (dt.className === 'head') { camera = dt.textContent + ' '; return null; } \
        return [camera + dt.textContent, dt.nextElementSibling.textContent]; }).filter(Boolean); })()";
    let rows = page.evaluate(read).unwrap();
    let text = |v: &Value| v.as_str().unwrap().to_owned();
    let rows = rows.as_array().unwrap().iter();
    rows.map(|r| (text(&r[0]), text(&r[1]))).collect()
}

fn row_text(rows: &[(String, String)], name: &str) -> String {
    let row = rows.iter().find(|r| r.0 == name);
    row.unwrap_or_else(|| panic!("no {name} in {rows:?}"))
        .1
        .clone()
}

/// The inspector shows the same values as the results for the press that it names.
fn agrees(session: &Session, rows: &[(String, String)]) {
    let number: u64 = row_text(rows, "press").parse().unwrap();
    let press = session
        .presses()
        .iter()
        .find(|p| p["press"] == number)
        .unwrap();
    assert_eq!(
        row_text(rows, "depth (mm)"),
        press["depth_mm"].to_string().trim_end_matches(".0")
    );
    assert_eq!(
        row_text(rows, "verdict"),
        press["verdict"].as_str().unwrap()
    );
    for k in 0..2 {
        let view = &press["views"][k];
        for (name, key) in [
            ("events", "events"),
            ("clusters", "clusters"),
            ("of them ON", "on_events"),
        ] {
            assert_eq!(
                row_text(rows, &format!("camera {} {name}", k + 1)),
                view[key].to_string()
            );
        }
    }
}

#[test]
fn a_press_that_is_pointed_at_shows_its_numbers() {
    with_report(|page, session| {
        page.hover("#skin-map .locations circle:nth-child(4)")
            .unwrap();
        let rows = inspected(page);
        agrees(session, &rows);
        assert_eq!(
            page.evaluate("document.querySelectorAll('#skin-map .selection *').length")
                .unwrap(),
            json!(3)
        );
        save_picture(page, "hover", false);
        page.hover("h1").unwrap();
        assert!(inspected(page).is_empty());
    });
}

#[test]
fn the_keyboard_walks_from_press_to_press() {
    with_report(|page, session| {
        page.evaluate("document.querySelector('[data-figure=skin-map] .canvas').focus()")
            .unwrap();
        page.key("ArrowRight").unwrap();
        let first = inspected(page);
        agrees(session, &first);
        page.key("ArrowRight").unwrap();
        let second = inspected(page);
        agrees(session, &second);
        assert_ne!(row_text(&first, "press"), row_text(&second, "press"));
        page.key("End").unwrap();
        let last = session
            .presses()
            .iter()
            .rev()
            .find(|p| p["role"] == "score")
            .unwrap();
        assert_eq!(
            row_text(&inspected(page), "press"),
            last["press"].to_string()
        );
        page.key("Escape").unwrap();
        assert!(inspected(page).is_empty());
    });
}

/// Selects a filter value as in its list.
fn choose(page: &mut Page<'_>, filter: &str, value: &str) {
    page.evaluate(&format!(
        "(() => {{ const s = document.querySelector('[data-testid=filter-{filter}]'); s.value = {}; \
         if (s.value !== {0}) throw new Error('no such choice'); s.dispatchEvent(new Event('input', {{ bubbles: true }})); }})()",
        json!(value)
    ))
    .unwrap();
}

fn pieces(page: &mut Page<'_>, path: &str) -> usize {
    let drawn = page
        .text(&format!(
            "document.querySelector('{path}').getAttribute('d')"
        ))
        .unwrap();
    drawn.matches('M').count()
}

/// The table and every linked figure show exactly these presses.
fn assert_shown(page: &mut Page<'_>, session: &Session, like: impl Fn(&Value) -> bool) {
    let n = session.count(&like);
    let state = page
        .text("document.querySelector('#filter-state').textContent")
        .unwrap();
    let all = session.presses().len();
    let expected = match n {
        0 => "no press matches".to_owned(),
        n if n == all => format!("all {all} presses"),
        n => format!("{n} of {all} presses"),
    };
    assert_eq!(state, expected);
    let rows = "document.querySelectorAll('#press-table tbody tr').length";
    assert_eq!(page.evaluate(rows).unwrap(), json!(n.min(50)));
    if n > 0 {
        let pager = page
            .text("document.querySelector('#page-state').textContent")
            .unwrap();
        assert!(pager.ends_with(&format!("of {n} presses")), "{pager}");
    }
    let located = session.count(|p| like(p) && counted(p));
    for path in [
        "#skin-map .vector[data-presses]",
        "#skin-map .tips[data-presses]",
        "#error-scatter .dots",
    ] {
        assert_eq!(pieces(page, path), located, "{path}");
    }
    assert_eq!(
        pieces(page, "#event-rates .marks"),
        session.count(|p| like(p) && !p["timing"].is_null())
    );
    let discs = page
        .evaluate("document.querySelectorAll('#skin-map .locations circle:not(.off-layer)').length")
        .unwrap();
    let places: std::collections::BTreeSet<String> = session
        .presses()
        .iter()
        .filter(|p| like(p) && counted(p))
        .map(|p| p["location"].to_string())
        .collect();
    assert_eq!(discs, json!(places.len()));
    // Steps of the distribution: one per press.
    let steps = page
        .text("document.querySelector('#error-distribution .ecdf')?.getAttribute('d') ?? ''")
        .unwrap();
    assert_eq!(steps.matches('V').count(), located);
    let heights = "Math.round([...document.querySelectorAll('#error-distribution .bars rect')].reduce((sum, r) => sum + Number(r.getAttribute('height')), 0) \
        / (([from, to, start, end]) => (start - end) / (to - from))(document.querySelectorAll('#error-distribution .plot')[1].dataset.y.split(' ').map(Number)))";
    assert_eq!(page.evaluate(heights).unwrap(), json!(located));
}

#[test]
fn a_filter_takes_the_same_presses_out_of_table_and_figures() {
    with_report(|page, session| {
        assert_shown(page, session, |_| true);
        choose(page, "depth", "2");
        assert_shown(page, session, |p| p["depth_mm"] == 2.0);
        choose(page, "repetition", "2");
        assert_shown(page, session, |p| {
            p["depth_mm"] == 2.0 && p["repetition"] == 2
        });
        let foot = page
            .text("document.querySelector('#skin-map .count').textContent")
            .unwrap();
        assert!(
            foot.contains("depth (mm) 2") && foot.contains("repetition 2"),
            "{foot}"
        );
        save_picture(page, "filtered", true);
        choose(page, "role", "calibrate");
        assert_shown(page, session, |_| false);
        page.click("[data-testid=filter-reset]").unwrap();
        assert_shown(page, session, |_| true);
        choose(page, "outcome", "located");
        assert_shown(page, session, |p| {
            p["location_outcome"]["status"] == "located"
        });
        assert_eq!(
            page.evaluate("document.querySelector('#filter-state').ariaLive")
                .unwrap(),
            "polite"
        );
    });
}

#[test]
fn the_table_sorts_and_a_row_selects_its_press() {
    with_report(|page, session| {
        choose(page, "role", "score");
        let column = "(key => { const k = [...document.querySelectorAll('#press-table th[data-key]')].findIndex(th => th.dataset.key === key); \
            return [...document.querySelectorAll('#press-table tbody tr')].map(tr => tr.children[k].textContent); })('error_mm')";
        let head = "#press-table th[data-key=error_mm]";
        for (order, direction) in [("ascending", 1.0), ("descending", -1.0)] {
            page.click(&format!("{head} button")).unwrap();
            assert_eq!(
                page.text(&format!("document.querySelector('{head}').ariaSort"))
                    .unwrap(),
                order
            );
            let errors = page.evaluate(column).unwrap();
            let errors = errors.as_array().unwrap().iter();
            let errors: Vec<f64> = errors.filter_map(|e| e.as_str()?.parse().ok()).collect();
            assert!(
                errors.len() > 20 && errors.is_sorted_by(|a, b| direction * a <= direction * b),
                "{errors:?}"
            );
        }
        page.click("#press-table tbody tr:nth-child(3) button")
            .unwrap();
        let rows = inspected(page);
        agrees(session, &rows);
        let row = page
            .text("document.querySelector('#press-table tr[aria-selected=true] th').textContent")
            .unwrap();
        assert_eq!(row_text(&rows, "press"), row);
    });
}

#[test]
fn event_rates_zoom_by_button_key_and_wheel_and_back() {
    with_report(|page, _| {
        let range = |page: &mut Page<'_>| {
            let text = page
                .text("document.querySelector('#zoom-range').textContent")
                .unwrap();
            let ends: Vec<f64> = text
                .split(" to ")
                .map(|t| t.trim_end_matches(" s").parse().unwrap())
                .collect();
            (ends[0], ends[1])
        };
        let span = |(a, b): (f64, f64)| b - a;
        let whole = range(page);
        page.click("[data-zoom=in]").unwrap();
        let half = range(page);
        assert!(
            (span(half) / span(whole) - 0.5).abs() < 0.01,
            "{whole:?} {half:?}"
        );
        let drawn = "Number(document.querySelector('#event-rates .zoomed').getAttribute('transform').match(/scale\\((\\S+)/)[1])";
        let scale = page.evaluate(drawn).unwrap().as_f64().unwrap();
        assert!((scale - 2.0).abs() < 1e-6, "{scale}");
        page.click("[data-zoom=right]").unwrap();
        assert!(range(page).0 > half.0);
        save_picture(page, "zoomed", false);
        page.evaluate("document.querySelector('[data-figure=event-rates] .canvas').focus()")
            .unwrap();
        page.key("+").unwrap();
        assert!((span(range(page)) / span(whole) - 0.25).abs() < 0.01);
        page.key("0").unwrap();
        assert_eq!(range(page), whole);
    });
}
