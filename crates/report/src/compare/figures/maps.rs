//! Owns the maps: error of both skins and their difference, with the same colour step per mm in all three.

use skinrig_compare::{Comparison, Location, LocationComparison};
use skinrig_model::Point2;

use super::scales::{LEFT, PANEL, STEP, bars, diverging};
use super::{FigureBuilder, RenderedFigure};
use crate::axes::{Axes, Scale};
use crate::colour::viridis;
use crate::format::number;
use crate::svg::{Px, Svg, polyline};

const SIZE: (f64, f64) = (1240.0, 528.0);
const TOP: f64 = 40.0;

/// Maps of the first skin and of skin `k`.
pub(in crate::compare) fn maps(result: &Comparison, k: usize) -> Option<RenderedFigure> {
    let outline = result.outline?;
    let letter = result.skins[k].letter;
    let errors = result
        .locations
        .iter()
        .flat_map(|l| [&l.skins[0], &l.skins[k]]);
    let errors: Vec<f64> = errors.filter_map(|h| h.error_mm).collect();
    let end = scale_end(errors)?;
    let times = magnification(result, k);
    let marked = |sign| {
        result
            .locations
            .iter()
            .filter(|l| l.skins[k].sign() == sign)
            .count()
    };
    let (better, worse) = (marked(-1), marked(1));
    let tested = result
        .locations
        .iter()
        .filter(|l| tested(&l.skins[k]))
        .count();
    let caption = format!(
        "Mean error per location for both skins, and the difference {letter} - A. One mm has the same length on both \
         colour bars. Lines: mean error vectors, magnified {times} times. Triangles down (blue): {letter} errs less \
         and its 95 % interval excludes zero ({better} of {tested} locations with an interval); triangles up (orange): \
         it errs more ({worse}). Without any true difference one location in twenty is marked by chance ({} here).",
        number(Some(tested as f64 * 0.05), 0)
    );
    let mut figure = FigureBuilder::new(
        &format!("maps-{k}"),
        format!("Where {letter} errs more or less than A"),
        caption,
        "locations",
        SIZE,
    );
    let polygon = outline.polygon(24);
    let range = |f: fn(&Point2) -> f64| {
        let low = polygon.iter().map(f).fold(f64::INFINITY, f64::min);
        let high = polygon.iter().map(f).fold(f64::NEG_INFINITY, f64::max);
        (low, high)
    };
    let (xs, ys) = (range(|p| p.x_mm), range(|p| p.y_mm));
    let per_mm = PANEL / (xs.1 - xs.0).max(ys.1 - ys.0);
    let radius = radius(&result.locations) * per_mm;
    let name = |i: usize| format!("{} {}", result.skins[i].letter, result.skins[i].name);
    let titles = [
        format!("error of {}", name(0)),
        format!("error of {}", name(k)),
        format!("{letter} - A"),
    ];
    for (panel, title) in titles.iter().enumerate() {
        let left = LEFT + panel as f64 * STEP;
        let axes = Axes {
            x: Scale::new(xs, (left, left + per_mm * (xs.1 - xs.0))),
            y: Scale::new(ys, (TOP + per_mm * (ys.1 - ys.0), TOP)),
            x_label: "x, skin frame (mm)".into(),
            y_label: if panel == 0 {
                "y, skin frame (mm)".into()
            } else {
                String::new()
            },
            tick_count: (5, 5),
        };
        let svg = &mut figure.svg;
        let shown: String = title.chars().take(46).collect();
        svg.text((left, TOP - 16.0), "panel", "start", &shown);
        axes.draw(svg);
        let at = |p: Point2| (axes.x.at(p.x_mm), axes.y.at(p.y_mm));
        svg.path("skin", &polyline(polygon.iter().map(|p| at(*p)), true));
        for location in &result.locations {
            let place = at(location.at);
            if panel < 2 {
                let here = &location.skins[if panel == 0 { 0 } else { k }];
                error_disc(svg, place, radius, here, end, location);
            } else {
                difference_disc(svg, place, radius, location, k, end);
            }
        }
        if panel < 2 {
            let skin = if panel == 0 { 0 } else { k };
            let vectors = result.locations.iter().filter_map(|l| {
                let [x, y] = l.skins[skin].vector_mm?;
                let tip = Point2::new(l.at.x_mm + times * x, l.at.y_mm + times * y);
                Some(polyline([at(l.at), at(tip)], false))
            });
            let data: String = vectors.collect();
            svg.leaf(
                "path",
                &[
                    ("d", &data),
                    (
                        "style",
                        &"fill:none;stroke:var(--paper);stroke-width:3;opacity:.75",
                    ),
                ],
            );
            svg.leaf(
                "path",
                &[
                    ("d", &data),
                    ("style", &"fill:none;stroke:var(--ink);stroke-width:1.3"),
                ],
            );
        }
    }
    bars(&mut figure.svg, end, letter);
    Some(figure.finish(result, k, SIZE.1))
}

