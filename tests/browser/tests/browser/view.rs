//! The page of `skinrig view`: playback, two sessions side by side, the shelf, files of what is shown.

use std::io::{Cursor, Read};
use std::path::PathBuf;
use std::sync::OnceLock;

use serde_json::{Value, json};
use skinrig::library::Program;
use skinrig_browser::Page;
use skinrig_view::{Options, Server};

use crate::comparison::comparison;
use crate::reading::{LIGHTNESS, complaints, identifiers};
use crate::{check_phone, picture_folder, save_picture, with_page};

/// A server over the sessions of both skins of the comparison: its link, and their names.
struct Shelf {
    link: String,
    sessions: [String; 2],
}

fn shelf() -> &'static Shelf {
    static SHELF: OnceLock<Shelf> = OnceLock::new();
    SHELF.get_or_init(|| {
        let from = comparison().parent().unwrap();
        let folder = picture_folder().join("shelf");
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).unwrap();
        let sessions = ["one", "two"].map(|skin| {
            let files = std::fs::read_dir(from.join(skin)).unwrap();
            let files: Vec<PathBuf> = files.map(|f| f.unwrap().path()).collect();
            let of = |ending: &str| {
                let found = files.iter().find(|f| f.to_string_lossy().ends_with(ending));
                found.unwrap_or_else(|| panic!("no {ending} in {files:?}"))
            };
            for (file, name) in [
                (of(".session.sqlite"), format!("{skin}.session.sqlite")),
                (of(".results.json"), format!("{skin}.results.json")),
            ] {
                std::fs::hard_link(file, folder.join(name)).unwrap();
            }
            format!("{skin}.session.sqlite")
        });
        let options = Options {
            folder,
            first: None,
            bind: Options::LOOPBACK,
            control: false,
        };
        let server = Server::open(options, Program).unwrap();
        let link = server.link();
        std::thread::spawn(move || server.run_until(std::future::pending()));
        Shelf { link, sessions }
    })
}

/// Runs a test on the page at `more` after the link.
fn with_view(more: impl FnOnce(&Shelf) -> String, test: impl FnOnce(&mut Page<'_>)) {
    with_page(
        || comparison(),
        |page| {
            let shelf = shelf();
            page.visit(&format!("{}{}", shelf.link, more(shelf)))
                .unwrap();
            test(page);
            let found = complaints(page, "", "http://127.0.0.1:");
            assert!(found.is_empty(), "{found:#?}");
        },
    );
}

/// Files of a ZIP archive.
fn unzipped(bytes: Vec<u8>) -> Vec<(String, Vec<u8>)> {
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
    let files = 0..archive.len();
    let files = files.map(|n| {
        // Also checks the digest.
        let mut file = archive.by_index(n).unwrap();
        let mut content = Vec::new();
        file.read_to_end(&mut content).unwrap();
        (file.name().unwrap().into_owned(), content)
    });
    files.collect()
}

/// Pictures of a clip with their size, and the rows of its table.
fn clip(page: &mut Page<'_>, length_s: &str) -> (Vec<(u32, u32)>, Vec<csv::StringRecord>) {
    page.evaluate(&format!("(() => {{ const [length, rate] = document.querySelectorAll('.saving input'); length.value = {length_s}; rate.value = 10; }})()"))
        .unwrap();
    let (name, bytes) = page.download("#save-clip").unwrap();
    assert!(name.ends_with(".clip.zip"), "{name}");
    let (table, pictures): (Vec<_>, Vec<_>) = unzipped(bytes)
        .into_iter()
        .partition(|(name, _)| name == "frames.csv");
    let sizes = pictures.iter().map(|(name, content)| {
        assert!(name.ends_with(".png"), "{name}");
        let reader = png::Decoder::new(Cursor::new(content)).read_info().unwrap();
        (reader.info().width, reader.info().height)
    });
    let rows = csv::Reader::from_reader(&*table[0].1).into_records();
    (sizes.collect(), rows.map(Result::unwrap).collect())
}

/// Both cameras' pictures show the clusters of the chosen press.
const SEEN: &str = "(all => all.length > 1 && all.every(c => c.getAttribute('aria-label').includes('clusters in the press')))([...document.querySelectorAll('canvas')])";

#[test]
fn a_session_is_played_back_with_clusters_marks_and_rays() {
    with_view(
        |shelf| format!("&session={}", shelf.sessions[0]),
        |page| {
            page.wait_for(SEEN).unwrap();
            let count = |page: &mut Page<'_>, what: &str| {
                page.evaluate(&format!("document.querySelectorAll('{what}').length"))
                    .unwrap()
            };
            assert_eq!(count(page, ".map .ray"), json!(2));
            assert_eq!(count(page, ".map .meeting"), json!(1));
            let marks = "[...document.querySelectorAll('.strip .clock')].map(p => p.getAttribute('d').split('M').length - 1)";
            let marks = page.evaluate(marks).unwrap();
            assert!(
                marks[0].as_u64() > marks[1].as_u64() && marks[1].as_u64() > Some(0),
                "{marks}"
            );
            // The largest cluster is drawn in its colour; without clusters it is not.
            let drawn = "(() => { const c = document.querySelector('canvas'); const own = Object.assign(document.createElement('canvas'), { width: 640, height: 480 }).getContext('2d', { willReadFrequently: true }); own.drawImage(c, 0, 0); const d = own.getImageData(0, 0, 640, 480).data; \
                         let n = 0; for (let i = 0; i < d.length; i += 4) if (d[i + 3] && d[i] > 190 && d[i + 1] < 140 && d[i + 2] < 60) n++; return n; })()";
            let with = page.evaluate(drawn).unwrap().as_u64().unwrap();
            page.click(".transport input[type=checkbox]").unwrap();
            page.wait_for(&format!("!({SEEN})")).unwrap();
            let without = page.evaluate(drawn).unwrap().as_u64().unwrap();
            assert!(with > without + 100, "{with}, {without}");
            page.click(".transport input[type=checkbox]").unwrap();
            page.wait_for(SEEN).unwrap();
            save_picture(page, "view-light", true);
            // Keys: the next press on the map, then playback.
            let press = "document.querySelector('.strip ~ p').textContent.split(':')[0]";
            let first = page.text(press).unwrap();
            page.evaluate("document.querySelector('.map svg').focus()")
                .unwrap();
            page.key("ArrowRight").unwrap();
            page.wait_for(&format!("{press} !== {}", json!(first)))
                .unwrap();
            let time = "Number(document.querySelector('.time input').value)";
            let before = page.evaluate(time).unwrap();
            page.evaluate("document.querySelector('#play').focus()")
                .unwrap();
            page.key("Enter").unwrap();
            page.wait_for(&format!("{time} > {before}")).unwrap();
            page.key("Enter").unwrap();
            page.wait_for("document.querySelector('#play').textContent === 'Play'")
                .unwrap();
            let found = identifiers(page);
            assert!(found.is_empty(), "{found:?}");
        },
    );
}

