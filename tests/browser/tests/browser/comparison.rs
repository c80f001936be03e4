//! Comparison page of two runs: loading, downloads, dark mode, print, phone.

use std::path::PathBuf;
use std::sync::OnceLock;

use serde_json::json;
use skinrig_browser::{Page, Size};

use crate::downloads::{AT_A_TIME, buttons, rows};
use crate::reading::{LIGHTNESS, complaints, identifiers};
use crate::{check_phone, picture_folder, save_picture, skinrig, with_page};

/// Page that compares two simulated skins.
pub(crate) fn comparison() -> &'static PathBuf {
    static PAGE: OnceLock<PathBuf> = OnceLock::new();
    PAGE.get_or_init(|| {
        let folder = picture_folder().join("comparison");
        let _ = std::fs::remove_dir_all(&folder);
        let skins = ["one", "two"].map(|skin| {
            let to = folder.join(skin).to_str().unwrap().to_owned();
            let seed = if skin == "one" { "1" } else { "2" };
            let prototype = format!("prototype.id={skin}");
            let protocol = concat!(
                env!("CARGO_MANIFEST_DIR"),
                "/../../protocols/depth-sweep.yaml"
            );
            let run = ["run", protocol, "--sessions", &to, "--seed", seed];
            let set = ["--set", "path.random.count=12", "--set", "depths=[2 mm]"];
            skinrig(&[&run[..], &set, &["--set", &prototype]].concat());
            to
        });
        let out = folder.join("comparison.html");
        let limits = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../protocols/comparison.limits.yaml"
        );
        let [one, two] = &skins;
        let to = out.to_str().unwrap();
        skinrig(&["compare", one, two, "--limits", limits, "--out", to]);
        out
    })
}

fn with_comparison(test: impl FnOnce(&mut Page<'_>)) {
    with_page(|| comparison(), test);
}

#[test]
fn it_loads_without_console_output_and_states_comparability() {
    with_comparison(|page| {
        let found = complaints(page, ".html", "file:");
        assert!(found.is_empty(), "{found:#?}");
        for card in ["heading", "verdict-B", "comparability"] {
            let bottom = format!(
                "document.querySelector('[data-testid={card}]').getBoundingClientRect().bottom"
            );
            let bottom = page.evaluate(&bottom).unwrap().as_f64().unwrap();
            assert!(bottom <= f64::from(Size::LAPTOP.height), "{card}: {bottom}");
        }
        save_picture(page, "comparison-light", true);
    });
}

#[test]
fn every_figure_and_table_can_be_taken_out() {
    with_comparison(|page| {
        let figures = page
            .evaluate("document.querySelectorAll('svg.fig').length")
            .unwrap();
        let drawings = buttons(page, "svg");
        assert_eq!(json!(drawings.len()), figures);
        let tables = buttons(page, "csv");
        assert!(tables.len() >= drawings.len(), "{tables:?}");
        let saves = drawings.iter().map(|f| (f, "svg"));
        let saves = saves.chain(tables.iter().map(|f| (f, "csv")));
        for (k, (figure, kind)) in saves.enumerate() {
            if k % AT_A_TIME == AT_A_TIME - 1 {
                page.open(comparison()).unwrap();
            }
            let button = format!("[data-figure={figure}] [data-save={kind}]");
            let (name, bytes) = page.download(&button).unwrap();
            assert!(name.ends_with(&format!("{figure}.{kind}")), "{name}");
            if kind == "csv" {
                let (head, n) = rows(&bytes);
                assert!(n > 0 && head.iter().all(|h| !h.is_empty()), "{figure}");
            } else {
                let text = String::from_utf8(bytes).unwrap();
                assert!(
                    text.contains("<svg") && text.contains("simulated"),
                    "{figure}"
                );
            }
        }
    });
}

#[test]
fn it_is_dark_prints_and_fits_a_phone() {
    with_comparison(|page| {
        page.media("", "dark").unwrap();
        let body = format!("{LIGHTNESS}(getComputedStyle(document.body).backgroundColor)");
        assert!(page.evaluate(&body).unwrap().as_f64().unwrap() < 60.0);
        save_picture(page, "comparison-dark", true);
        page.click("#theme").unwrap();
        assert!(page.evaluate(&body).unwrap().as_f64().unwrap() > 200.0);
        let pdf = page.pdf().unwrap();
        assert!(pdf.starts_with(b"%PDF-"));
        std::fs::write(picture_folder().join("comparison.pdf"), &pdf).unwrap();
        check_phone(page, "comparison-phone");
        let found = identifiers(page);
        assert!(found.is_empty(), "{found:?}");
    });
}
