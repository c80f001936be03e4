//! Owns the maps of the skin: localisation errors, and spread between repetitions, per location.

use skinrig_analysis::result::{PressResult, Region};
use skinrig_model::{Point2, PressId, PressRole};

use super::origin::foot;
use super::skin::{Layout, error_scale};
use crate::colour::viridis;
use crate::derive::{self, LocationSummary};
use crate::input::ReportInput;
use crate::markup::Markup;
use crate::plot::{
    Canvas, Figure, LeftTexts, Place, Sample, column, draw_axes, press_path, rectangle, scale_end,
    squares,
};
use crate::svg::{Px, dots, polyline};

const SIZE: (f64, f64) = (900.0, 700.0);
/// On a phone, scale and legend stand below the map, side by side.
const NARROW: ((f64, f64), f64) = ((740.0, 1120.0), 1.4);
const SCALE_TO: (f64, f64) = (-680.0, 700.0);
const LEGEND_TO: (f64, f64) = (-440.0, 365.0);
/// Regions drawn; more would hide the map.
const REGIONS: usize = 400;

fn discs(
    svg: &mut Markup,
    (layout, place): (&Layout, &Place),
    locations: &[LocationSummary],
    value: impl Fn(&LocationSummary) -> Option<f64>,
    end: f64,
) {
    let r = layout.radius(place, locations);
    svg.open("g", &[("class", &"locations"), ("data-end", &end)]);
    for l in locations {
        let Some(v) = value(l) else { continue };
        let (x, y) = layout.px(place, l.planned);
        svg.leaf(
            "circle",
            &[
                ("class", &"press"),
                ("data-location", &l.location.number()),
                ("cx", &Px(x)),
                ("cy", &Px(y)),
                ("r", &Px(r)),
                ("fill", &viridis(v / end)),
            ],
        );
    }
    svg.close();
}

/// Draws axes and skin; the group stays open.
fn backdrop(canvas: &mut Canvas, layout: &Layout) -> Place {
    let (x, y) = layout.axes();
    // The map keeps its shape in the room beside the colour scale.
    let width = (610.0 * 660.0 / layout.height(660.0)).min(660.0);
    let place = Place {
        x: x.scale((66.0, 66.0 + width)),
        y: y.scale((18.0 + layout.height(width), 18.0)),
    };
    let clip = format!("{}-clip", canvas.id);
    let svg = &mut canvas.svg;
    place.open(svg);
    draw_axes(svg, &place, (&x, &y), LeftTexts::Shown);
    svg.open("clipPath", &[("id", &clip)]);
    svg.path("clip", &layout.skin(&place));
    svg.close();
    svg.path("skin", &layout.skin(&place));
    place
}

/// The skin with both cameras, their fields of view, the press path, the mean error at every location, and a vector from
/// truth to estimate for every counting press.
#[must_use]
pub(crate) fn skin_map(input: &ReportInput<'_>) -> Figure {
    let layout = Layout::new(input);
    let locations = derive::locations(input.analysis);
    let counted: Vec<_> = input
        .analysis
        .presses
        .iter()
        .filter(|p| derive::is_counted(p))
        .collect();
    let mut others: Vec<_> = input
        .analysis
        .presses
        .iter()
        .filter(|p| p.role == PressRole::Score && !derive::is_counted(p))
        .collect();
    let regions = regions(&counted);
    let caption = format!(
        "Localisation error over the skin. Discs: scored locations, coloured by the mean Euclidean error of their \
         presses. Lines run from each measured position (truth) to its estimate, which ends in a dot ({} presses at {} \
         locations). Thin ellipses: 95 % regions of {} presses, each the extent that the \
         analysis states for its estimate. Open squares: scored presses that do not count ({}; missed presses appear only \
         at locations without a disc). Thin grey line: press path of the first repetition. Tinted: fields of view of camera 1 and \
         camera 2; dotted: their overlap, where a press can be located. Grey edge: probed area, one square cell per \
         location.",
        counted.len(),
        locations.len(),
        regions.len(),
        others.len()
    );
    let head = ["skin-map", "Skin map", &caption].map(str::to_owned);
    let mut canvas = Canvas::new(head, SIZE, Some(NARROW));
    let place = backdrop(&mut canvas, &layout);
    let place = &place;
    let svg = &mut canvas.svg;
    fields_of_view(svg, (&layout, place), input);
    svg.path("skin-edge", &layout.skin(place));
    press_order(svg, (&layout, place), input);
    let end = scale_end(locations.iter().map(|l| l.mean_error_mm)).unwrap_or(1.0);
    discs(
        svg,
        (&layout, place),
        &locations,
        |l| Some(l.mean_error_mm),
        end,
    );
    region_ellipses(svg, (&layout, place), &regions);
    error_vectors(svg, (&layout, place), &counted);
    let has_disc = |p: &PressResult| locations.iter().any(|l| l.location == p.location);
    others.retain(|p| p.timing.is_some() || !has_disc(p));
    uncounted_squares(svg, (&layout, place), &others);
    layout.cameras(svg, place, input);
    svg.leaf("g", &[("class", &"selection")]);
    svg.close();
    canvas.moving(SCALE_TO);
    let beyond = locations.iter().filter(|l| l.mean_error_mm > end).count();
    error_scale(&mut canvas.svg, "mean error\n(mm)", end, beyond);
    canvas.svg.close();
    canvas.moving(LEGEND_TO);
    column(&mut canvas.svg, (756.0, 400.0), &LEGEND);
    canvas.svg.close();
    if counted.is_empty() {
        canvas.empty("no scored press was located");
    }
    let n = format!(
        "n = {} presses, {} locations",
        counted.len(),
        locations.len()
    );
    canvas
        .finish(&foot(input), &n, "presses")
        .interactive("select")
}

