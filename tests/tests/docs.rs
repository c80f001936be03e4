//! The documentation: every relative link and anchor resolves, the summary lists every page, and the whole stays short.
#![expect(
    clippy::unwrap_used,
    reason = "a test that cannot read the documentation must fail"
)]

use std::collections::BTreeSet;
use std::fs::{read_dir, read_to_string};
use std::path::{Path, PathBuf};

/// Most words of all pages together, as `wc -w` counts them.
const WORDS: usize = 33_000;

fn top() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("..")
        .canonicalize()
        .unwrap()
}

/// The pages of the root and of `docs/`.
fn pages() -> Vec<PathBuf> {
    let mut pages: Vec<PathBuf> = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md"]
        .map(|name| top().join(name))
        .to_vec();
    let mut folders = vec![top().join("docs")];
    while let Some(folder) = folders.pop() {
        for entry in read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "md") {
                pages.push(path);
            }
        }
    }
    pages
}

/// The text without blocks of code.
fn prose(page: &Path) -> String {
    let text = read_to_string(page).unwrap();
    let parts = text.split("```").step_by(2);
    parts.collect()
}

/// Targets of inline links, without those to other sites.
fn links(page: &Path) -> Vec<String> {
    let text = prose(page);
    let targets = text.split("](").skip(1);
    targets
        .filter_map(|rest| Some(rest.split_once(')')?.0.to_owned()))
        .filter(|target| !target.contains("://"))
        .collect()
}

/// Anchors of the headings, as GitHub and mdbook make them.
fn anchors(page: &Path) -> BTreeSet<String> {
    let text = prose(page);
    let headings = text.lines().filter(|line| line.starts_with('#'));
    headings
        .map(|line| {
            let title = line.trim_start_matches('#').trim().to_lowercase();
            let kept = title.chars().filter_map(|c| match c {
                ' ' => Some('-'),
                c if c.is_alphanumeric() || c == '-' || c == '_' => Some(c),
                _ => None,
            });
            kept.collect()
        })
        .collect()
}

#[test]
fn every_relative_link_and_anchor_resolves() {
    let mut broken = Vec::new();
    let mut seen = 0;
    for page in pages() {
        for link in links(&page) {
            seen += 1;
            let (file, anchor) = link.split_once('#').unwrap_or((&link, ""));
            let target = if file.is_empty() {
                page.clone()
            } else {
                page.parent().unwrap().join(file)
            };
            let found = target.exists() && (anchor.is_empty() || anchors(&target).contains(anchor));
            // The site is built from `docs/` alone.
            let docs = top().join("docs");
            let on_site = !page.starts_with(&docs)
                || target.canonicalize().is_ok_and(|t| t.starts_with(&docs));
            if !found || !on_site {
                broken.push(format!("{}: {link}", page.display()));
            }
        }
    }
    assert!(broken.is_empty(), "broken links:\n{}", broken.join("\n"));
    assert!(seen > 80, "{seen}");
}

#[test]
fn the_summary_lists_every_page_once() {
    let docs = top().join("docs");
    let listed = links(&docs.join("SUMMARY.md"));
    let mut expected: Vec<String> = pages()
        .iter()
        .filter_map(|page| page.strip_prefix(&docs).ok())
        .map(|page| page.to_str().unwrap().to_owned())
        .filter(|page| page != "SUMMARY.md")
        .collect();
    let mut listed = listed.clone();
    listed.sort();
    expected.sort();
    assert_eq!(listed, expected);
}

#[test]
fn the_pages_stay_short() {
    let words = |page: &PathBuf| read_to_string(page).unwrap().split_whitespace().count();
    let total: usize = pages().iter().map(words).sum();
    assert!(
        total <= WORDS,
        "expected at most {WORDS} words, found {total}"
    );
}
