//! Owns the page: its files, which are part of the program, and the headers that let it load nothing else.

use axum::extract::Path;
use axum::http::{HeaderName, HeaderValue, header};
use axum::response::{IntoResponse, Response};

use crate::problem::Problem;

/// Headers of every answer.
pub(crate) const HEADERS: [(HeaderName, &str); 6] = [
    (
        header::CONTENT_SECURITY_POLICY,
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; media-src blob:; \
         base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    ),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, "no-referrer"),
    (header::CACHE_CONTROL, "no-store"),
    (
        HeaderName::from_static("cross-origin-resource-policy"),
        "same-origin",
    ),
    (
        HeaderName::from_static("cross-origin-opener-policy"),
        "same-origin",
    ),
];

const PAGE: &str = include_str!("../assets/page.html");
const SCRIPT: &str = "text/javascript; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";

/// Files below `/app/`: name, type and content.
const FILES: [(&str, &str, &str); 20] = [
    ("page.css", STYLE, skinrig_report::style::PAGE),
    ("figure.css", STYLE, skinrig_report::style::FIGURE),
    ("view.css", STYLE, include_str!("../assets/view.css")),
    ("theme.js", SCRIPT, skinrig_report::style::SCRIPT),
    ("main.js", SCRIPT, include_str!("../assets/main.js")),
    ("api.js", SCRIPT, include_str!("../assets/api.js")),
    ("dom.js", SCRIPT, include_str!("../assets/dom.js")),
    ("shelf.js", SCRIPT, include_str!("../assets/shelf.js")),
    ("session.js", SCRIPT, include_str!("../assets/session.js")),
    ("player.js", SCRIPT, include_str!("../assets/player.js")),
    (
        "transport.js",
        SCRIPT,
        include_str!("../assets/transport.js"),
    ),
    ("timeline.js", SCRIPT, include_str!("../assets/timeline.js")),
    ("beside.js", SCRIPT, include_str!("../assets/beside.js")),
    ("saving.js", SCRIPT, include_str!("../assets/saving.js")),
    ("frame.js", SCRIPT, include_str!("../assets/frame.js")),
    ("zip.js", SCRIPT, include_str!("../assets/zip.js")),
    ("trend.js", SCRIPT, include_str!("../assets/trend.js")),
    ("map.js", SCRIPT, include_str!("../assets/map.js")),
    ("camera.js", SCRIPT, include_str!("../assets/camera.js")),
    ("live.js", SCRIPT, include_str!("../assets/live.js")),
];

fn text(kind: &'static str, content: &'static str) -> Response {
    (
        [(header::CONTENT_TYPE, HeaderValue::from_static(kind))],
        content,
    )
        .into_response()
}

/// The page.
pub(crate) fn page() -> Response {
    text("text/html; charset=utf-8", PAGE)
}

/// A file of the page.
pub(crate) async fn file(Path(name): Path<String>) -> Response {
    match FILES.iter().find(|(known, ..)| *known == name) {
        Some((_, kind, content)) => text(kind, content),
        None => Problem::absent("expected a file of the page, found another name").into_response(),
    }
}
