//! Owns the layout common to all maps: position of the skin, cameras, fields of view, colour bar.

use skinrig_model::{CameraModel, Point2, SENSOR_WIDTH};

use crate::colour::viridis;
use crate::derive::LocationSummary;
use crate::input::ReportInput;
use crate::markup::Markup;
use crate::plot::{Axis, Place, Scale, colour_bar, extent, rectangle};
use crate::svg::{Px, polyline};

/// Outline of the skin, and the ranges of a map that shows it with the cameras.
pub(super) struct Layout {
    outline: Vec<Point2>,
    ranges: [(f64, f64); 2],
}

impl Layout {
    pub(super) fn new(input: &ReportInput<'_>) -> Self {
        let outline = input.analysis.rig.outline.polygon(24);
        let cameras = input.analysis.geometry.cameras.map(|c| c.position);
        let all = || outline.iter().chain(&cameras);
        let range = |f: fn(&Point2) -> f64| {
            let (low, high) = extent(all().map(f)).unwrap_or((0.0, 1.0));
            (low - 5.0, high + 5.0)
        };
        let ranges = [range(|p| p.x_mm), range(|p| p.y_mm)];
        Self { outline, ranges }
    }

    /// Both axes of the map.
    pub(super) fn axes(&self) -> (Axis, Axis) {
        let [x, y] = self.ranges;
        let axis = |range, label: &str| Axis::linear(range, label).ticks(7);
        (axis(x, "x, skin frame (mm)"), axis(y, "y, skin frame (mm)"))
    }

    /// Height of a map of this width, px: one scale for both axes.
    pub(super) fn height(&self, width: f64) -> f64 {
        let [x, y] = self.ranges.map(|(low, high)| high - low);
        width * y / x
    }

    pub(super) fn px(&self, place: &Place, p: Point2) -> (f64, f64) {
        place.at((p.x_mm, p.y_mm))
    }

    pub(super) fn skin(&self, place: &Place) -> String {
        polyline(self.outline.iter().map(|p| self.px(place, *p)), true)
    }

    /// Closed polygons.
    pub(super) fn polygons(&self, place: &Place, polygons: &[Vec<Point2>]) -> String {
        let one = |points: &Vec<Point2>| polyline(points.iter().map(|p| self.px(place, *p)), true);
        polygons.iter().map(one).collect()
    }

    /// Radius of a location's disc: a share of the distance to its nearest neighbour, 3 to 8 px.
    pub(super) fn radius(&self, place: &Place, locations: &[LocationSummary]) -> f64 {
        let mut nearest = f64::INFINITY;
        for (i, a) in locations.iter().enumerate() {
            for b in &locations[..i] {
                let d = a.planned.distance_mm(b.planned);
                if d > 1e-6 {
                    nearest = nearest.min(d);
                }
            }
        }
        (0.42 * nearest * place.x.per_unit()).clamp(3.0, 8.0)
    }

    /// Field of view of `camera` in the plane, along the rays of columns 0 to 640.
    pub(super) fn field_of_view(&self, place: &Place, camera: &CameraModel) -> String {
        const REACH_MM: f64 = 400.0; // beyond any skin; the outline clips it
        let width = f64::from(SENSOR_WIDTH);
        let rim = (0..=32).map(|i| {
            let [dx, dy] =
                camera.direction(camera.angle_of_column_deg(width * f64::from(i) / 32.0));
            Point2::new(
                camera.position.x_mm + REACH_MM * dx,
                camera.position.y_mm + REACH_MM * dy,
            )
        });
        polyline(
            std::iter::once(camera.position)
                .chain(rim)
                .map(|p| self.px(place, p)),
            true,
        )
    }

    /// Strokes the outer edge of touching or overlapping shapes as if they were one; a mask hides the inner strokes. `id`
    /// must be unique in the page.
    pub(super) fn union_edge(
        &self,
        svg: &mut Markup,
        place: &Place,
        id: &str,
        class: &str,
        shapes: &str,
    ) {
        svg.open("mask", &[("id", &id), ("maskUnits", &"userSpaceOnUse")]);
        rectangle(svg, "white", place.frame());
        // The thin stroke closes the seam between touching shapes.
        svg.leaf(
            "path",
            &[
                ("d", &shapes),
                ("fill", &"#000"),
                ("stroke", &"#000"),
                ("stroke-width", &"0.3"),
            ],
        );
        svg.close();
        svg.leaf(
            "path",
            &[
                ("class", &class),
                ("d", &shapes),
                ("mask", &format_args!("url(#{id})")),
            ],
        );
    }

    pub(super) fn cameras(&self, svg: &mut Markup, place: &Place, input: &ReportInput<'_>) {
        for (i, camera) in input.analysis.geometry.cameras.iter().enumerate() {
            let (x, y) = self.px(place, camera.position);
            let [dx, dy] = camera.direction(camera.skew_deg);
            let angle = libm::atan2(-dy, dx).to_degrees();
            svg.leaf(
                "path",
                &[
                    ("class", &format_args!("f{}", i + 1)),
                    ("d", &"M9 0L-7 8V-8Z"),
                    (
                        "transform",
                        &format_args!("translate({} {}) rotate({})", Px(x), Px(y), Px(angle)),
                    ),
                ],
            );
            svg.text(
                (x - 14.0 * dx + 6.0, y + 14.0 * dy + 18.0 * dy.signum()),
                &format!("f{}", i + 1),
                "start",
                &format!("camera {}", i + 1),
            );
        }
    }
}

/// Colour bar in mm with title, at the right edge, with the number of locations above its end.
pub(super) fn error_scale(svg: &mut Markup, title: &str, top_mm: f64, beyond: usize) {
    let (x, top, height) = (786.0, 70.0, 260.0);
    svg.open("g", &[("class", &"colour-bar")]);
    for (i, line) in title.split('\n').enumerate() {
        let y = top - 36.0 + 19.0 * i as f64;
        svg.text((x - 30.0, y), "label", "start", line);
    }
    let scale = Scale::new((0.0, top_mm), (top + height, top));
    colour_bar(svg, scale, (x, x + 18.0), true, viridis, None);
    if beyond > 0 {
        let text = format!("{beyond} above scale");
        svg.text((x - 30.0, top + height + 22.0), "note", "start", &text);
    }
    svg.close();
}
