//! Owns the maps: error of both skins and their difference, with the same colour step per mm in all three.

use skinrig_compare::{Comparison, Location, LocationComparison};
use skinrig_model::Point2;

use super::{foot, scales};
use crate::colour::{diverging, viridis};
use crate::format::number;
use crate::markup::Markup;
use crate::plot::{Axis, Figure, Place, Plot, Sheet, WIDE, extent, scale_end};
use crate::svg::{Px, polyline};

/// Maps of the first skin and of skin `k`.
pub(in crate::compare) fn maps(result: &Comparison, k: usize) -> Option<Figure> {
    let outline = result.outline?;
    let letter = result.skins[k].letter;
    let errors = result
        .locations
        .iter()
        .flat_map(|l| [&l.skins[0], &l.skins[k]]);
    let end = scale_end(errors.filter_map(|h| h.error_mm))?;
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
    let polygon = outline.polygon(24);
    let range = |f: fn(&Point2) -> f64| extent(polygon.iter().map(f)).unwrap_or((0.0, 1.0));
    let (xs, ys) = (range(|p| p.x_mm), range(|p| p.y_mm));
    let share = (ys.1 - ys.0) / (xs.1 - xs.0);
    // Frames of 350 px or less: one scale for both axes.
    let (width, height) = if share > 1.0 {
        (350.0 / share, 350.0)
    } else {
        (350.0, 350.0 * share)
    };
    let radius = radius(&result.locations) * width / (xs.1 - xs.0);
    let name = |i: usize| format!("{} {}", result.skins[i].letter, result.skins[i].name);
    let titles = [
        format!("error of {}", name(0)),
        format!("error of {}", name(k)),
        format!("{letter} - A"),
    ];
    let plots = titles.iter().enumerate().map(|(panel, title)| {
        let polygon = &polygon;
        Plot::new(
            Axis::linear(xs, "x, skin frame (mm)"),
            Axis::linear(ys, "y, skin frame (mm)"),
        )
        .title(title.chars().take(46).collect::<String>())
        .draw(move |svg, place| {
            let at = |p: &Point2| place.at((p.x_mm, p.y_mm));
            svg.path("skin", &polyline(polygon.iter().map(at), true));
            let skin = [0, k, k][panel];
            for location in &result.locations {
                let px = at(&location.at);
                if panel < 2 {
                    error_disc(svg, px, radius, &location.skins[skin], end, location);
                } else {
                    difference_disc(svg, px, radius, location, k, end);
                }
            }
            if panel < 2 {
                let data = vectors(result, place, skin, times);
                svg.path("vectors under", &data);
                svg.path("vectors", &data);
            }
            let (left, top, width, height) = place.frame();
            let below = (left, top + height + 60.0);
            match panel {
                0 => scales::errors(svg, below, width, end),
                1 => scales::marks(svg, below),
                _ => scales::differences(svg, below, width, end, letter),
            }
        })
        .deeper(scales::HEIGHT)
    });
    let title = format!("Where {letter} errs more or less than A");
    let sheet = Sheet::new(&format!("maps-{k}"), &title, caption, WIDE)
        .shared_columns(3)
        .frames(width)
        .row(height, plots);
    Some(sheet.finish(&foot(result, k), "", "locations"))
}

/// Mean error vectors of a skin, magnified.
fn vectors(result: &Comparison, place: &Place, skin: usize, times: f64) -> String {
    let vector = |l: &Location| {
        let [x, y] = l.skins[skin].vector_mm?;
        let tip = (l.at.x_mm + times * x, l.at.y_mm + times * y);
        let ends = [place.at((l.at.x_mm, l.at.y_mm)), place.at(tip)];
        Some(polyline(ends, false))
    };
    result.locations.iter().filter_map(vector).collect()
}

fn tested(location_result: &LocationComparison) -> bool {
    location_result
        .difference_mm
        .is_some_and(|d| d.low.is_some() && d.high.is_some())
}

/// Tooltip of a location.
fn tooltip(location: &Location) -> String {
    let skins = location
        .skins
        .iter()
        .zip('A'..)
        .map(|(location_result, letter)| {
            let rank = location_result
                .rank
                .map_or(String::new(), |r| format!(", rank {r}"));
            format!(
                "{letter}: {} mm ({} of {} presses{rank})",
                number(location_result.error_mm, 2),
                location_result.presses[0],
                location_result.presses[1]
            )
        });
    let at = format!("({}, {}) mm", location.at.x_mm, location.at.y_mm);
    std::iter::once(at)
        .chain(skins)
        .collect::<Vec<_>>()
        .join("\n")
}

fn disc(svg: &mut Markup, (x, y): (f64, f64), r: f64, fill: &str, ring: bool, location: &Location) {
    let class = if ring { "disc sure" } else { "disc" };
    svg.open(
        "circle",
        &[
            ("cx", &Px(x)),
            ("cy", &Px(y)),
            ("r", &Px(r)),
            ("fill", &fill),
            ("class", &class),
        ],
    );
    svg.holding("title", &[], &tooltip(location));
    svg.close();
}

fn error_disc(
    svg: &mut Markup,
    at: (f64, f64),
    r: f64,
    location_result: &LocationComparison,
    end: f64,
    location: &Location,
) {
    match location_result.error_mm {
        Some(error) => disc(svg, at, r, &viridis(error / end), false, location),
        None if location_result.presses[1] > 0 => {
            let (x, y) = at;
            let cross = format!("M{} {}l8 8m0 -8l-8 8", Px(x - 4.0), Px(y - 4.0));
            svg.path("cross", &cross);
        }
        None => {}
    }
}

fn difference_disc(
    svg: &mut Markup,
    at: (f64, f64),
    r: f64,
    location: &Location,
    k: usize,
    end: f64,
) {
    let location_result = &location.skins[k];
    let Some(difference) = location_result.difference_mm else {
        return;
    };
    let sign = location_result.sign();
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
    let up = match sign {
        -1 => 1.0,
        1 => -1.0,
        _ => return,
    };
    let (from, tip) = (Px(y - 0.6 * up * h), Px(1.5 * up * h));
    let triangle = format!("M{} {from}h{}l{} {tip}Z", Px(x - h), Px(2.0 * h), Px(-h));
    svg.path("arrow", &triangle);
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
    let mut lengths: Vec<f64> = vectors.flatten().map(|[x, y]| libm::hypot(x, y)).collect();
    lengths.sort_by(f64::total_cmp);
    let large = lengths
        .get((0.95 * lengths.len() as f64) as usize)
        .or(lengths.last());
    let factor = 7.0 / large.copied().unwrap_or(1.0).max(1e-3);
    [20.0, 10.0, 5.0, 2.0]
        .into_iter()
        .find(|t| *t <= factor)
        .unwrap_or(1.0)
}
