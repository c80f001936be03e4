//! Keys of the skin's frame and of the sync presses.

use skinrig_model::{HostDuration, OUTLINE_SHAPE, Point2, SkinOutline};
use skinrig_settings::{Collector, Field, Setting, Settings};

use super::ranges::{DEPTH_MM, LENGTH_MM, POSITIVE_LENGTH_MM, POSITIVE_SPAN_S, SPAN_S};
use crate::area::{Area, KeepOut, Surroundings};

/// The skin's outline and keep-outs.
#[derive(Settings)]
pub(crate) struct Frame {
    /// The skin's outline.
    #[setting(default = "paper", value = SkinOutline::PAPER)]
    #[setting(shape = OUTLINE_SHAPE, read = SkinOutline::read, show = Setting::text)]
    pub outline: SkinOutline,
    /// Every press stays at least this far inside the outline: half the width of the tip, and some.
    #[setting(default = "0 mm", range = LENGTH_MM)]
    pub margin_mm: f64,
    /// Areas that the tip must not enter.
    #[setting(items = 0..=1000)]
    pub keep_outs: Option<Vec<KeepOutKeys>>,
}

impl Frame {
    /// The surroundings of the skin.
    pub(crate) fn surroundings(&self) -> Surroundings {
        let keep_outs = self.keep_outs.iter().flatten();
        Surroundings {
            outline: self.outline,
            margin_mm: self.margin_mm,
            keep_outs: (1..)
                .zip(keep_outs)
                .filter_map(|(n, keys)| keys.keep_out(n))
                .collect(),
        }
    }
}

/// An area that the tip must not enter: a circle, a rectangle or a polygon.
#[derive(Settings)]
#[settings(name = "keep_out", exactly_one("circle", "rectangle", "polygon"))]
pub(crate) struct KeepOutKeys {
    /// A circle.
    circle: Option<Circle>,
    /// A rectangle along the axes.
    rectangle: Option<Rectangle>,
    /// A polygon by its corners, in order around it.
    #[setting(items = 3..=1000)]
    polygon: Option<Vec<Point2>>,
    /// The tip stays at least this far away from the area.
    #[setting(default = "0 mm", range = LENGTH_MM)]
    margin_mm: f64,
    /// Height of the obstacle above the surface; travel at or above it may pass over. Without it nothing passes over.
    #[setting(range = LENGTH_MM)]
    height_mm: Option<f64>,
    /// Name of the obstacle, for messages and pictures.
    name: Option<String>,
}

impl KeepOutKeys {
    fn keep_out(&self, number: usize) -> Option<KeepOut> {
        let name = self.name.clone();
        Some(KeepOut {
            name: name.unwrap_or_else(|| format!("keep-out {number}")),
            area: match self {
                Self {
                    circle: Some(c), ..
                } => Area::Circle {
                    centre: c.centre,
                    radius_mm: c.radius_mm,
                },
                Self {
                    rectangle: Some(r), ..
                } => Area::Polygon(r.corners().to_vec()),
                _ => Area::Polygon(self.polygon.clone()?),
            },
            margin_mm: self.margin_mm,
            height_mm: self.height_mm,
        })
    }
}

/// A circle.
#[derive(Settings)]
struct Circle {
    /// Its centre.
    centre: Point2,
    /// Its radius.
    #[setting(range = POSITIVE_LENGTH_MM)]
    radius_mm: f64,
}

/// A rectangle along the axes.
#[derive(Settings)]
#[settings(finish = Self::not_empty)]
struct Rectangle {
    /// The corner with the smaller x and y.
    min: Point2,
    /// The corner with the larger x and y.
    max: Point2,
}

impl Rectangle {
    fn corners(&self) -> [Point2; 4] {
        let (min, max) = (self.min, self.max);
        let corner = Point2::new;
        [
            min,
            corner(max.x_mm, min.y_mm),
            max,
            corner(min.x_mm, max.y_mm),
        ]
    }

    fn not_empty(self, field: &Field, out: &mut Collector) -> Option<Self> {
        let (min, max) = (self.min, self.max);
        if min.x_mm >= max.x_mm || min.y_mm >= max.y_mm {
            let found = format!(
                "({}, {}) and ({}, {}) mm",
                min.x_mm, min.y_mm, max.x_mm, max.y_mm
            );
            out.error(field.span, field.path.as_str(), "the rectangle is empty")
                .expected("`min` smaller than `max` in x and y")
                .found(found);
        }
        Some(self)
    }
}

/// Presses before everything else. The paper: 3 presses 1 s apart at the centre, then 3 s.
#[derive(Settings)]
#[settings(name = "sync")]
pub(crate) struct SyncKeys {
    /// How many presses.
    #[setting(min = 1, max = 1000)]
    pub count: u32,
    /// Time from the start of one sync press to the start of the next.
    #[setting(range = POSITIVE_SPAN_S)]
    pub interval_s: f64,
    /// Where; the centre of the outline when absent.
    pub at: Option<Point2>,
    /// Pause after the last sync press, counted from its end.
    #[setting(default = "0 s", range = SPAN_S)]
    pub pause_after: HostDuration,
    /// How deep; the first depth of the path when absent.
    #[setting(range = DEPTH_MM)]
    pub depth_mm: Option<f64>,
}
