//! Reading: loading, first screen, structure, names, dark mode, print, phone, without script.

use serde_json::json;
use skinrig_browser::{Page, Size};

use crate::{check_phone, picture_folder, save_picture, with_report};

/// All errors and warnings of a page, and all requests except to addresses that begin and end like its own.
pub(crate) fn complaints(
    page: &mut Page<'_>,
    own_ending: &str,
    own_beginning: &str,
) -> Vec<String> {
    let events = page.events().into_iter();
    let bad = events.filter(|e| match e.method.as_str() {
        "Runtime.exceptionThrown" => true,
        "Runtime.consoleAPICalled" => e.params["type"] != "log",
        "Log.entryAdded" => true,
        "Network.requestWillBeSent" => {
            let url = e.params["request"]["url"].as_str().unwrap_or_default();
            let own = url.starts_with(own_beginning) && url.ends_with(own_ending);
            !own && !url.starts_with("data:")
        }
        _ => false,
    });
    bad.map(|e| format!("{}: {}", e.method, e.params)).collect()
}

#[test]
fn it_loads_without_console_output_or_requests() {
    with_report(|page, session| {
        assert_eq!(page.evaluate("document.readyState").unwrap(), "complete");
        let rows = "document.querySelectorAll('#press-table tbody tr').length";
        assert_eq!(
            page.evaluate(rows).unwrap(),
            json!(session.presses().len().min(50))
        );
        // Every part of the script ran: the last one writes this.
        assert!(
            page.text("document.querySelector('#page-state').textContent")
                .unwrap()
                .contains("presses")
        );
        let found = complaints(page, ".report.html", "file:");
        assert!(found.is_empty(), "{found:#?}");
        // The page's policy blocks everything except its own script.
        page.evaluate("document.body.insertAdjacentHTML('beforeend', '<img src=x onerror=\"window.ran = 1\">')")
            .unwrap();
        page.evaluate("new Promise(done => setTimeout(done, 50))")
            .unwrap();
        assert!(
            !complaints(page, ".report.html", "file:").is_empty(),
            "the complaints are not seen"
        );
        assert_eq!(
            page.evaluate("window.ran === undefined").unwrap(),
            json!(true)
        );
        let eval = json!({ "expression": "eval('1')", "allowUnsafeEvalBlockedByCSP": false });
        let answer = page.call("Runtime.evaluate", eval).unwrap();
        assert!(answer["exceptionDetails"].is_object(), "{answer}");
    });
}

#[test]
fn provenance_faults_and_exclusions_stand_on_the_first_screen() {
    with_report(|page, session| {
        for card in [
            "provenance",
            "notices",
            "exclusions",
            "counts",
            "metric-rmse",
        ] {
            let bottom = format!(
                "document.querySelector('[data-testid={card}]').getBoundingClientRect().bottom"
            );
            let bottom = page.evaluate(&bottom).unwrap().as_f64().unwrap();
            assert!(bottom <= f64::from(Size::LAPTOP.height), "{card}: {bottom}");
        }
        let block = page
            .text("document.querySelector('[data-testid=provenance]').textContent")
            .unwrap();
        let expected = &session.results["provenance"];
        for key in [
            "session_id",
            "protocol_sha256",
            "plan_sha256",
            "results_hash",
            "software",
            "operator",
        ] {
            assert!(
                block.contains(expected[key].as_str().unwrap()),
                "{key}: {block}"
            );
        }
        // Nothing overflows its card.
        let wide = "[...document.querySelectorAll('.first .card')].filter(c => c.scrollWidth > c.clientWidth).length";
        assert_eq!(page.evaluate(wide).unwrap(), json!(0));
        save_picture(page, "first-screen", false);
        save_picture(page, "light", true);
    });
}

#[test]
fn headings_landmarks_and_tables_are_in_order() {
    with_report(|page, _| {
        let levels = page
            .evaluate(
                "[...document.querySelectorAll('h1,h2,h3,h4')].map(h => Number(h.tagName[1]))",
            )
            .unwrap();
        let levels: Vec<u64> = levels
            .as_array()
            .unwrap()
            .iter()
            .map(|l| l.as_u64().unwrap())
            .collect();
        assert_eq!(levels.iter().filter(|l| **l == 1).count(), 1);
        for pair in levels.windows(2) {
            assert!(
                pair[1] <= pair[0] + 1,
                "a heading of level {} follows one of {}",
                pair[1],
                pair[0]
            );
        }
        for landmark in [
            "header",
            "nav[aria-label]",
            "main",
            "footer",
            "form[role=search][aria-label]",
        ] {
            let n = page
                .evaluate(&format!("document.querySelectorAll('{landmark}').length"))
                .unwrap();
            assert_eq!(n, json!(1), "{landmark}");
        }
        let bare = "[...document.querySelectorAll('th')].filter(th => !th.scope).length";
        assert_eq!(page.evaluate(bare).unwrap(), json!(0));
        let uncaptioned = "[...document.querySelectorAll('table')].filter(t => !t.caption).length";
        assert_eq!(page.evaluate(uncaptioned).unwrap(), json!(0));
        let untold = "[...document.querySelectorAll('svg.fig')].filter(s => !s.querySelector('title')?.textContent || !s.querySelector('desc')?.textContent).length";
        assert_eq!(page.evaluate(untold).unwrap(), json!(0));
        // The first tab stop skips the header, and is visible.
        page.key("Tab").unwrap();
        assert_eq!(
            page.evaluate("document.activeElement.className").unwrap(),
            "skip"
        );
        assert!(
            page.evaluate("document.activeElement.getBoundingClientRect().left")
                .unwrap()
                .as_f64()
                .unwrap()
                >= 0.0
        );
        page.key("Tab").unwrap();
        let outline = page
            .text("getComputedStyle(document.activeElement).outlineStyle")
            .unwrap();
        assert_eq!(outline, "solid", "the focus is not to be seen");
    });
}

