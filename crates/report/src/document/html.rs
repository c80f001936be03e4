//! Renders a document as a self-contained page, with a policy that allows only its own script.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest, Sha256};

use super::text::open;
use super::{Banner, Block, Document, Fact, Group, Note, Section, Table, Text, Tone};
use crate::markup::Markup;
use crate::plot::Figure;
use crate::svg::{FIGURE_CSS, plain_css};

/// Style of all pages.
pub(crate) const STYLE: &str = include_str!("../../assets/frame/page.css");
/// Script of all pages; comes before the page's own.
pub(crate) const SCRIPT: &str = include_str!("../../assets/frame/theme.js");
/// Scripts of pages with data.
const DATA_SCRIPTS: [&str; 2] = [
    include_str!("../../assets/script/core.js"),
    include_str!("../../assets/script/download.js"),
];
/// Buttons of all pages.
const TOOLS: &str = r#"<div class="tools"><button type="button" id="theme" data-testid="theme" aria-label="Switch between light and dark">Dark</button><button type="button" id="print">Print</button></div>"#;

impl Document {
    /// The page.
    pub(crate) fn html(&self) -> String {
        let of_data = self.data.as_ref().map(|_| DATA_SCRIPTS.concat());
        let script = [SCRIPT, &of_data.unwrap_or_default(), &self.script].concat();
        let digest = STANDARD.encode(Sha256::digest(&script));
        let policy = format!(
            "default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}'; img-src data:; base-uri \
             'none'; form-action 'none'"
        );
        let mut out = Markup::new();
        out.raw("<!doctype html>\n");
        out.open("html", &[("lang", &"en")]).open("head", &[]);
        out.raw("<meta charset=\"utf-8\">");
        out.raw("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">");
        out.raw("<meta name=\"color-scheme\" content=\"light dark\">");
        // A digest has no characters to escape.
        out.raw(&format!(
            "<meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n"
        ));
        out.holding("title", &[], &self.title);
        for style in [STYLE, FIGURE_CSS].iter().chain(&self.styles) {
            out.raw("\n<style>").raw(style).raw("</style>");
        }
        out.close();
        let unusable = if self.is_unusable { "unusable" } else { "" };
        open(&mut out, "body", &[("class", unusable)]);
        self.head(&mut out);
        out.open("main", &[]);
        for section in &self.sections {
            section.write(&mut out);
        }
        out.close();
        let about = format!(
            "{} This file is self-contained and loads nothing.",
            self.about
        );
        out.open("footer", &[]).holding("p", &[], &about).close();
        if let Some(data) = &self.data {
            out.raw("\n<script type=\"text/plain\" id=\"figure-style\">");
            out.raw(&plain_css()).raw("</script>\n");
            out.raw("<script type=\"application/json\" id=\"report-data\">");
            out.raw(&script_json(data)).raw("</script>");
        }
        out.raw("\n<script>").raw(&script).raw("</script>");
        out.finish()
    }

    fn head(&self, out: &mut Markup) {
        let (to, words) = self.skip;
        out.holding("a", &[("class", &"skip"), ("href", &to)], words);
        out.open("header", &[]).open("div", &[("class", &"top")]);
        out.open("div", &[]);
        out.holding("p", &[("class", &"brand")], self.brand);
        out.holding("h1", &[("data-testid", &self.heading_id)], &self.heading);
        for line in &self.subheads {
            paragraph(out, "sub", line);
        }
        out.close();
        out.open("div", &[("class", &"side")]);
        out.open("div", &[("class", &"badges")]);
        for badge in &self.badges {
            badge.write(out);
        }
        out.close().raw(TOOLS).close().close();
        for banner in &self.banners {
            banner.write(out);
        }
        out.close();
        let contents = || self.sections.iter().flat_map(|s| &s.contents);
        if contents().next().is_some() {
            out.open("nav", &[("aria-label", &"Contents")])
                .open("div", &[]);
            for (id, name) in contents() {
                out.holding("a", &[("href", &format_args!("#{id}"))], name);
            }
            out.close().close();
        }
    }
}

fn paragraph(out: &mut Markup, class: &str, text: &Text) {
    open(out, "p", &[("class", class)]);
    text.write(out);
    out.close();
}

impl Banner {
    fn write(&self, out: &mut Markup) {
        let attributes = [
            ("class", self.class),
            ("role", self.role),
            ("data-testid", &self.id),
        ];
        open(out, "p", &attributes);
        out.holding("strong", &[], &format!("{}.", self.label));
        out.words(" ").words(&self.words).close();
    }
}

impl Section {
    fn write(&self, out: &mut Markup) {
        // Controls that follow all sections while the page scrolls belong to none of them.
        if self.id.is_empty() {
            return write_all(&self.blocks, out);
        }
        let heading = format!("{}-h", self.id);
        let attributes = [
            ("class", self.class),
            ("id", &self.id),
            ("aria-labelledby", &heading),
            ("data-testid", &self.test_id),
        ];
        out.raw("\n");
        open(out, "section", &attributes);
        let hidden = if self.is_hidden { "hidden" } else { "" };
        if !self.tools.is_empty() {
            out.open("div", &[("class", &"tools-row")]);
        }
        open(out, "h2", &[("id", heading.as_str()), ("class", hidden)]);
        out.words(&self.title).close();
        if !self.tools.is_empty() {
            out.raw(self.tools).close();
        }
        write_all(&self.blocks, out);
        out.close();
    }
}

fn write_all(blocks: &[Block], out: &mut Markup) {
    for block in blocks {
        match block {
            Block::Text(class, text) => paragraph(out, class, text),
            Block::Heading(tag, text) => {
                out.open(tag, &[]);
                text.write(out);
                out.close();
            }
            Block::Note(note) => note.write(out),
            Block::Commands(commands) => {
                out.holding("pre", &[], &commands.join("\n"));
            }
            Block::Table(table) => table.write(out),
            Block::Facts(facts) => write_facts(facts, out),
            Block::Figure(figure, controls) => write_figure(figure, controls, out),
            Block::Group(group) => group.write(out),
            Block::Markup(markup) => {
                out.raw(markup);
            }
        }
    }
}

impl Note {
    fn write(&self, out: &mut Markup) {
        let class = match self.tone {
            Tone::Plain | Tone::Answer => "notice",
            Tone::Good => "notice ok",
            Tone::Warning => "notice warn",
            Tone::Bad => "notice bad",
        };
        open(out, "p", &[("class", class), ("data-testid", self.test_id)]);
        if !self.label.is_empty() {
            out.holding("b", &[], &self.label).words(" ");
        }
        self.text.write(out);
        out.close();
    }
}

impl Group {
    fn write(&self, out: &mut Markup) {
        let mut attributes = vec![("class", self.class.as_str())];
        attributes.extend(
            self.attributes
                .iter()
                .map(|(name, value)| (*name, &**value)),
        );
        attributes.push(("open", if self.is_open { "open" } else { "" }));
        let tag = if self.summary.is_some() {
            "details"
        } else {
            "div"
        };
        out.raw("\n");
        open(out, tag, &attributes);
        if let Some(summary) = &self.summary {
            out.open("summary", &[]);
            summary.write(out);
            out.close();
        }
        if let Some((name, data)) = &self.download {
            out.open("div", &[("class", &"bar")]);
            let is_bare = self.heading.is_empty();
            out.holding(if is_bare { "span" } else { "h3" }, &[], &self.heading);
            out.open("span", &[("class", &"tools")]);
            let label = format!("Download the data of {data} as CSV");
            button(out, "csv", &format!("{name}-csv"), &label);
            out.close().close();
        } else if !self.heading.is_empty() {
            out.holding("h3", &[], &self.heading);
        }
        write_all(&self.blocks, out);
        out.close();
    }
}

fn button(out: &mut Markup, kind: &str, test_id: &str, label: &str) {
    let attributes = [
        ("type", "button"),
        ("data-save", kind),
        ("data-testid", test_id),
        ("aria-label", label),
    ];
    open(out, "button", &attributes);
    out.words(&kind.to_uppercase()).close();
}

impl Table {
    fn write(&self, out: &mut Markup) {
        let region = [
            ("class", "scroll"),
            ("tabindex", "0"),
            ("role", "region"),
            ("aria-label", &self.title),
        ];
        open(out, "div", &region);
        let id = if self.class.is_empty() { "" } else { &self.id };
        open(out, "table", &[("class", self.class), ("data-testid", id)]);
        out.holding("caption", &[("class", &"hidden")], &self.title);
        let columns = || self.columns.iter().map(|c| c.page.as_ref());
        if columns().flatten().any(|(name, _)| !name.is_empty()) {
            out.open("thead", &[]).open("tr", &[]);
            for (name, class) in columns().flatten() {
                let class = if class.starts_with("num") { "num" } else { "" };
                open(out, "th", &[("scope", "col"), ("class", class)]);
                out.words(name).close();
            }
            out.close().close();
        }
        out.open("tbody", &[]);
        for row in &self.rows {
            open(out, "tr", &row.attributes);
            let cells = columns()
                .zip(&row.cells)
                .filter_map(|(c, cell)| Some((c?, cell)));
            for (i, ((_, class), cell)) in cells.enumerate() {
                let (tag, scope) = if i == 0 { ("th", "row") } else { ("td", "") };
                open(out, tag, &[("scope", scope), ("class", class)]);
                cell.write(out);
                if let Some(remark) = row.remark.filter(|_| i == 0) {
                    out.words(&format!(" ({remark})"));
                }
                out.close();
            }
            out.close().raw("\n");
        }
        out.close().close().close();
    }
}

fn write_facts(facts: &[Fact], out: &mut Markup) {
    out.open("dl", &[("class", &"facts")]);
    for fact in facts {
        let class = if fact.is_wide { "wide" } else { "" };
        open(out, "div", &[("class", class), ("title", &fact.title)]);
        out.holding("dt", &[], &fact.key).open("dd", &[]);
        fact.value.write(out);
        out.close().close().raw("\n");
    }
    out.close();
}

fn write_figure(f: &Figure, controls: &str, out: &mut Markup) {
    let test_id = format!("figure-{}", f.id);
    let attributes = [
        ("class", "card figure"),
        ("data-testid", &test_id),
        ("data-figure", &f.id),
        ("data-table", f.table),
        ("data-interaction", f.interaction),
    ];
    out.raw("\n");
    open(out, "figure", &attributes);
    out.open("div", &[("class", &"bar")]);
    out.holding("h3", &[("id", &format_args!("{}-heading", f.id))], &f.title);
    out.open("span", &[("class", &"tools")]);
    for (kind, what) in [("svg", ""), ("csv", "the data of ")] {
        let label = format!("Download {what}{} as {}", f.title, kind.to_uppercase());
        button(out, kind, &format!("{}-{kind}", f.id), &label);
    }
    out.close().close().raw(controls);
    let keys = match f.interaction {
        "" => String::new(),
        "select" => format!(
            "{}: arrow keys move from press to press, Home and End jump, Escape clears",
            f.title
        ),
        _ => format!(
            "{}: plus and minus zoom, arrow keys move, 0 resets",
            f.title
        ),
    };
    let (tab, role) = if keys.is_empty() {
        ("", "")
    } else {
        ("0", "group")
    };
    let canvas = [
        ("class", "canvas"),
        ("tabindex", tab),
        ("role", role),
        ("aria-label", &keys),
    ];
    open(out, "div", &canvas);
    out.raw(&f.svg).close();
    out.holding("figcaption", &[], &f.caption).close();
}

/// JSON that is safe inside `<script>`: escapes `<`, `>`, `&` and JavaScript's line separators, so no text can end the
/// element or open a comment.
fn script_json(value: &serde_json::Value) -> String {
    let mut value = value.clone();
    show_all(&mut value);
    let text = value.to_string();
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '<' => out.push_str("\\u003c"),
            '>' => out.push_str("\\u003e"),
            '&' => out.push_str("\\u0026"),
            '\u{2028}' => out.push_str("\\u2028"),
            '\u{2029}' => out.push_str("\\u2029"),
            c => out.push(c),
        }
    }
    out
}

