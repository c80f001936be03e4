//! Owns the maps of the skin: localisation errors, and spread between repetitions, per location.

use skinrig_analysis::result::PressResult;
use skinrig_model::{Point2, PressRole};

use super::canvas::{Canvas, Figure, LINKED, nice_above, press_path};
use super::skin::{Layout, colour_bar};
use crate::colour::viridis;
use crate::derive::{self, LocationSummary};
use crate::input::ReportInput;
use crate::svg::{Px, Svg, dots, polyline};

const SIZE: (f64, f64) = (900.0, 700.0);

/// End of the colour scale: round number above 98 % of the values.
fn scale_end(mut values: Vec<f64>) -> f64 {
    values.retain(|v| v.is_finite());
    values.sort_by(f64::total_cmp);
    let at = (values.len().saturating_sub(1)) as f64 * 0.98;
    values
        .get(at.round() as usize)
        .map_or(1.0, |v| nice_above(*v))
}

fn discs(
    svg: &mut Svg,
    layout: &Layout,
    locations: &[LocationSummary],
    value: impl Fn(&LocationSummary) -> Option<f64>,
    end: f64,
) {
    let r = layout.radius(locations);
    svg.open("g", &[("class", &"locations"), ("data-end", &end)]);
    for l in locations {
        let Some(v) = value(l) else { continue };
        let (x, y) = layout.px(l.planned);
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

fn backdrop(canvas: &mut Canvas<'_>, layout: &Layout) {
    let clip = format!("{}-clip", canvas.id);
    let svg = &mut canvas.svg;
    layout.axes.draw(svg);
    svg.open("clipPath", &[("id", &clip)]);
    svg.path("clip", &layout.skin());
    svg.close();
    svg.path("skin", &layout.skin());
}

fn attributes(layout: &Layout) -> [String; 3] {
    [
        layout.axes.x.at(0.0),
        layout.axes.y.at(0.0),
        layout.axes.x.per_unit(),
    ]
    .map(|v| format!("{v:.4}"))
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
    let others: Vec<_> = input
        .analysis
        .presses
        .iter()
        .filter(|p| p.role == PressRole::Score && !derive::is_counted(p))
        .collect();
    let caption = format!(
        "Localisation error over the skin. Discs: scored locations, coloured by the mean Euclidean error of their \
         presses. Lines run from each measured position (truth) to its estimate, which ends in a dot ({} presses at {} \
         locations). Open squares: scored presses that do not count ({}; missed presses appear only at locations \
         without a disc). Thin grey line: press path of the first repetition. Tinted: fields of view of camera 1 and \
         camera 2; dotted: their overlap, where a press can be located. Grey edge: probed area, one square cell per \
         location.",
        counted.len(),
        locations.len(),
        others.len()
    );
    let [ox, oy, k] = attributes(&layout);
    let mut canvas = Canvas::new(
        input,
        "skin-map",
        "Skin map",
        caption,
        SIZE,
        &[("data-ox", &ox), ("data-oy", &oy), ("data-k", &k), LINKED],
    );
    backdrop(&mut canvas, &layout);
    let svg = &mut canvas.svg;
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
        let seen = coverage.map(|c| &c.views[i]).filter(|v| !v.is_empty());
        let data = seen.map_or_else(|| layout.field_of_view(camera), |v| layout.polygons(v));
        if seen.is_some_and(|v| v.len() > 1) {
            svg.path(&format!("{class} no-edge"), &data);
            let id = format!("skin-map-view-{}", i + 1);
            layout.union_edge(svg, &id, &format!("fov-edge c{}", i + 1), &data);
        } else {
            svg.path(&class, &data);
        }
    }
    match coverage.map(|c| &c.overlap) {
        Some(pieces) if pieces.len() > 1 => {
            let data = layout.polygons(pieces);
            layout.union_edge(svg, "skin-map-overlap", "overlap-edge", &data);
        }
        Some(pieces) => {
            svg.path("overlap-edge", &layout.polygons(pieces));
        }
        None => {}
    }
    svg.close();
    if let Some((coverage, cell_mm)) = coverage.and_then(|c| Some((c, c.cell_mm?))) {
        cells(svg, &layout, &coverage.places, cell_mm);
    }
    svg.path("skin-edge", &layout.skin());
    let first = input
        .analysis
        .presses
        .iter()
        .filter(|p| p.role != PressRole::Sync)
        .map(|p| p.repetition)
        .min();
    let path = input
        .analysis
        .presses
        .iter()
        .filter(|p| p.role != PressRole::Sync && Some(p.repetition) == first);
    svg.open("g", &[("class", &"layer-path")]);
    svg.path("path", &polyline(path.map(|p| layout.px(p.planned)), false));
    svg.close();
    let end = scale_end(locations.iter().map(|l| l.mean_error_mm).collect());
    discs(svg, &layout, &locations, |l| Some(l.mean_error_mm), end);
    let mut vectors = String::new();
    let mut tips = Vec::with_capacity(counted.len());
    let mut numbers = Vec::with_capacity(counted.len());
    for p in &counted {
        if let (Some(t), Some(e)) = (p.truth, p.estimate()) {
            vectors.push_str(&polyline([layout.px(t), layout.px(e)], false));
            tips.push(layout.px(e));
            numbers.push(p.press);
        }
    }
    let dense = if counted.len() > 600 { " dense" } else { "" };
    svg.open("g", &[("class", &format_args!("layer-vectors{dense}"))]);
    press_path(svg, "vector", &vectors, &numbers);
    press_path(svg, "dots tips", &dots(tips), &numbers);
    svg.close();
    let (mut squares, mut numbers) = (String::new(), Vec::new());
    let disc = |p: &PressResult| locations.iter().any(|l| l.location == p.location);
    for p in others.iter().filter(|p| p.timing.is_some() || !disc(p)) {
        let (x, y) = layout.px(p.truth.unwrap_or(p.planned));
        numbers.push(p.press);
        squares.push_str(&polyline(
            [
                (x - 5.0, y - 5.0),
                (x + 5.0, y - 5.0),
                (x + 5.0, y + 5.0),
                (x - 5.0, y + 5.0),
            ],
            true,
        ));
    }
    svg.open("g", &[("class", &"layer-others")]);
    press_path(svg, "other", &squares, &numbers);
    svg.close();
    layout.cameras(svg, input);
    colour_bar(
        svg,
        "mean error\n(mm)",
        end,
        locations.iter().filter(|l| l.mean_error_mm > end).count(),
    );
    legend(svg);
    svg.leaf("g", &[("class", &"selection")]);
    if counted.is_empty() {
        canvas.empty("no scored press was located");
    }
    canvas.finish(
        &format!(
            "n = {} presses, {} locations",
            counted.len(),
            locations.len()
        ),
        "presses",
        "select",
    )
}

/// Edge of the probed area: one cell per location, clipped to the outline.
fn cells(svg: &mut Svg, layout: &Layout, places: &[Point2], cell_mm: f64) {
    let side = cell_mm * layout.axes.x.per_unit();
    let mut data = String::new();
    for place in places {
        let (x, y) = layout.px(*place);
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
    layout.union_edge(svg, "skin-map-probed", "cell", &data);
    svg.close();
}

fn legend(svg: &mut Svg) {
    let (x, mut y) = (756.0, 400.0);
    let mut row = |svg: &mut Svg, label: &str, draw: &dyn Fn(&mut Svg, f64)| {
        draw(svg, y);
        svg.text((x + 24.0, y + 4.0), "tick", "start", label);
        y += 21.0;
    };
    let swatch = |class: &'static str| {
        move |svg: &mut Svg, y: f64| {
            svg.leaf(
                "rect",
                &[
                    ("class", &class),
                    ("x", &Px(x)),
                    ("y", &Px(y - 6.0)),
                    ("width", &"18"),
                    ("height", &"12"),
                ],
            );
        }
    };
    row(svg, "seen by camera 1", &swatch("fov strong f1 c1"));
    row(svg, "seen by camera 2", &swatch("fov strong f2 c2"));
    row(svg, "seen by both", &|svg, y| {
        svg.line("overlap-edge", (x, y), (x + 18.0, y));
    });
    row(svg, "probed area", &|svg, y| {
        svg.leaf(
            "rect",
            &[
                ("class", &"cell"),
                ("x", &Px(x + 2.0)),
                ("y", &Px(y - 7.0)),
                ("width", &"14"),
                ("height", &"14"),
            ],
        );
    });
    row(svg, "press path", &|svg, y| {
        svg.line("path", (x, y), (x + 18.0, y));
    });
    row(svg, "truth to estimate", &|svg, y| {
        svg.line("vector", (x, y), (x + 16.0, y));
        svg.path("dots tips", &dots([(x + 16.0, y)]));
    });
    row(svg, "not counted", &|svg, y| {
        svg.leaf(
            "rect",
            &[
                ("class", &"other"),
                ("x", &Px(x + 4.0)),
                ("y", &Px(y - 5.0)),
                ("width", &"10"),
                ("height", &"10"),
            ],
        );
    });
}

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
    let mut canvas = Canvas::new(
        input,
        "repeat-map",
        "Spread between repetitions",
        caption,
        SIZE,
        &[],
    );
    backdrop(&mut canvas, &layout);
    let svg = &mut canvas.svg;
    let end = scale_end(locations.iter().filter_map(|l| l.std_mm).collect());
    discs(svg, &layout, &locations, |l| l.std_mm, end);
    layout.cameras(svg, input);
    let beyond = locations
        .iter()
        .filter(|l| l.std_mm.is_some_and(|s| s > end))
        .count();
    colour_bar(svg, "std between\nrepetitions (mm)", end, beyond);
    if locations.is_empty() {
        canvas.empty("no location has two presses that count");
    }
    canvas.finish(
        &format!("n = {} locations", locations.len()),
        "locations",
        "",
    )
}
