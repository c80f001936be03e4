//! Owns the layout common to all maps: position of the skin, cameras, fields of view, colour bar.

use skinrig_model::{CameraModel, Point2, SENSOR_WIDTH};

use crate::axes::{Axes, Scale, tick_label, ticks};
use crate::colour::viridis;
use crate::derive::LocationSummary;
use crate::input::ReportInput;
use crate::svg::{Px, Svg, polyline};

/// Position and scale of the skin in the figure.
pub(super) struct Layout {
    pub(super) axes: Axes,
    outline: Vec<Point2>,
}

impl Layout {
    pub(super) fn new(input: &ReportInput<'_>) -> Self {
        Self::within(input, (66.0, 18.0), (660.0, 610.0))
    }

    /// Fits the skin and the cameras into the box at `(left, top)`.
    pub(super) fn within(
        input: &ReportInput<'_>,
        (left, top): (f64, f64),
        (width, height): (f64, f64),
    ) -> Self {
        let outline = input.analysis.rig.outline.polygon(24);
        let cameras = input.analysis.geometry.cameras.map(|c| c.position);
        let all = || {
            outline
                .iter()
                .chain(&cameras)
                .filter(|p| p.x_mm.is_finite() && p.y_mm.is_finite())
        };
        let range = |f: fn(&Point2) -> f64| {
            let low = all().map(f).fold(f64::INFINITY, f64::min);
            let high = all().map(f).fold(f64::NEG_INFINITY, f64::max);
            (low - 5.0, high + 5.0)
        };
        let (xs, ys) = (range(|p| p.x_mm), range(|p| p.y_mm));
        // One scale for both axes.
        let k = (width / (xs.1 - xs.0)).min(height / (ys.1 - ys.0));
        let right = left + k * (xs.1 - xs.0);
        let bottom = top + k * (ys.1 - ys.0);
        let axes = Axes {
            x: Scale::new(xs, (left, right)),
            y: Scale::new(ys, (bottom, top)),
            x_label: "x, skin frame (mm)".into(),
            y_label: "y, skin frame (mm)".into(),
            tick_count: (7, 7),
        };
        Self { axes, outline }
    }

    pub(super) fn px(&self, p: Point2) -> (f64, f64) {
        (self.axes.x.at(p.x_mm), self.axes.y.at(p.y_mm))
    }

    pub(super) fn skin(&self) -> String {
        polyline(self.outline.iter().map(|p| self.px(*p)), true)
    }

    /// Closed polygons.
    pub(super) fn polygons(&self, polygons: &[Vec<Point2>]) -> String {
        let one = |points: &Vec<Point2>| polyline(points.iter().map(|p| self.px(*p)), true);
        polygons.iter().map(one).collect()
    }

    /// Radius of a location's disc: a share of the distance to its nearest neighbour, 3 to 8 px.
    pub(super) fn radius(&self, locations: &[LocationSummary]) -> f64 {
        let mut nearest = f64::INFINITY;
        for (i, a) in locations.iter().enumerate() {
            for b in &locations[..i] {
                let d = a.planned.distance_mm(b.planned);
                if d > 1e-6 {
                    nearest = nearest.min(d);
                }
            }
        }
        (0.42 * nearest * self.axes.x.per_unit()).clamp(3.0, 8.0)
    }

    /// Field of view of `camera` in the plane, along the rays of columns 0 to 640.
    pub(super) fn field_of_view(&self, camera: &CameraModel) -> String {
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
                .map(|p| self.px(p)),
            true,
        )
    }

    /// Strokes the outer edge of touching or overlapping shapes as if they were one; a mask hides the inner strokes. `id`
    /// must be unique in the page.
    pub(super) fn union_edge(&self, svg: &mut Svg, id: &str, class: &str, shapes: &str) {
        let (x, y) = (self.axes.x.px, self.axes.y.px);
        let (left, top) = (x.0.min(x.1), y.0.min(y.1));
        let (width, height) = ((x.1 - x.0).abs(), (y.1 - y.0).abs());
        svg.open("mask", &[("id", &id), ("maskUnits", &"userSpaceOnUse")]);
        svg.leaf(
            "rect",
            &[
                ("x", &Px(left)),
                ("y", &Px(top)),
                ("width", &Px(width)),
                ("height", &Px(height)),
                ("fill", &"#fff"),
            ],
        );
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

    pub(super) fn cameras(&self, svg: &mut Svg, input: &ReportInput<'_>) {
        for (i, camera) in input.analysis.geometry.cameras.iter().enumerate() {
            let (x, y) = self.px(camera.position);
            let [dx, dy] = camera.direction(camera.skew_deg);
            let angle = (-dy).atan2(dx).to_degrees();
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
pub(super) fn colour_bar(svg: &mut Svg, title: &str, top_mm: f64, beyond: usize) {
    const STEPS: u32 = 48;
    let (x, top, height, width) = (786.0, 70.0, 260.0, 18.0);
    let step = height / f64::from(STEPS);
    svg.open("g", &[("class", &"colour-bar")]);
    for (i, line) in title.split('\n').enumerate() {
        svg.text(
            (x - 30.0, top - 32.0 + 15.0 * i as f64),
            "label",
            "start",
            line,
        );
    }
    for i in 0..STEPS {
        let share = (f64::from(i) + 0.5) / f64::from(STEPS);
        svg.leaf(
            "rect",
            &[
                ("x", &Px(x)),
                ("y", &Px(top + height - f64::from(i + 1) * step)),
                ("width", &Px(width)),
                ("height", &Px(step + 0.4)),
                ("fill", &viridis(share)),
            ],
        );
    }
    let scale = Scale::new((0.0, top_mm), (top + height, top));
    let marks = ticks(0.0, top_mm, 5);
    let distance = if marks.len() > 1 {
        marks[1] - marks[0]
    } else {
        top_mm
    };
    for t in marks {
        svg.line(
            "axis",
            (x + width, scale.at(t)),
            (x + width + 4.0, scale.at(t)),
        );
        svg.text(
            (x + width + 8.0, scale.at(t) + 4.0),
            "tick",
            "start",
            &tick_label(t, distance),
        );
    }
    if beyond > 0 {
        svg.text(
            (x - 30.0, top + height + 22.0),
            "note",
            "start",
            &format!("{beyond} above scale"),
        );
    }
    svg.close();
}