/// An onset is a tick of the strip; the touch is shown until it ends, and a reaction ends none.
#[test]
fn touches_that_were_felt_are_drawn_until_they_end() {
    with_view(
        |shelf| format!("&session={}", shelf.sessions[0]),
        |page| {
            page.wait_for(SEEN).unwrap();
            page.evaluate(
                "(() => { const at = [4, 5], touches = [[2, 'onset', at, null], [2.1, 'position', at, null], [2.2, 'lifted', null, null], [3, 'release', null, null], [20, 'onset', at, null]]; \
                 Promise.all([import('/app/timeline.js'), import('/app/player.js')]).then(([{ timeline }, { feltAt }]) => { \
                 const strip = timeline('strip', () => {}); \
                 strip.draw({ span_s: [0, 30], rates: [[1], [1]], marks: [], notes: [], interruptions: [], touches }, [], [0, 10]); \
                 window.ticks = strip.svg.querySelector('.felt').getAttribute('d').split('M').length - 1; \
                 window.felt = [1, 2, 2.5, 3.5].map(t => feltAt(touches, t)?.at_mm ?? null); }); })()",
            )
            .unwrap();
            page.wait_for("window.felt !== undefined").unwrap();
            assert_eq!(page.evaluate("window.ticks").unwrap(), json!(1));
            let felt = page.evaluate("window.felt").unwrap();
            assert_eq!(felt, json!([null, [4, 5], [4, 5], null]));
        },
    );
}

#[test]
fn what_is_shown_is_saved() {
    with_view(
        |shelf| format!("&session={}", shelf.sessions[0]),
        |page| {
            page.wait_for(SEEN).unwrap();
            page.evaluate(
                "document.querySelector('.transport input[type=number]:last-of-type').value",
            )
            .unwrap();
            let (name, bytes) = page.download("#save-table").unwrap();
            assert!(name.ends_with(".csv"), "{name}");
            let said = page
                .text("document.querySelector('canvas').getAttribute('aria-label')")
                .unwrap();
            let shown = said.split([':', ' ']).find_map(|w| {
                let number = w.parse::<usize>().ok()?;
                (number > 2).then_some(number)
            });
            assert_eq!(Some(crate::downloads::rows(&bytes).1), shown, "{said}");
            page.evaluate("document.querySelectorAll('.saving select')[1].value = 'npz'")
                .unwrap();
            let (name, bytes) = page.download("#save-table").unwrap();
            assert!(name.ends_with(".npz"), "{name}");
            let arrays = unzipped(bytes);
            assert!(arrays.len() == 1 && arrays[0].1.starts_with(b"\x93NUMPY"));
            let (sizes, rows) = clip(page, "0.5");
            assert_eq!((sizes.len(), rows.len()), (6, 6));
            assert!(sizes.iter().all(|size| *size == (960, 680)), "{sizes:?}");
        },
    );
}

