//! The path of a plan as a picture: numbered, with outline, keep-outs, units and legend.

use std::fmt::Write;

use skinrig_model::{PlannedPress, Point2, PressRole, RepetitionId};

use crate::area::{Area, KeepOut, Surroundings};
use crate::plan::Plan;
use crate::summary::counted;

/// Millimetres around the skin for axes and legend.
const BORDER_MM: f64 = 14.0;
/// Height of the legend, mm.
const LEGEND_MM: f64 = 22.0;
/// Up to this many locations, each is numbered; beyond it, line ends and every tenth.
const NUMBER_ALL: usize = 120;

/// Colours by role; the dark set follows the viewer's preference.
const STYLE: &str = "<style>\n\
.paper{fill:#ffffff}.skin{fill:#f3efe6;stroke:#5d5648;stroke-width:.5}.grid{stroke:#8894a0;stroke-opacity:.35;stroke-width:.15}\n\
.axis,.legend{font:2.6px sans-serif;fill:#3c434b}.number{font-family:sans-serif;fill:#1f2933}\n\
.path{fill:none;stroke:#2b6cb0;stroke-width:.3;stroke-linejoin:round}.press{fill:#2b6cb0}.first{fill:#1c7c54}.last{fill:#b83227}\n\
.sync{stroke:#8a3ffc;stroke-width:.6;fill:none}.keepout{fill:#b8322733;stroke:#b83227;stroke-width:.3}\n\
.margin{fill:#b832271a;stroke:#b832271a;stroke-linejoin:round}\n\
@media (prefers-color-scheme: dark){.paper{fill:#15181c}.skin{fill:#262b31;stroke:#a79f8d}\n\
.axis,.legend{fill:#c3cad2}.number{fill:#e6ebf0}.path{stroke:#6fb1f0}.press{fill:#6fb1f0}.first{fill:#58c896}.last{fill:#ff8577}\n\
.sync{stroke:#b794ff}.keepout{stroke:#ff8577}}\n\
</style>";

