//! The figures: what is known of each constant, and errors by place.

use super::SessionTwin;
use crate::plot::{Axis, Figure, HALF, Plot, Sample, Sheet, rectangle};
use crate::svg::dots;

const ROW: f64 = 30.0;

/// Each constant within its assumed range; `None` without any.
pub(super) fn constants(found: &SessionTwin) -> Option<Figure> {
    let rows = &found.twin.constants;
    if rows.is_empty() {
        return None;
    }
    let names = rows
        .iter()
        .map(|row| row.constant.key().trim_start_matches("scene.").to_owned());
    let x = Axis::linear(
        (0.0, 100.0),
        "position in the assumed range (% of its probability)",
    );
    let mut plot = Plot::new(x, Axis::categories(names, "").downwards());
    for (i, row) in rows.iter().enumerate() {
        let mut draws: Vec<f64> = row.draws.iter().map(|share| 100.0 * share).collect();
        draws.sort_by(f64::total_cmp);
        let at = |q: f64| draws[((draws.len() - 1) as f64 * q) as usize];
        let ends = (at(0.025), at(0.975));
        let middle = at(0.5);
        plot = plot.draw(move |svg, place| {
            let y = place.y.at(i as f64);
            let (left, right) = (place.x.at(ends.0), place.x.at(ends.1));
            rectangle(svg, "tile", (left, y - 9.0, (right - left).max(1.0), 18.0));
            svg.path("difference value neither", &dots([(place.x.at(middle), y)]));
        });
    }
    let caption = "Constants of the twin. Bands: 95 % of what the calibration presses leave possible; dots: the twin. A band over the \
                   whole range: these presses do not show the constant."
        .to_owned();
    let sheet = Sheet::new("constants", "Constants of the twin", caption, HALF)
        .margins(170.0, 16.0)
        .row(ROW * rows.len() as f64, [plot]);
    Some(sheet.finish(&found.origin, "", "constants"))
}

/// Predicted against recorded error of each place; `None` without pairs.
pub(super) fn places(found: &SessionTwin) -> Option<Figure> {
    let places = found.twin.places.as_ref()?;
    let pairs: Vec<(f64, f64)> = places
        .places
        .iter()
        .zip(&places.predicted_mm)
        .filter_map(|(place, predicted)| Some(((*predicted)?, place.scored_mm?)))
        .filter(|(a, b)| *a > 0.0 && *b > 0.0)
        .collect();
    let ends = pairs.iter().flat_map(|(a, b)| [*a, *b]);
    let low = ends.clone().fold(f64::INFINITY, f64::min);
    let high = ends.fold(f64::NEG_INFINITY, f64::max);
    if pairs.is_empty() || low >= high {
        return None;
    }
    let (low, high) = (low / 1.1, high * 1.1);
    let x = Axis::log((low, high), "predicted error (mm)");
    let y = Axis::log((low, high), "recorded error (mm)");
    let n = pairs.len();
    let plot = Plot::new(x, y)
        .line("ref", [(low, low), (high, high)])
        .dots("dots c1", pairs);
    let caption = format!(
        "Errors by place: predicted from the calibration presses, and recorded by the scored presses. {}.",
        crate::format::capitalised(&super::places_sentence(places))
    );
    let sheet = Sheet::new("places", "Errors by place", caption, HALF)
        .legend([
            (Sample::Dot("dots c1"), "places"),
            (Sample::Line("ref"), "equal"),
        ])
        .row(ROW * found.twin.constants.len().max(8) as f64, [plot]);
    Some(sheet.finish(&found.origin, &format!("n = {n} places"), "places"))
}
