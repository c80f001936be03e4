//! Locators: what turns the columns of both cameras into a position, learnt from the calibration presses.
//!
//! A [`Method`] declares what it needs and fits calibration presses; a [`FittedLocator`] locator sees the [`Features`] of a press
//! and returns a position, a 95 % region and a flag. Built in are the geometry (rays intersect), the field (the geometry
//! predicts what each camera reads at a position, a Gaussian process corrects it, and the position that explains all
//! readings best is found), and the direct field (the same with a polynomial instead of a geometry). Both also read how far
//! the events of a press spread, which tells the distance from a camera. `choose` compares them at held-out locations. Decision and measurements: `docs/adr/0038-*`.

mod choose;
mod features;
mod field;
mod fit_error;
mod fitted;
mod inverse;
mod learnt_area;
mod likelihood;
mod methods;
mod parts;
mod prediction;
mod quasi_newton;
mod rays;
mod reading;
mod regions;
mod reliability;
mod remount;
mod robust;
mod samples;
mod spread;

pub(crate) use choose::{Effort, choose};
pub use choose::{LocatorChoice, choose_locator, held_out_errors};
pub use features::{CameraFeatures, Features};
pub use fit_error::{FitError, LocatorModelError};
pub use fitted::{FittedLocator, Location};
pub use methods::{Feature, FitStart, Hyperparameters, Method, Requirements, method};
pub(crate) use quasi_newton::{ValueAndGradient, minimise};
pub(crate) use reliability::reliability;
pub use remount::{EarlierCalibration, Recalibrated};
pub(crate) use robust::{log_density, student_weight};
pub(crate) use samples::thinned;
