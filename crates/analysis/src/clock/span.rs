//! Contact period of a press.

/// Contact and release of one press on the host clock, µs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressSpan {
    /// First contact.
    pub contact_us: f64,
    /// Release.
    pub release_us: f64,
    /// A sync press: one of a few at one location that are seen together or not at all.
    pub sync: bool,
}