/// The path of `plan` as an SVG, seen from above: x to the right, y up, 6 px per mm, light and dark by the viewer's
/// preference. Locations are numbered from 1 in the order in which the first repetition visits them.
#[must_use]
pub fn path_svg(plan: &Plan, around: &Surroundings) -> String {
    let corners = around.outline.polygon(24);
    let mut picture = Picture::around(plan, around, &corners);
    picture.open(&plan.name);
    let outline = picture.points(&corners);
    picture.write(&format!(r#"<polygon class="skin" points="{outline}"/>"#));
    picture.grid();
    for keep_out in &around.keep_outs {
        picture.keep_out(keep_out);
    }
    let visits = first_visits(plan);
    let nearest = closest_pair_mm(&visits).clamp(0.5, 8.0);
    let radius = (nearest * 0.18).clamp(0.3, 1.1);
    let text_size = (nearest * 0.38).clamp(0.8, 2.2);
    picture.visits(&visits, radius, text_size);
    let mut sync = plan.presses.iter().filter(|p| p.role == PressRole::Sync);
    if let Some(press) = sync.next() {
        picture.sync_cross(press.at, radius * 2.2);
    }
    picture.legend(plan, around, visits.len());
    picture.write("</svg>");
    picture.svg
}

/// A picture in mm, y down; `low` and `high` are the corners of its content in the skin frame.
struct Picture {
    svg: String,
    low: Point2,
    high: Point2,
}

impl Picture {
    /// An empty picture with room for outline, presses and keep-outs.
    fn around(plan: &Plan, around: &Surroundings, corners: &[Point2]) -> Self {
        let centre = around.outline.centre;
        let mut picture = Self {
            svg: String::new(),
            low: centre,
            high: centre,
        };
        corners.iter().for_each(|p| picture.include(*p));
        plan.presses.iter().for_each(|p| picture.include(p.at));
        for keep_out in &around.keep_outs {
            match &keep_out.area {
                Area::Circle { centre, radius_mm } => {
                    let (x_mm, y_mm) = (centre.x_mm, centre.y_mm);
                    picture.include(Point2::new(x_mm - radius_mm, y_mm - radius_mm));
                    picture.include(Point2::new(x_mm + radius_mm, y_mm + radius_mm));
                }
                Area::Polygon(points) => points.iter().for_each(|p| picture.include(*p)),
            }
        }
        picture
    }

    const fn include(&mut self, p: Point2) {
        let (low, high) = (self.low, self.high);
        self.low = Point2::new(low.x_mm.min(p.x_mm), low.y_mm.min(p.y_mm));
        self.high = Point2::new(high.x_mm.max(p.x_mm), high.y_mm.max(p.y_mm));
    }

    /// Adds a line of text.
    fn write(&mut self, line: &str) {
        self.svg.push_str(line);
        self.svg.push('\n');
    }

    fn height_mm(&self) -> f64 {
        self.high.y_mm - self.low.y_mm
    }

    /// Picture coordinates of a position.
    fn at(&self, p: Point2) -> (f64, f64) {
        (
            p.x_mm - self.low.x_mm + BORDER_MM,
            self.high.y_mm - p.y_mm + BORDER_MM,
        )
    }

    /// Value of a `points` attribute.
    fn points(&self, list: &[Point2]) -> String {
        let mut text = String::new();
        for p in list {
            let (x, y) = self.at(*p);
            let _ = write!(text, "{x:.2},{y:.2} ");
        }
        text.truncate(text.trim_end().len());
        text
    }

    fn open(&mut self, name: &str) {
        let width = self.high.x_mm - self.low.x_mm + 2.0 * BORDER_MM;
        let height = self.height_mm() + 2.0 * BORDER_MM + LEGEND_MM;
        self.write(&format!(
            r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.1} {height:.1}" width="{:.0}" height="{:.0}" role="img" aria-label="press path of {}">"#,
            width * 6.0,
            height * 6.0,
            escape(name)
        ));
        self.write(STYLE);
        self.write(r#"<rect class="paper" width="100%" height="100%"/>"#);
    }

    /// A keep-out area and its margin.
    fn keep_out(&mut self, keep_out: &KeepOut) {
        let title = escape(&keep_out.name);
        let margin_mm = keep_out.margin_mm;
        match &keep_out.area {
            Area::Circle { centre, radius_mm } => {
                let (x, y) = self.at(*centre);
                if margin_mm > 0.0 {
                    self.write(&format!(
                        r#"<circle class="margin" cx="{x:.2}" cy="{y:.2}" r="{:.2}"/>"#,
                        radius_mm + margin_mm
                    ));
                }
                self.write(&format!(
                    r#"<circle class="keepout" cx="{x:.2}" cy="{y:.2}" r="{radius_mm:.2}"><title>{title}</title></circle>"#
                ));
            }
            Area::Polygon(corners) => {
                let points = self.points(corners);
                if margin_mm > 0.0 {
                    self.write(&format!(
                        r#"<polygon class="margin" style="stroke-width:{:.2}" points="{points}"/>"#,
                        2.0 * margin_mm
                    ));
                }
                self.write(&format!(
                    r#"<polygon class="keepout" points="{points}"><title>{title}</title></polygon>"#
                ));
            }
        }
    }

    /// The path, and its locations as numbered dots.
    fn visits(&mut self, visits: &[Point2], radius: f64, text_size: f64) {
        if visits.len() > 1 {
            let points = self.points(visits);
            self.write(&format!(r#"<polyline class="path" points="{points}"/>"#));
        }
        for (number, p) in (1..).zip(visits) {
            let (x, y) = self.at(*p);
            let class = match number {
                1 => "press first",
                n if n == visits.len() => "press last",
                _ => "press",
            };
            self.write(&format!(
                r#"<circle class="{class}" cx="{x:.2}" cy="{y:.2}" r="{radius:.2}"><title>{number}: ({:.2}, {:.2}) mm</title></circle>"#,
                p.x_mm, p.y_mm
            ));
            let is_numbered = visits.len() <= NUMBER_ALL
                || number == 1
                || number == visits.len()
                || number % 10 == 0
                || turns(visits, number - 1);
            if is_numbered {
                self.write(&format!(
                    r#"<text class="number" font-size="{text_size:.2}" x="{:.2}" y="{:.2}">{number}</text>"#,
                    x + radius * 0.9,
                    y - radius * 0.9
                ));
            }
        }
    }

    fn sync_cross(&mut self, centre: Point2, half: f64) {
        let (x, y) = self.at(centre);
        self.write(&format!(
            r#"<path class="sync" d="M{:.2} {y:.2}h{:.2}M{x:.2} {:.2}v{:.2}"/>"#,
            x - half,
            2.0 * half,
            y - half,
            2.0 * half
        ));
    }

    /// Explains the marks below the picture.
    fn legend(&mut self, plan: &Plan, around: &Surroundings, locations: usize) {
        let x = BORDER_MM + 2.0;
        let mut lines = vec![
            (
                String::new(),
                format!("{}: {}", plan.name, legend_text(plan, locations)),
            ),
            (
                format!(
                    r#"<circle class="press first" cx="{:.1}" cy="{{y}}" r="1"/><circle class="press last" cx="{:.1}" cy="{{y}}" r="1"/>"#,
                    x - 1.2,
                    x + 1.6
                ),
                "first and last press; numbers: order of the first repetition".to_owned(),
            ),
        ];
        let is_sync = |p: &&PlannedPress| p.role == PressRole::Sync;
        let sync = plan.presses.iter().filter(is_sync).count();
        if sync > 0 {
            let cross = format!(
                r#"<path class="sync" d="M{:.1} {{y}}h3.2M{x:.1} {{y}}m0 -1.6v3.2"/>"#,
                x - 1.6
            );
            lines.push((cross, format!("{sync} sync presses")));
        }
        if !around.keep_outs.is_empty() {
            lines.push((
                format!(r#"<circle class="keepout" cx="{x:.1}" cy="{{y}}" r="1.2"/>"#),
                "keep-out areas with their margins".to_owned(),
            ));
        }
        let mut y = BORDER_MM + self.height_mm() + 11.0;
        for (mark, text) in lines {
            let mark = mark.replace("{y}", &format!("{:.2}", y - 0.9));
            self.write(&format!(
                r#"{mark}<text class="legend" x="{:.1}" y="{y:.2}">{}</text>"#,
                BORDER_MM + 6.0,
                escape(&text)
            ));
            y += 4.2;
        }
    }

    /// Lines every 10 mm, with the axes.
    fn grid(&mut self) {
        let (low, high) = (self.low, self.high);
        let step = 10.0;
        let lines = |from: f64, to: f64| {
            let first = (from / step).ceil() as i64;
            let last = (to / step).floor() as i64;
            first..=last
        };
        for k in lines(low.x_mm, high.x_mm) {
            let v = k as f64 * step;
            let (x, top) = self.at(Point2::new(v, high.y_mm));
            let (_, bottom) = self.at(Point2::new(v, low.y_mm));
            self.write(&format!(
                r#"<line class="grid" x1="{x:.2}" y1="{top:.2}" x2="{x:.2}" y2="{bottom:.2}"/>"#
            ));
            self.write(&format!(
                r#"<text class="axis" text-anchor="middle" x="{x:.2}" y="{:.2}">{v:.0}</text>"#,
                bottom + 4.0
            ));
        }
        for k in lines(low.y_mm, high.y_mm) {
            let v = k as f64 * step;
            let (left, y) = self.at(Point2::new(low.x_mm, v));
            let (right, _) = self.at(Point2::new(high.x_mm, v));
            self.write(&format!(
                r#"<line class="grid" x1="{left:.2}" y1="{y:.2}" x2="{right:.2}" y2="{y:.2}"/>"#
            ));
            self.write(&format!(
                r#"<text class="axis" text-anchor="end" x="{:.2}" y="{:.2}">{v:.0}</text>"#,
                left - 1.5,
                y + 0.9
            ));
        }
        let (right, bottom) = self.at(Point2::new(high.x_mm, low.y_mm));
        self.write(&format!(
            r#"<text class="axis" text-anchor="end" x="{:.2}" y="{:.2}">x, mm</text>"#,
            right + 12.0,
            bottom + 4.0
        ));
        let (left, top) = self.at(Point2::new(low.x_mm, high.y_mm));
        self.write(&format!(
            r#"<text class="axis" x="{:.2}" y="{:.2}">y, mm</text>"#,
            left - 9.0,
            top - 4.0
        ));
    }
}

/// Locations of the first repetition at its first depth, in order; repeated ones once.
fn first_visits(plan: &Plan) -> Vec<Point2> {
    let mut visited = std::collections::HashSet::new();
    plan.presses
        .iter()
        .filter(|p| p.role != PressRole::Sync && p.repetition == RepetitionId::default())
        .filter(|p| visited.insert(p.location))
        .map(|p| p.at)
        .collect()
}

/// True if the path changes direction at location `k`.
fn turns(visits: &[Point2], k: usize) -> bool {
    let (Some(a), Some(b), Some(c)) = (
        k.checked_sub(1).and_then(|i| visits.get(i)),
        visits.get(k),
        visits.get(k + 1),
    ) else {
        return false;
    };
    let cross = (b.x_mm - a.x_mm) * (c.y_mm - b.y_mm) - (b.y_mm - a.y_mm) * (c.x_mm - b.x_mm);
    visits.len() > NUMBER_ALL && cross.abs() > 1e-6
}

/// Distance of the two closest of the first few hundred locations, mm; sets the size of dots and numbers.
fn closest_pair_mm(visits: &[Point2]) -> f64 {
    let some = visits.get(..visits.len().min(600)).unwrap_or(&[]);
    let mut nearest = f64::INFINITY;
    for (i, p) in some.iter().enumerate() {
        for q in some.iter().skip(i + 1) {
            let d = p.distance_mm(*q);
            if d > 1e-9 {
                nearest = nearest.min(d);
            }
        }
    }
    if nearest.is_finite() { nearest } else { 8.0 }
}

fn legend_text(plan: &Plan, locations: usize) -> String {
    let s = plan.summary();
    format!(
        "{}, {}, {} presses; seen from above",
        counted(locations as u32, "location"),
        counted(s.repetitions, "repetition"),
        plan.presses.len()
    )
}

fn escape(text: &str) -> String {
    skinrig_model::text::visible(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