#[test]
fn two_sessions_play_in_lock_step() {
    with_view(
        |shelf| {
            format!(
                "&session={}&beside={}",
                shelf.sessions[0], shelf.sessions[1]
            )
        },
        |page| {
            page.wait_for(SEEN).unwrap();
            let presses = "[...document.querySelectorAll('.strip ~ p:nth-last-of-type(2)')].map(p => p.textContent.split(':')[0])";
            let same = format!(
                "(p => p.length === 2 && p[0] === p[1] && p[0].startsWith('Press '))({presses})"
            );
            page.wait_for(&same).unwrap();
            let before = page.evaluate(presses).unwrap();
            page.click(".transport button:nth-of-type(3)").unwrap();
            page.wait_for(&format!("{presses}[0] !== {}", before[0]))
                .unwrap();
            page.wait_for(&same).unwrap();
            page.wait_for(SEEN).unwrap();
            save_picture(page, "view-beside", true);
            let (sizes, rows) = clip(page, "0.3");
            assert!(sizes.iter().all(|size| *size == (960, 1360)), "{sizes:?}");
            assert_eq!(rows.len(), 2 * sizes.len());
            // Both clocks advance together.
            let offsets: Vec<f64> = rows
                .chunks(2)
                .map(|pair| pair[1][2].parse::<f64>().unwrap() - pair[0][2].parse::<f64>().unwrap())
                .collect();
            assert!(
                offsets.iter().all(|o| (o - offsets[0]).abs() < 1e-9),
                "{offsets:?}"
            );
            assert!(rows.iter().all(|row| row[3] == rows[0][3]));
            check_phone(page, "view-beside-phone");
        },
    );
}

#[test]
fn the_shelf_shows_trends_and_names_settings_for_people() {
    with_view(
        |_| String::new(),
        |page| {
            page.wait_for("document.querySelectorAll('.trend circle').length === 2")
                .unwrap();
            for n in [1, 2] {
                page.click(&format!("tbody tr:nth-child({n}) input"))
                    .unwrap();
            }
            page.click("#differences").unwrap();
            let labels = "[...document.querySelectorAll('[role=status] tbody td:first-child')].map(td => td.textContent)";
            page.wait_for(&format!("{labels}.length > 0")).unwrap();
            let labels = page.evaluate(labels).unwrap();
            let labels: Vec<&str> = labels
                .as_array()
                .unwrap()
                .iter()
                .map(|l| l.as_str().unwrap())
                .collect();
            assert!(labels.contains(&"simulation: seed"), "{labels:?}");
            assert!(!labels.iter().any(|l| l.contains('_')), "{labels:?}");
            let found = identifiers(page);
            assert!(found.is_empty(), "{found:?}");
            save_picture(page, "view-shelf", true);
            page.media("", "dark").unwrap();
            let body = format!("{LIGHTNESS}(getComputedStyle(document.body).backgroundColor)");
            assert!(page.evaluate(&body).unwrap().as_f64().unwrap() < 60.0);
            page.click("#beside").unwrap();
            page.wait_for(SEEN).unwrap();
            save_picture(page, "view-dark", true);
        },
    );
}

#[test]
fn a_screen_reader_finds_names_for_everything() {
    with_view(
        |shelf| format!("&session={}", shelf.sessions[0]),
        |page| {
            page.wait_for(SEEN).unwrap();
            let tree = page.call("Accessibility.getFullAXTree", json!({})).unwrap();
            let nodes = tree["nodes"].as_array().unwrap();
            let text = |node: &Value, what: &str| {
                node[what]["value"].as_str().unwrap_or_default().to_owned()
            };
            let roles = [
                "button",
                "slider",
                "spinbutton",
                "checkbox",
                "combobox",
                "image",
                "region",
                "link",
                "group",
            ];
            let mut seen = std::collections::BTreeSet::new();
            for node in nodes.iter().filter(|n| n["ignored"] != true) {
                let role = text(node, "role");
                if roles.contains(&&*role) {
                    assert!(!text(node, "name").is_empty(), "{node}");
                    seen.insert(role);
                }
            }
            for role in [
                "button",
                "slider",
                "spinbutton",
                "checkbox",
                "combobox",
                "image",
            ] {
                assert!(seen.contains(role), "{role}: {seen:?}");
            }
            check_phone(page, "view-phone");
        },
    );
}
