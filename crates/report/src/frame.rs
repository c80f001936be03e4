//! Owns the parts common to all pages: head, heading, theme switch, style, and a policy that allows only their own script.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use minijinja::{AutoEscape, Environment, Value, context};
use sha2::{Digest, Sha256};
use skinrig_model::text::visible;

use crate::error::ReportError;

/// Base template that each page extends, and the macros that it may import.
const TEMPLATES: [(&str, &str); 2] = [
    ("frame.html", include_str!("../assets/frame/frame.html")),
    ("macros.html", include_str!("../assets/frame/macros.html")),
];
pub(crate) const STYLE: &str = include_str!("../assets/frame/page.css");
/// Comes before the page's own script.
pub(crate) const SCRIPT: &str = include_str!("../assets/frame/theme.js");

/// Additions of one kind of page to the frame.
pub(crate) struct Frame<'a> {
    /// Templates; the first one extends `frame.html`.
    pub templates: &'a [(&'static str, &'static str)],
    /// Style sheets, after the common one.
    pub styles: &'a [&'a str],
    /// Script, after the common one.
    pub script: &'a str,
}

impl Frame<'_> {
    /// Renders the page with this content.
    pub(crate) fn render(&self, content: Value) -> Result<String, ReportError> {
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
            // Digest for the content security policy, which blocks all other scripts.
            script_hash => safe(&format!("sha256-{}", STANDARD.encode(Sha256::digest(&script)))),
            ..content
        };
        let first = self.templates.first().map_or("frame.html", |t| t.0);
        let page = env.get_template(first)?.render(frame)?;
        // HTML forbids control characters (html.spec.whatwg.org, 13.2.3.5), and bidirectional controls would deceive
        // readers; names may contain any.
        Ok(visible(&page).into_owned())
    }
}

/// Trusted markup, style or script, inserted without escaping.
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