fn tested(here: &LocationComparison) -> bool {
    here.difference_mm
        .is_some_and(|d| d.low.is_some() && d.high.is_some())
}

/// Tooltip of a location.
fn tooltip(location: &Location) -> String {
    let skins = location.skins.iter().zip('A'..).map(|(here, letter)| {
        let rank = here.rank.map_or(String::new(), |r| format!(", rank {r}"));
        format!(
            "{letter}: {} mm ({} of {} presses{rank})",
            number(here.error_mm, 2),
            here.presses[0],
            here.presses[1]
        )
    });
    let at = format!("({}, {}) mm", location.at.x_mm, location.at.y_mm);
    std::iter::once(at)
        .chain(skins)
        .collect::<Vec<_>>()
        .join("\n")
}

fn disc(svg: &mut Svg, (x, y): (f64, f64), r: f64, fill: &str, ring: bool, location: &Location) {
    let width = if ring { "1.8" } else { ".4" };
    svg.open(
        "circle",
        &[
            ("cx", &Px(x)),
            ("cy", &Px(y)),
            ("r", &Px(r)),
            ("fill", &fill),
            ("style", &format!("stroke:#14181d;stroke-width:{width}")),
        ],
    );
    svg.holding("title", &[], &tooltip(location));
    svg.close();
}

fn error_disc(
    svg: &mut Svg,
    at: (f64, f64),
    r: f64,
    here: &LocationComparison,
    end: f64,
    location: &Location,
) {
    match here.error_mm {
        Some(error) => disc(svg, at, r, &viridis(error / end), false, location),
        None if here.presses[1] > 0 => {
            let (x, y) = at;
            let cross = format!("M{} {}l8 8m0 -8l-8 8", Px(x - 4.0), Px(y - 4.0));
            svg.path("cross", &cross);
        }
        None => {}
    }
}

fn difference_disc(svg: &mut Svg, at: (f64, f64), r: f64, location: &Location, k: usize, end: f64) {
    let here = &location.skins[k];
    let Some(difference) = here.difference_mm else {
        return;
    };
    let sign = here.sign();
    disc(
        svg,
        at,
        r,
        &diverging(difference.value / end),
        sign != 0,
        location,
    );
    let (x, y) = at;
    let h = (0.55 * r).max(3.0);
    let triangle = match sign {
        -1 => format!(
            "M{} {}h{}l{} {}Z",
            Px(x - h),
            Px(y - 0.6 * h),
            Px(2.0 * h),
            Px(-h),
            Px(1.5 * h)
        ),
        1 => format!(
            "M{} {}h{}l{} {}Z",
            Px(x - h),
            Px(y + 0.6 * h),
            Px(2.0 * h),
            Px(-h),
            Px(-1.5 * h)
        ),
        _ => return,
    };
    svg.leaf(
        "path",
        &[
            ("d", &triangle),
            (
                "style",
                &"fill:#14181d;stroke:#fff;stroke-width:.8;pointer-events:none",
            ),
        ],
    );
}

/// Round number above 98 % of the errors.
fn scale_end(mut errors: Vec<f64>) -> Option<f64> {
    errors.sort_by(f64::total_cmp);
    let last = errors.len().checked_sub(1)?;
    Some(crate::figures::nice_above(
        errors[(0.98 * last as f64).round() as usize],
    ))
}

/// Half the smallest distance between neighbours, mm, at most 6.
fn radius(locations: &[Location]) -> f64 {
    let mut nearest: Vec<f64> = locations
        .iter()
        .map(|a| {
            let others = locations
                .iter()
                .map(|b| a.at.distance_mm(b.at))
                .filter(|d| *d > 0.01);
            others.fold(f64::INFINITY, f64::min)
        })
        .collect();
    nearest.sort_by(f64::total_cmp);
    let typical = nearest.get(nearest.len() / 2).copied().unwrap_or(10.0);
    (0.46 * typical).clamp(0.8, 4.2)
}

/// Round factor that scales a large mean error vector to about 7 mm.
fn magnification(result: &Comparison, k: usize) -> f64 {
    let vectors = result
        .locations
        .iter()
        .flat_map(|l| [l.skins[0].vector_mm, l.skins[k].vector_mm]);
    let mut lengths: Vec<f64> = vectors.flatten().map(|[x, y]| x.hypot(y)).collect();
    lengths.sort_by(f64::total_cmp);
    let large = lengths
        .get((0.95 * lengths.len() as f64) as usize)
        .or(lengths.last());
    let wanted = 7.0 / large.copied().unwrap_or(1.0).max(1e-3);
    [20.0, 10.0, 5.0, 2.0]
        .into_iter()
        .find(|t| *t <= wanted)
        .unwrap_or(1.0)
}
