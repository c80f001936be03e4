//! Owns [`Plot`]: axes, title, and marks in data coordinates.

use skinrig_model::PressId;

use super::axis::{self, Axis, LeftTexts};
use super::path::{band, circle, diamond, press_path, rectangle, squares};
use super::scale::Place;
use crate::markup::Markup;
use crate::svg::{dots, polyline};

/// Draws one or more marks.
type Mark<'a> = Box<dyn FnOnce(&mut Markup, &Place) + 'a>;
/// Draws marks below the frame, from this y in px on.
type Below<'a> = Box<dyn FnOnce(&mut Markup, &Place, f64) + 'a>;
/// Distance from the frame to the end of the marks below it, px.
const BELOW: f64 = 38.0;

/// A point in data units.
type Point = (f64, f64);

/// A plot: two axes and its marks, in drawing order. Points and values are in the units of the axes.
pub(crate) struct Plot<'a> {
    pub(super) axes: (Axis, Axis),
    pub(super) title: String,
    note: String,
    marks: Vec<Mark<'a>>,
    over: Option<Mark<'a>>,
    clip: Option<String>,
    has_names: bool,
    zooms: bool,
    below: Option<(&'a str, Below<'a>)>,
    deeper: f64,
}

impl<'a> Plot<'a> {
    /// An empty plot.
    pub(crate) fn new(x: Axis, y: Axis) -> Self {
        Self {
            axes: (x, y),
            title: String::new(),
            note: String::new(),
            marks: vec![],
            over: None,
            clip: None,
            has_names: false,
            zooms: false,
            below: None,
            deeper: 0.0,
        }
    }

    /// Title above the frame, left.
    pub(crate) fn title(mut self, title: impl Into<String>) -> Self {
        self.title = title.into();
        self
    }

    /// Remark above the frame, right.
    pub(crate) fn note(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }

    /// Cuts the marks at the frame. `id` must be unique in the page.
    pub(crate) fn clipped(mut self, id: impl Into<String>) -> Self {
        self.clip = Some(id.into());
        self
    }

    /// The page's script may zoom the marks along x.
    pub(crate) fn zooming(mut self) -> Self {
        self.zooms = true;
        self
    }

    /// Leaves room above the frame for texts drawn there.
    pub(crate) fn names_above(mut self) -> Self {
        self.has_names = true;
        self
    }

    /// Leaves room below the axis, px, for drawings there.
    pub(crate) fn deeper(mut self, by: f64) -> Self {
        self.deeper = by;
        self
    }

    /// A named row of marks below the frame, 12 px high.
    pub(crate) fn below(
        mut self,
        name: &'a str,
        marks: impl FnOnce(&mut Markup, &Place, f64) + 'a,
    ) -> Self {
        self.below = Some((name, Box::new(marks)));
        self
    }

    /// Any drawing, given the place of the plot.
    pub(crate) fn draw(mut self, mark: impl FnOnce(&mut Markup, &Place) + 'a) -> Self {
        self.marks.push(Box::new(mark));
        self
    }

    /// A drawing over the marks that the frame does not cut.
    pub(crate) fn over(mut self, mark: impl FnOnce(&mut Markup, &Place) + 'a) -> Self {
        self.over = Some(Box::new(mark));
        self
    }

    /// A path of the points in pixels.
    fn shaped<I: IntoIterator<Item = Point>>(
        self,
        class: &'a str,
        points: I,
        shape: impl FnOnce(Vec<Point>) -> String + 'a,
    ) -> Self {
        let points: Vec<Point> = points.into_iter().collect();
        self.draw(move |svg, place| {
            let px = points.into_iter().map(|p| place.at(p)).collect();
            svg.path(class, &shape(px));
        })
    }

    /// A line; a point that is not finite breaks it.
    pub(crate) fn line(self, class: &'a str, points: impl IntoIterator<Item = Point>) -> Self {
        self.shaped(class, points, |px| polyline(px, false))
    }

    /// A dot per point.
    pub(crate) fn dots(self, class: &'a str, points: impl IntoIterator<Item = Point>) -> Self {
        self.shaped(class, points, dots)
    }

    /// A small open square per point.
    pub(crate) fn squares(self, class: &'a str, points: impl IntoIterator<Item = Point>) -> Self {
        self.shaped(class, points, |px| squares(px, 6.0))
    }

    /// A mark per press, which the page's filter can hide: dots, or open squares.
    pub(crate) fn presses(
        self,
        class: &'a str,
        is_open: bool,
        points: impl IntoIterator<Item = (PressId, Point)>,
    ) -> Self {
        let (presses, points): (Vec<PressId>, Vec<Point>) = points.into_iter().unzip();
        self.draw(move |svg, place| {
            let px = points.into_iter().map(|p| place.at(p));
            let data = if is_open { squares(px, 6.0) } else { dots(px) };
            press_path(svg, class, &data, &presses);
        })
    }

    /// The area between two lines, from x and the y of both.
    pub(crate) fn band(
        self,
        class: &'a str,
        points: impl IntoIterator<Item = (f64, (f64, f64))>,
    ) -> Self {
        let points: Vec<_> = points.into_iter().collect();
        self.draw(move |svg, place| {
            let y = |v| place.y.at(v);
            let px = points
                .into_iter()
                .map(|(x, (a, b))| (place.x.at(x), (y(a), y(b))));
            svg.path(class, &band(px));
        })
    }

    /// A step line: bins of `width` from `start`; a value that is not finite breaks it.
    pub(crate) fn steps(
        self,
        class: &'a str,
        (start, width): (f64, f64),
        values: impl IntoIterator<Item = f64>,
    ) -> Self {
        let end = move |i: usize| start + i as f64 * width;
        let bins = values.into_iter().enumerate();
        self.line(
            class,
            bins.flat_map(move |(i, v)| [(end(i), v), (end(i + 1), v)]),
        )
    }