/// Fields of view and their overlap, clipped to the skin, and the probed area.
fn fields_of_view(svg: &mut Markup, (layout, place): (&Layout, &Place), input: &ReportInput<'_>) {
    svg.open(
        "g",
        &[
            ("class", &"layer-fov"),
            ("clip-path", &"url(#skin-map-clip)"),
        ],
    );
    let coverage = input.analysis.coverage.as_ref();
    for (i, camera) in input.analysis.geometry.cameras.iter().enumerate() {
        let class = format!("fov f{0} c{0}", i + 1);
        let view = coverage.map(|c| &c.views[i]).filter(|v| !v.is_empty());
        let data = view.map_or_else(
            || layout.field_of_view(place, camera),
            |v| layout.polygons(place, v),
        );
        if view.is_some_and(|v| v.len() > 1) {
            svg.path(&format!("{class} no-edge"), &data);
            let id = format!("skin-map-view-{}", i + 1);
            layout.union_edge(svg, place, &id, &format!("fov-edge c{}", i + 1), &data);
        } else {
            svg.path(&class, &data);
        }
    }
    match coverage.map(|c| &c.overlap) {
        Some(pieces) if pieces.len() > 1 => {
            let data = layout.polygons(place, pieces);
            layout.union_edge(svg, place, "skin-map-overlap", "overlap-edge", &data);
        }
        Some(pieces) => {
            svg.path("overlap-edge", &layout.polygons(place, pieces));
        }
        None => {}
    }
    svg.close();
    if let Some((coverage, cell_mm)) = coverage.and_then(|c| Some((c, c.cell_mm?))) {
        cells(svg, (layout, place), &coverage.places, cell_mm);
    }
}

/// Line through the locations in the order of the first repetition.
fn press_order(svg: &mut Markup, (layout, place): (&Layout, &Place), input: &ReportInput<'_>) {
    let presses = input.analysis.presses.iter();
    let presses = presses.filter(|p| p.role != PressRole::Sync);
    let first = presses.clone().map(|p| p.repetition).min();
    let path = presses
        .filter(|p| Some(p.repetition) == first)
        .map(|p| layout.px(place, p.planned));
    svg.open("g", &[("class", &"layer-path")]);
    svg.path("path", &polyline(path, false));
    svg.close();
}

fn region_ellipses(
    svg: &mut Markup,
    (layout, place): (&Layout, &Place),
    regions: &[(PressId, Point2, Region)],
) {
    let (ellipses, numbers): (String, Vec<PressId>) = regions
        .iter()
        .map(|(press, at, region)| (ellipse(layout, place, *at, region), *press))
        .unzip();
    svg.open("clipPath", &[("id", &"skin-map-frame")]);
    rectangle(svg, "clip", place.frame());
    svg.close();
    svg.open(
        "g",
        &[
            ("class", &"layer-regions"),
            ("clip-path", &"url(#skin-map-frame)"),
        ],
    );
    press_path(svg, "region", &ellipses, &numbers);
    svg.close();
}

/// Lines from truth to estimate, which ends in a dot.
fn error_vectors(svg: &mut Markup, (layout, place): (&Layout, &Place), counted: &[&PressResult]) {
    let mut vectors = String::new();
    let mut tips = Vec::with_capacity(counted.len());
    let mut numbers = Vec::with_capacity(counted.len());
    for p in counted {
        if let (Some(t), Some(e)) = (p.truth, p.estimate()) {
            vectors.push_str(&polyline([layout.px(place, t), layout.px(place, e)], false));
            tips.push(layout.px(place, e));
            numbers.push(p.press);
        }
    }
    let dense = if counted.len() > 600 { " dense" } else { "" };
    svg.open("g", &[("class", &format_args!("layer-vectors{dense}"))]);
    press_path(svg, "vector", &vectors, &numbers);
    press_path(svg, "dots tips", &dots(tips), &numbers);
    svg.close();
}

