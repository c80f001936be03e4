//! Owns the look that pages of other crates share with the report.

/// Style sheet of every page: colours in light and dark, text, tables, cards.
pub const PAGE: &str = crate::document::STYLE;
/// Style sheet of figures inside an element of class `fig`; comes after [`PAGE`].
pub const FIGURE: &str = crate::svg::FIGURE_CSS;
/// Script of every page: the buttons `#theme` and `#print`.
pub const SCRIPT: &str = crate::document::SCRIPT;
