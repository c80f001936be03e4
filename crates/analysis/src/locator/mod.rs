//! Locators: what turns the columns of both cameras into a position, learnt from the calibration presses.
//!
//! A [`Method`] declares what it needs and fits calibration presses; a [`Fitted`] locator sees the [`Features`] of a press
//! and returns a position, a 95 % region and a flag. Built in are the geometry (rays intersect), the field (Gaussian
//! processes on the residuals of the rays) and the direct field (on those of an affine map of the columns). `choose` compares
//! them at held-out locations. Decision and measurements: `docs/adr/0038-*`.

mod base;
mod choose;
mod field;
mod fitted;
mod methods;
mod precision;
mod quasi_newton;
mod regions;
mod samples;

pub(crate) use choose::{Effort, choose};
pub use choose::{LocatorChoice, choose_locator};
pub use fitted::{Features, Fitted, Location};
pub use methods::{Feature, Hyperparameters, METHODS, Method, Needs, Start, Unfit, method};
pub(crate) use regions::reliability;