    /// A histogram: bars of `width` from `start`.
    pub(crate) fn bars(self, (start, width): (f64, f64), counts: &'a [u32]) -> Self {
        self.draw(move |svg, place| {
            svg.open("g", &[("class", &"bars"), ("data-bin", &width)]);
            for (i, count) in counts.iter().enumerate().filter(|(_, c)| **c > 0) {
                let x = |i: usize| place.x.at(start + width * i as f64);
                let (top, bottom) = (place.y.at(f64::from(*count)), place.y.at(0.0));
                rectangle(svg, "bar", (x(i), top, x(i + 1) - x(i), bottom - top));
            }
            svg.close();
        })
    }

    /// A horizontal line at `y`.
    pub(crate) fn across(self, class: &'a str, y: f64) -> Self {
        self.draw(move |svg, place| {
            let (left, right) = place.x.px;
            svg.line(class, (left, place.y.at(y)), (right, place.y.at(y)));
        })
    }

    /// A vertical line at `x`.
    pub(crate) fn upright(self, class: &'a str, x: f64) -> Self {
        self.draw(move |svg, place| {
            let (_, top, _, height) = place.frame();
            svg.line(class, (place.x.at(x), top), (place.x.at(x), top + height));
        })
    }

    /// Vertical lines with names above the frame, moved apart where they would overlap. Lines beyond the axis are left out.
    pub(crate) fn references(mut self, marks: Vec<(&'a str, f64, String)>) -> Self {
        self.has_names = true;
        self.draw(move |svg, place| {
            let (_, top, _, height) = place.frame();
            let mut free_from = f64::NEG_INFINITY;
            for (class, x, name) in marks.into_iter().filter(|m| place.x.holds(m.1)) {
                let at = place.x.at(x);
                svg.line(class, (at, top - 7.0), (at, top + height));
                let half = name.chars().count() as f64 * 3.3;
                let middle = at.max(free_from + half + 6.0);
                svg.text((middle, top - 14.0), "tick", "middle", &name);
                free_from = middle + half;
            }
        })
    }

    /// A text beside a point, `(dx, dy)` px away; on the side of the plot with more space if `dx` is not zero.
    pub(crate) fn text(
        self,
        class: &'a str,
        at: Point,
        (dx, dy): (f64, f64),
        text: impl Into<String>,
    ) -> Self {
        let text = text.into();
        self.draw(move |svg, place| {
            let (x, y) = place.at(at);
            let (dx, anchor) = match x < place.middle().0 {
                _ if dx == 0.0 => (dx, "middle"),
                true => (dx, "start"),
                false => (-dx, "end"),
            };
            svg.text((x + dx, y + dy), class, anchor, &text);
        })
    }

    /// The reason for an empty plot, in its middle.
    pub(crate) fn empty(self, is_empty: bool, why: &'a str) -> Self {
        if !is_empty {
            return self;
        }
        self.draw(move |svg, place| {
            svg.text(place.middle(), "empty", "middle", why);
        })
    }

    /// A ring around a point.
    pub(crate) fn ring(self, class: &'a str, at: Point) -> Self {
        self.draw(move |svg, place| circle(svg, class, place.at(at), 8.0))
    }

    /// A published value.
    pub(crate) fn published(self, at: Point) -> Self {
        self.shaped("published", [at], |px| diamond(px[0]))
    }

    /// Draws axes and marks.
    pub(crate) fn render(self, svg: &mut Markup, place: &Place, left_texts: LeftTexts) {
        place.open(svg);
        axis::draw(svg, place, (&self.axes.0, &self.axes.1), left_texts);
        let (left, top, width, height) = place.frame();
        let above = if self.has_names { 32.0 } else { 9.0 };
        if !self.title.is_empty() {
            svg.text((left, top - above), "panel", "start", &self.title);
        }
        if !self.note.is_empty() {
            svg.text((left + width, top - above), "tick", "end", &self.note);
        }
        if let Some(id) = &self.clip {
            svg.open("clipPath", &[("id", id)]);
            // Marks below the frame are cut at its sides as well.
            let below = if self.below.is_some() { BELOW } else { 0.0 };
            rectangle(svg, "clip", (left, top, width, height + below));
            svg.close();
            svg.open("g", &[("clip-path", &format_args!("url(#{id})"))]);
        }
        if self.zooms {
            svg.open("g", &[("class", &"zoomed")]);
        }
        for mark in self.marks {
            mark(svg, place);
        }
        let row = top + height + BELOW - 12.0;
        let name = self.below.map(|(name, marks)| {
            marks(svg, place, row);
            name
        });
        for _ in 0..u8::from(self.zooms) + u8::from(self.clip.is_some()) {
            svg.close();
        }
        if let Some(over) = self.over {
            over(svg, place);
        }
        if let Some(name) = name {
            svg.text((left - 6.0, row + 10.0), "tick", "end", name);
        }
        svg.close();
    }

    /// Height of everything below the frame, px.
    pub(super) fn foot(&self) -> f64 {
        let below = if self.below.is_some() {
            BELOW - 12.0
        } else {
            0.0
        };
        self.axes.0.foot() + below + self.deeper
    }

    /// True if texts stand between title and frame.
    pub(super) const fn has_names(&self) -> bool {
        self.has_names
    }

    /// True if something is written above the frame.
    pub(super) fn has_head(&self) -> bool {
        !self.title.is_empty() || !self.note.is_empty()
    }
}
