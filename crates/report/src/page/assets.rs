//! Owns the page's templates and script, besides the common frame.

/// Templates: the page, and one file per section.
pub(super) const TEMPLATES: [(&str, &str); 14] = [
    ("page.html", include_str!("../../assets/page.html")),
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
/// One script: each part but the first is wrapped in its own function.
pub(super) const SCRIPT: &str = concat!(
    include_str!("../../assets/script/core.js"),
    include_str!("../../assets/script/filter.js"),
    include_str!("../../assets/script/download.js"),
    include_str!("../../assets/script/map.js"),
    include_str!("../../assets/script/rates.js"),
    include_str!("../../assets/script/presses.js"),
);
