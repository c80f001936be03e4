//! Owns what all pages have in common: head, heading, theme switch, style, and that nothing runs on them but their own script.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use minijinja::{AutoEscape, Environment, Value, context};
use sha2::{Digest, Sha256};
use skinrig_model::text::visible;

use crate::error::ReportError;

/// The frame that each page's template extends, and the macros that it may import.
const TEMPLATES: [(&str, &str); 2] = [
    ("frame.html", include_str!("../assets/frame/frame.html")),
    ("macros.html", include_str!("../assets/frame/macros.html")),
];
const STYLE: &str = include_str!("../assets/frame/page.css");
/// Stands before the page's own script.
const SCRIPT: &str = include_str!("../assets/frame/theme.js");

/// What one kind of page adds to the frame.
pub(crate) struct Frame<'a> {
    /// Its templates; the first one extends `frame.html`.
    pub templates: &'a [(&'static str, &'static str)],
    /// Its style sheets, after that of all pages.
    pub styles: &'a [&'a str],
    /// Its script, after that of all pages.
    pub script: &'a str,
}

impl Frame<'_> {
    /// The page with this content.
    pub fn render(&self, content: Value) -> Result<String, ReportError> {
        let mut env = Environment::new();
        env.set_auto_escape_callback(|_| AutoEscape::Html);
        for (name, source) in TEMPLATES.iter().chain(self.templates) {
            env.add_template(name, source)?;
        }
        let script = format!("{SCRIPT}{}", self.script);
        let styles = [STYLE].into_iter().chain(self.styles.iter().copied());
        let frame = context! {
            styles => styles.map(safe).collect::<Vec<_>>(),
            script => safe(&script),
            // As a content security policy names it: nothing else on the page may run.
            script_hash => safe(&format!("sha256-{}", STANDARD.encode(Sha256::digest(&script)))),
            ..content
        };
        let first = self.templates.first().map_or("frame.html", |t| t.0);
        let page = env.get_template(first)?.render(frame)?;
        // HTML has no place for controls (html.spec.whatwg.org, 13.2.3.5), readers none for text that turns round; names may hold any.
        Ok(visible(&page).into_owned())
    }
}

/// Markup, style or script that stands in the page as it is.
pub(crate) fn safe(text: &str) -> Value {
    Value::from_safe_string(text.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_runs_the_scripts_of_its_frame_and_names_their_digest() {
        let frame = Frame {
            templates: &[(
                "own.html",
                "{% extends 'frame.html' %}{% block main %}{{ name }}{% endblock %}",
            )],
            styles: &["p{color:red}"],
            script: "own();\n",
        };
        let page = frame
            .render(context! { name => "<i>\u{1b}[2J</i>" })
            .unwrap();
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
}