/// Scored presses that do not count.
fn uncounted_squares(
    svg: &mut Markup,
    (layout, place): (&Layout, &Place),
    presses: &[&PressResult],
) {
    let (numbers, points): (Vec<PressId>, Vec<(f64, f64)>) = presses
        .iter()
        .map(|p| (p.press, layout.px(place, p.truth.unwrap_or(p.planned))))
        .unzip();
    svg.open("g", &[("class", &"layer-others")]);
    press_path(svg, "other", &squares(points, 10.0), &numbers);
    svg.close();
}

/// Presses with a 95 % region about their estimate, evenly thinned to [`REGIONS`].
fn regions(counted: &[&PressResult]) -> Vec<(PressId, Point2, Region)> {
    let all: Vec<_> = counted
        .iter()
        .filter_map(|p| Some((p.press, p.estimate()?, p.region?)))
        .collect();
    let count = all.len().min(REGIONS);
    (0..count).map(|i| all[i * all.len() / count]).collect()
}

/// Path of a region: two arcs between the ends of its longer axis.
fn ellipse(layout: &Layout, place: &Place, at: Point2, region: &Region) -> String {
    let scale = place.x.per_unit();
    let [major, minor] = region.semi_axes_mm.map(|a| a * scale);
    // The figure's y axis runs down.
    let turn = -region.angle_deg;
    let (sin, cos) = libm::sincos(turn.to_radians());
    let (x, y) = layout.px(place, at);
    let (dx, dy) = (2.0 * major * cos, 2.0 * major * sin);
    let (major, minor, turn) = (Px(major), Px(minor), Px(turn));
    format!(
        "M{} {}a{major} {minor} {turn} 1 0 {} {}a{major} {minor} {turn} 1 0 {} {}Z",
        Px(x - dx / 2.0),
        Px(y - dy / 2.0),
        Px(dx),
        Px(dy),
        Px(-dx),
        Px(-dy),
    )
}

/// Edge of the probed area: one cell per location, clipped to the outline.
fn cells(svg: &mut Markup, (layout, at): (&Layout, &Place), places: &[Point2], cell_mm: f64) {
    let side = cell_mm * at.x.per_unit();
    let mut data = String::new();
    for place in places {
        let (x, y) = layout.px(at, *place);
        let (x, y) = (Px(x - side / 2.0), Px(y - side / 2.0));
        data += &format!("M{x} {y}h{0}v{0}h-{0}Z", Px(side));
    }
    svg.open(
        "g",
        &[
            ("class", &"layer-cells"),
            ("clip-path", &"url(#skin-map-clip)"),
        ],
    );
    layout.union_edge(svg, at, "skin-map-probed", "cell", &data);
    svg.close();
}

const LEGEND: [(Sample, &str); 8] = [
    (Sample::Area("fov strong f1 c1"), "seen by camera 1"),
    (Sample::Area("fov strong f2 c2"), "seen by camera 2"),
    (Sample::Line("overlap-edge"), "seen by both"),
    (Sample::Path("cell", "M-7 -7h14v14h-14Z"), "probed area"),
    (Sample::Line("path"), "press path"),
    (Sample::Line("vector"), "truth to estimate"),
    (
        Sample::Path("region", "M-10 0a10 5 0 1 0 20 0a10 5 0 1 0 -20 0Z"),
        "95 % region",
    ),
    (Sample::Path("other", "M-5 -5h10v10h-10Z"), "not counted"),
];

/// Standard deviation between repetitions at every location.
#[must_use]
pub(crate) fn repeat_map(input: &ReportInput<'_>) -> Figure {
    let layout = Layout::new(input);
    let mut locations = derive::locations(input.analysis);
    locations.retain(|l| l.std_mm.is_some());
    let caption = format!(
        "Spread between repetitions over the skin. Discs: the sample standard deviation (n - 1, Euclidean) of \
         the estimates of equally deep presses at a location, for the {} locations with at least two that count.",
        locations.len()
    );
    let head = ["repeat-map", "Spread between repetitions", &caption];
    let mut canvas = Canvas::new(head.map(str::to_owned), SIZE, Some(NARROW));
    let place = backdrop(&mut canvas, &layout);
    let svg = &mut canvas.svg;
    let end = scale_end(locations.iter().filter_map(|l| l.std_mm)).unwrap_or(1.0);
    discs(svg, (&layout, &place), &locations, |l| l.std_mm, end);
    layout.cameras(svg, &place, input);
    svg.close();
    let beyond = locations.iter().filter(|l| l.std_mm > Some(end)).count();
    canvas.moving(SCALE_TO);
    error_scale(
        &mut canvas.svg,
        "std between\nrepetitions (mm)",
        end,
        beyond,
    );
    canvas.svg.close();
    if locations.is_empty() {
        canvas.empty("no location has two presses that count");
    }
    canvas.finish(
        &foot(input),
        &format!("n = {} locations", locations.len()),
        "locations",
    )
}