#[test]
fn everything_that_can_be_used_has_a_name() {
    with_report(|page, _| {
        let tree = page.call("Accessibility.getFullAXTree", json!({})).unwrap();
        let nodes = tree["nodes"].as_array().unwrap();
        let used = [
            "button",
            "link",
            "checkbox",
            "combobox",
            "spinbutton",
            "textbox",
            "group",
            "region",
            "image",
            "search",
        ];
        let mut observed = std::collections::BTreeMap::<&str, u32>::new();
        for node in nodes.iter().filter(|n| n["ignored"] != true) {
            let role = node["role"]["value"].as_str().unwrap_or_default();
            let Some(role) = used.iter().find(|r| **r == role) else {
                continue;
            };
            // A group that cannot be focused only contains others.
            let properties = node["properties"].as_array();
            let focusable = properties.is_some_and(|p| p.iter().any(|p| p["name"] == "focusable"));
            if *role == "group" && !focusable {
                continue;
            }
            let name = node["name"]["value"].as_str().unwrap_or_default();
            assert!(!name.trim().is_empty(), "a {role} without a name: {node}");
            *observed.entry(role).or_default() += 1;
        }
        for role in [
            "button",
            "link",
            "checkbox",
            "combobox",
            "spinbutton",
            "image",
        ] {
            assert!(observed.contains_key(role), "no {role} among {observed:?}");
        }
        let still = "document.getAnimations().length";
        assert_eq!(page.evaluate(still).unwrap(), json!(0));
    });
}

/// Lightness of a colour, 0 to 255.
pub(crate) const LIGHTNESS: &str = "(c => Math.max(...c.match(/\\d+/g).slice(0, 3).map(Number)))";

#[test]
fn dark_follows_the_system_and_the_button() {
    with_report(|page, _| {
        let lightness = |page: &mut Page<'_>| {
            let body = format!("{LIGHTNESS}(getComputedStyle(document.body).backgroundColor)");
            let figure = format!(
                "{LIGHTNESS}(getComputedStyle(document.querySelector('#skin-map')).backgroundColor)"
            );
            [body, figure].map(|what| page.evaluate(&what).unwrap().as_f64().unwrap())
        };
        assert!(lightness(page).iter().all(|l| *l > 200.0));
        page.media("", "dark").unwrap();
        assert!(lightness(page).iter().all(|l| *l < 60.0));
        save_picture(page, "dark", true);
        page.click("#theme").unwrap();
        assert!(lightness(page).iter().all(|l| *l > 200.0));
        page.click("#theme").unwrap();
        assert!(lightness(page).iter().all(|l| *l < 60.0));
    });
}

#[test]
fn the_print_view_omits_interactive_parts() {
    with_report(|page, _| {
        let pdf = page.pdf().unwrap();
        std::fs::write(picture_folder().join("print.pdf"), &pdf).unwrap();
        let text = String::from_utf8_lossy(&pdf);
        let pages = text.matches("/Type /Page").count() - text.matches("/Type /Pages").count();
        assert!(
            text.starts_with("%PDF-") && (3..40).contains(&pages),
            "{pages} pages"
        );
        page.media("print", "dark").unwrap();
        for gone in ["nav", "#filters", ".tools", "#press-table", ".inspector"] {
            let display = page
                .text(&format!(
                    "getComputedStyle(document.querySelector('{gone}')).display"
                ))
                .unwrap();
            assert_eq!(display, "none", "{gone}");
        }
    });
}

#[test]
fn a_phone_scrolls_one_way_only() {
    with_report(|page, _| {
        check_phone(page, "phone");
    });
}

