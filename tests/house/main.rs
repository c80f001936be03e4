//! Checks of the workspace itself.

mod architecture;
mod circles;
mod docs;
mod surface;
