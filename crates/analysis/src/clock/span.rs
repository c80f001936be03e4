//! When a press touched the skin.

/// Contact and release of one press on the host clock, µs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressSpan {
    /// First touch.
    pub contact_us: f64,
    /// Last touch.
    pub release_us: f64,
    /// A sync press: one of a few at one place that are seen together or not at all.
    pub sync: bool,
}