/// Figures and tables that do not fit the window, and texts that leave their figure or are too small to read.
pub(crate) fn misfits(page: &mut Page<'_>) -> Vec<String> {
    let script = "(() => {
        const found = [];
        const room = document.documentElement.clientWidth + 0.5;
        for (const figure of document.querySelectorAll('svg.fig')) {
            const box = figure.getBoundingClientRect();
            const name = figure.id || figure.textContent.slice(0, 40);
            if (figure.closest('table, details:not([open])')) continue;
            if (box.left < 0 || box.right > room) found.push(`${name}: ${box.left} to ${box.right} px`);
            for (const text of figure.querySelectorAll('text')) {
                const b = text.getBoundingClientRect();
                if (!b.width) continue;
                const what = `${name}: ${text.textContent}`;
                if (b.left < box.left - 3 || b.right > box.right + 3 || b.bottom > box.bottom + 3) found.push(`${what} leaves the figure`);
                if (b.height < 6) found.push(`${what} is ${b.height} px high`);
            }
        }
        for (const table of document.querySelectorAll('table')) {
            const box = table.parentElement.getBoundingClientRect();
            if (box.right > room) found.push(`${table.caption?.textContent}: a table of ${box.right} px`);
        }
        return found;
    })()";
    let found = page.evaluate(script).unwrap();
    let texts = found.as_array().unwrap().iter();
    texts.map(|t| t.as_str().unwrap().to_owned()).collect()
}

/// Words of the page that look like identifiers of the program. Code and keys of settings are meant literally.
pub(crate) fn identifiers(page: &mut Page<'_>) -> Vec<String> {
    let script = r"(() => {
        const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
        const keys = new Set([...document.querySelectorAll('dt')].flatMap(dt => dt.textContent.split('.')));
        const found = [];
        while (texts.nextNode()) {
            const { parentElement: parent, data } = texts.currentNode;
            if (parent.closest('script, style, code, dt, .foot, [title]')) continue;
            const words = data.match(/(?<![\w.\/])(?:[a-z]\w*(?:_[a-z]\w*)+\b|[a-z]\w+\/[a-z]\w+\/\w+)/g);
            if (words) found.push(...words.filter(word => !keys.has(word)));
        }
        return found;
    })()";
    let found = page.evaluate(script).unwrap();
    let texts = found.as_array().unwrap().iter();
    texts.map(|t| t.as_str().unwrap().to_owned()).collect()
}

#[test]
fn the_contents_stay_in_sight() {
    with_report(|page, _| {
        for size in [Size::LAPTOP, Size::PHONE] {
            page.resize(size).unwrap();
            page.evaluate(
                "document.querySelector('#session').scrollIntoView({ behavior: 'instant' })",
            )
            .unwrap();
            let hit = "(() => { const a = document.querySelector('nav a').getBoundingClientRect(); \
                 return document.elementFromPoint(a.x + a.width / 2, a.y + a.height / 2)?.closest('nav') !== null; })()";
            assert_eq!(page.evaluate(hit).unwrap(), json!(true), "{size:?}");
            let clear = "document.querySelector('#session-h').getBoundingClientRect().top \
                 >= document.querySelector('nav').getBoundingClientRect().bottom";
            assert_eq!(page.evaluate(clear).unwrap(), json!(true), "{size:?}");
        }
    });
}

#[test]
fn tables_of_the_literature_open_on_request() {
    with_report(|page, _| {
        for id in ["comparison-msows", "comparison-skins", "comparison-sensors"] {
            let shown =
                format!("document.querySelector('[data-testid={id}] table').checkVisibility()");
            assert_eq!(page.evaluate(&shown).unwrap(), json!(false), "{id}");
            page.click(&format!("[data-testid={id}] summary")).unwrap();
            assert_eq!(page.evaluate(&shown).unwrap(), json!(true), "{id}");
        }
    });
}

#[test]
fn people_read_words_and_no_impossible_numbers() {
    with_report(|page, _| {
        let found = identifiers(page);
        assert!(found.is_empty(), "{found:?}");
        let map = page
            .text("document.querySelector('[data-testid=cmre]').textContent")
            .unwrap();
        assert!(
            map.contains(" % missing") || map.contains(" % outside"),
            "{map}"
        );
        let negative = |w: &str| w.trim_start_matches('[').starts_with('-');
        assert!(!map.split_whitespace().any(negative), "{map}");
    });
}

#[test]
fn it_can_be_read_without_its_script() {
    with_report(|page, session| {
        page.call(
            "Emulation.setScriptExecutionDisabled",
            json!({ "value": true }),
        )
        .unwrap();
        page.open(&session.report).unwrap();
        let tree = page.call("Accessibility.getFullAXTree", json!({})).unwrap();
        let nodes = tree["nodes"].as_array().unwrap();
        let named = |name: &str| {
            nodes.iter().any(|n| {
                n["name"]["value"]
                    .as_str()
                    .is_some_and(|t| t.contains(name))
            })
        };
        for name in [
            "Localisation error, RMSE",
            session.id(),
            "Skin map",
            "need JavaScript",
        ] {
            assert!(named(name), "{name}");
        }
        save_picture(page, "without-script", false);
    });
}
