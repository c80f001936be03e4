//! The locations of a path: meander, circles, explicit points, CSV, random.

use std::collections::HashMap;

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use skinrig_model::Point2;

use crate::area::Surroundings;
use crate::keys::{Circles, Csv, LineDirection, MOST_POINTS, Meander, Path, Random};
use crate::protocol::Loader;
use skinrig_settings::Span;
use skinrig_settings::quote;
use skinrig_settings::{Collector, Field};

/// The kind of path and its locations in order. `field` is the mapping that `path` was read from.
pub(crate) fn locations(
    path: &Path,
    field: &Field,
    surroundings: Option<&Surroundings>,
    seed: u64,
    folder: &std::path::Path,
    loader: Loader<'_>,
    out: &mut Collector,
) -> Option<(&'static str, Vec<Point2>)> {
    match path {
        Path {
            meander: Some(grid),
            ..
        } => Some(("meander", meander(grid, field.at("meander"), out)?)),
        Path {
            circles: Some(rings),
            ..
        } => Some(("circles", circles(rings))),
        Path {
            points: Some(points),
            ..
        } => Some(("points", points.clone())),
        Path {
            csv: Some(file), ..
        } => Some(("csv", csv(file, field.at("csv"), folder, loader, out)?)),
        Path {
            random: Some(darts),
            ..
        } => {
            let field = field.at("random");
            Some(("random", random(darts, field, surroundings?, seed, out)?))
        }
        _ => None,
    }
}

fn meander(grid: &Meander, f: &Field, out: &mut Collector) -> Option<Vec<Point2>> {
    let (columns, rows) = (grid.columns, grid.rows);
    let all = u64::from(columns) * u64::from(rows);
    let count = grid.count.map_or(all, u64::from);
    if count > all {
        let at = f.at("count");
        out.error(at.span, at.path.as_str(), "more than the grid has")
            .expected(format!("at most {all}, {columns} columns x {rows} rows"))
            .found(count.to_string());
        return None;
    }
    if count > u64::from(MOST_POINTS) {
        out.error(f.span, f.path.as_str(), "too many locations")
            .expected(format!("at most {MOST_POINTS}"))
            .found(count.to_string());
        return None;
    }
    let length = u64::from(match grid.line_direction {
        LineDirection::X => columns,
        LineDirection::Y => rows,
    });
    let location = |k: u64| {
        let (line, step) = (k / length, k % length);
        let step = if line % 2 == 0 {
            step
        } else {
            length - 1 - step
        };
        let (i, j) = match grid.line_direction {
            LineDirection::X => (step, line),
            LineDirection::Y => (line, step),
        };
        Point2::new(
            grid.origin.x_mm + grid.pitch_mm * i as f64,
            grid.origin.y_mm + grid.pitch_mm * j as f64,
        )
    };
    Some((0..count).map(location).collect())
}

fn circles(circles: &Circles) -> Vec<Point2> {
    let mut points = Vec::new();
    for ring in &circles.rings {
        for k in 0..ring.presses {
            let turn = 360.0 * f64::from(k) / f64::from(ring.presses);
            let angle = (circles.start_angle_deg + turn).to_radians();
            let (sin, cos) = sine_cosine(angle);
            points.push(Point2::new(
                circles.centre.x_mm + ring.radius_mm * cos,
                circles.centre.y_mm + ring.radius_mm * sin,
            ));
        }
    }
    points
}

/// Sine and cosine, the same on every machine, with the last-bit noise near 0 removed.
fn sine_cosine(angle: f64) -> (f64, f64) {
    let tidy = |v: f64| (v * 1e12).round() / 1e12 + 0.0;
    let (sin, cos) = libm::sincos(angle);
    (tidy(sin), tidy(cos))
}

fn csv(
    keys: &Csv,
    f: &Field,
    folder: &std::path::Path,
    loader: Loader<'_>,
    out: &mut Collector,
) -> Option<Vec<Point2>> {
    let file = f.at("file");
    let name = &keys.file;
    let path = folder.join(name);
    let shown = path.display().to_string();
    let bytes = match loader(&path) {
        Ok(bytes) => bytes,
        Err(e) => {
            out.error(file.span, file.path.as_str(), "the file cannot be read")
                .expected("a CSV file, named relative to the protocol's folder")
                .found(format!("{shown}: {e}"));
            return None;
        }
    };
    let text = match skinrig_settings::decode(&bytes) {
        Ok(text) => text,
        Err((at, found)) => {
            out.error(
                file.span,
                file.path.as_str(),
                "not a text file of acceptable size",
            )
            .expected(format!(
                "UTF-8 text of at most {} bytes",
                skinrig_settings::LARGEST_TEXT
            ))
            .found(format!("{found} at byte {at} of {shown}"));
            return None;
        }
    };
    let source = out.sources.add(shown, text.trim_start_matches('\u{feff}'));
    let points = csv_points(source, keys.unit.in_mm(), keys.skip_blank_rows, out)?;
    let count = keys.count.map_or(points.len(), |count| count as usize);
    if count > points.len() {
        let at = f.at("count");
        out.error(at.span, at.path.as_str(), "more than the file has")
            .expected(format!("at most {}, the rows of {name}", points.len()))
            .found(count.to_string());
        return None;
    }
    if points.is_empty() || points.len() > MOST_POINTS as usize {
        out.error(
            file.span,
            file.path.as_str(),
            "the number of locations is out of range",
        )
        .expected(format!("1 to {} rows", MOST_POINTS))
        .found(points.len().to_string());
        return None;
    }
    points.get(..count).map(<[Point2]>::to_vec)
}

