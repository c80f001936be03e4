//! Owns what the page is made of: templates, style, script.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest, Sha256};

/// The templates: the page, its macros, and one file per section.
pub(super) const TEMPLATES: [(&str, &str); 15] = [
    ("page.html", include_str!("../../assets/page.html")),
    ("macros.html", include_str!("../../assets/macros.html")),
    (
        "sections/results.html",
        include_str!("../../assets/sections/results.html"),
    ),
    (
        "sections/filter.html",
        include_str!("../../assets/sections/filter.html"),
    ),
    (
        "sections/skin.html",
        include_str!("../../assets/sections/skin.html"),
    ),
    (
        "sections/errors.html",
        include_str!("../../assets/sections/errors.html"),
    ),
    (
        "sections/events.html",
        include_str!("../../assets/sections/events.html"),
    ),
    (
        "sections/single.html",
        include_str!("../../assets/sections/single.html"),
    ),
    (
        "sections/calibration.html",
        include_str!("../../assets/sections/calibration.html"),
    ),
    (
        "sections/reduction.html",
        include_str!("../../assets/sections/reduction.html"),
    ),
    (
        "sections/detection.html",
        include_str!("../../assets/sections/detection.html"),
    ),
    (
        "sections/rates.html",
        include_str!("../../assets/sections/rates.html"),
    ),
    (
        "sections/comparison.html",
        include_str!("../../assets/sections/comparison.html"),
    ),
    (
        "sections/session.html",
        include_str!("../../assets/sections/session.html"),
    ),
    (
        "sections/presses.html",
        include_str!("../../assets/sections/presses.html"),
    ),
];
pub(crate) const PAGE_CSS: &str = include_str!("../../assets/page.css");
/// One script: each part but the first stands in a function of its own.
pub(super) const SCRIPT: &str = concat!(
    include_str!("../../assets/script/core.js"),
    include_str!("../../assets/script/theme.js"),
    include_str!("../../assets/script/filter.js"),
    include_str!("../../assets/script/download.js"),
    include_str!("../../assets/script/map.js"),
    include_str!("../../assets/script/rates.js"),
    include_str!("../../assets/script/presses.js"),
);

/// The script's digest as a content security policy names it: nothing else on the page may run.
pub(super) fn script_hash() -> String {
    format!("sha256-{}", STANDARD.encode(Sha256::digest(SCRIPT)))
}