/// Escapes control characters in every text of `value`.
fn show_all(value: &mut serde_json::Value) {
    use serde_json::Value as Json;
    match value {
        Json::String(text) => {
            if let std::borrow::Cow::Owned(shown) = skinrig_model::text::visible(text) {
                *text = shown;
            }
        }
        Json::Array(items) => items.iter_mut().for_each(show_all),
        Json::Object(map) => map.values_mut().for_each(show_all),
        Json::Null | Json::Bool(_) | Json::Number(_) => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_runs_the_scripts_of_its_frame_and_names_their_digest() {
        let document = Document {
            heading: "<i>\u{1b}[2J</i>".to_owned(),
            script: "own();\n".to_owned(),
            ..Document::default()
        };
        let page = document.html();
        let between = |from: &str, to: &str| {
            let (_, rest) = page.split_once(from).unwrap();
            rest.split(to).next().unwrap().to_owned()
        };
        let script = between("<script>", "</script>");
        assert!(script.contains("#theme") && script.ends_with("own();\n"));
        assert_eq!(
            between("script-src 'sha256-", "'"),
            STANDARD.encode(Sha256::digest(&script))
        );
        assert_eq!(page.matches("<script").count(), 1);
        assert!(page.contains("<button type=\"button\" id=\"theme\""));
        assert!(page.contains("&lt;i&gt;\\u{1b}[2J"));
    }

    #[test]
    fn script_json_cannot_end_its_element() {
        let text = script_json(&serde_json::json!("</script><!--\u{2028}&"));
        assert_eq!(
            text,
            "\"\\u003c/script\\u003e\\u003c!--\\\\u{2028}\\u0026\""
        );
        let back: String = serde_json::from_str(&text).unwrap();
        assert_eq!(back, "</script><!--\\u{2028}&");
    }
}