/// The columns `x` and `y` of source number `source`. Plain CSV: commas, no quotes.
fn csv_points(
    source: usize,
    scale: f64,
    skip_blank: bool,
    out: &mut Collector,
) -> Option<Vec<Point2>> {
    let text = out.sources.text(source).to_owned();
    let mut at = 0;
    let mut lines = Vec::new();
    for line in text.split('\n') {
        lines.push((at, line.strip_suffix('\r').unwrap_or(line)));
        at += line.len() + 1;
    }
    let (_, header) = *lines.first()?;
    let names: Vec<&str> = header.split(',').map(str::trim).collect();
    let mut columns = [0; 2];
    for (slot, requested) in columns.iter_mut().zip(["x", "y"]) {
        let mut found = (names.iter().enumerate()).filter(|(_, n)| **n == requested);
        let message = match (found.next(), found.next()) {
            (Some((column, _)), None) => {
                *slot = column;
                continue;
            }
            (None, _) => format!("the column `{requested}` is missing"),
            (Some(_), Some(_)) => format!("two columns are called `{requested}`"),
        };
        out.error(Span::new(source, 0, header.len()), "", message)
            .expected("a header line with `x` and `y`, once each, separated by commas")
            .found(quote(header));
        return None;
    }
    let mut points = Vec::new();
    let mut clean = true;
    for (row, (start, line)) in lines.iter().enumerate().skip(1) {
        if line.is_empty() && row + 1 == lines.len() {
            continue; // empty text after the last line break
        }
        let span = Span::new(source, *start, start + line.len());
        if line.split(',').all(|c| c.trim().is_empty()) {
            if !skip_blank {
                out.error(span, "", format!("row {row} is blank"))
                    .expected("numbers in the columns `x` and `y`")
                    .found("only blanks")
                    .help("remove the row, or write `skip_blank_rows: true` in the protocol");
                clean = false;
            }
            continue;
        }
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        let value = |column: usize| {
            let text = cells.get(column).copied().unwrap_or("");
            let value = text.parse::<f64>().ok().map(|v| v * scale);
            value.filter(|v| v.abs() <= 1000.0).ok_or(text)
        };
        match (value(columns[0]), value(columns[1])) {
            (Ok(x), Ok(y)) => points.push(Point2::new(x, y)),
            (Err(text), _) | (_, Err(text)) => {
                out.error(span, "", format!("row {row} is not a location"))
                    .expected("numbers within 1000 mm in the columns `x` and `y`")
                    .found(quote(text));
                clean = false;
            }
        }
    }
    clean.then_some(points)
}

/// A number in 0..1 with 53 random bits.
fn unit(rng: &mut Xoshiro256PlusPlus) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// Consecutive misses after which the search gives up.
const MOST_MISSES: u32 = 20_000;

/// Dart throwing: uniform points of the enclosing rectangle from `xoshiro256++(seed)`, x before y; a point counts
/// if it lies inside the outline by the margins, outside every keep-out, and far enough from every other.
fn random(
    keys: &Random,
    f: &Field,
    around: &Surroundings,
    seed: u64,
    out: &mut Collector,
) -> Option<Vec<Point2>> {
    let count = keys.count as usize;
    let spacing = keys.spacing_mm;
    let margin = keys.margin_mm + around.margin_mm;
    let seed = keys.seed.unwrap_or(seed);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let outline = &around.outline;
    let corner = Point2::new(
        outline.centre.x_mm - outline.width_mm / 2.0,
        outline.centre.y_mm - outline.height_mm / 2.0,
    );
    // Neighbours closer than `spacing` lie in the same or an adjacent cell of this size.
    let cell = spacing.max(1e-3);
    let cell_of = |p: Point2| {
        (
            (p.x_mm / cell).floor() as i64,
            (p.y_mm / cell).floor() as i64,
        )
    };
    let mut cells: HashMap<(i64, i64), Vec<Point2>> = HashMap::new();
    let mut points: Vec<Point2> = Vec::with_capacity(count);
    let mut misses = 0;
    while points.len() < count {
        let x = corner.x_mm + outline.width_mm * unit(&mut rng);
        let p = Point2::new(x, corner.y_mm + outline.height_mm * unit(&mut rng));
        let (i, j) = cell_of(p);
        let crowded = || {
            (-1..=1).any(|di| {
                (-1..=1).any(|dj| {
                    cells
                        .get(&(i + di, j + dj))
                        .is_some_and(|c| c.iter().any(|q| q.distance_mm(p) < spacing))
                })
            })
        };
        let free = outline.clearance_mm(p) >= margin
            && around
                .keep_outs
                .iter()
                .all(|k| k.area.distance_mm(p, p) > k.margin_mm);
        if free && !crowded() {
            cells.entry((i, j)).or_default().push(p);
            points.push(p);
            misses = 0;
            continue;
        }
        misses += 1;
        if misses > MOST_MISSES {
            let field = f.at("count");
            out.error(field.span, field.path.as_str(), "the locations do not fit")
                .expected(format!(
                    "{count} locations {spacing} mm apart, {margin} mm inside the outline"
                ))
                .found(format!("room for {} with seed {seed}", points.len()))
                .help("ask for fewer locations, less spacing or a smaller margin");
            return None;
        }
    }
    Some(points)
}
