//! Plots: scales and axes, marks in data coordinates, legends, and the sheets that arrange plots as a figure.
//!
//! A figure names its data and labels; [`Sheet`] places them. Maps and images draw on a [`Canvas`] themselves.

mod axis;
mod canvas;
mod legend;
mod marks;
mod path;
mod scale;
mod sheet;

pub(crate) use axis::{Axis, LeftTexts, draw as draw_axes};
pub(crate) use canvas::Canvas;
pub use canvas::Figure;
pub(crate) use legend::{Sample, colour_bar, column};
pub(crate) use marks::Plot;
pub(crate) use path::{band, circle, press_path, rectangle, squares};
pub(crate) use scale::{Place, Scale, extent, nice_above, scale_end, tick_label, ticks};
pub(crate) use sheet::{HALF, Sheet, WIDE};
