//! The figure: how far each figure of the session lies from its prediction.

use skinrig_compare::scene::FigurePrediction;
use skinrig_statistics::distributions::student_quantile;

use super::{ScenePrediction, words};
use crate::plot::{Axis, Figure, Plot, Sheet, rectangle};
use crate::svg::{Px, dots};

const ROW: f64 = 26.0;
/// Standard deviations shown on each side.
const MAX_DEVIATIONS: f64 = 8.0;

/// One row per figure with a prediction; `None` without any.
pub(super) fn deviations(found: &ScenePrediction) -> Option<Figure> {
    let rows: Vec<(&FigurePrediction, f64)> = found
        .figures
        .iter()
        .filter_map(|row| Some((row, row.predicted?.deviations?)))
        .collect();
    if rows.is_empty() {
        return None;
    }
    let n = rows.len();
    let names = rows
        .iter()
        .map(|(row, _)| words::of(row.figure).name.to_owned());
    let end = MAX_DEVIATIONS + 0.5;
    let x = Axis::linear(
        (-end, end),
        "distance from the prediction (standard deviations of a session)",
    );
    let mut plot =
        Plot::new(x.ticks(9), Axis::categories(names, "").downwards()).upright("axis", 0.0);
    for (i, (row, deviations)) in rows.into_iter().enumerate() {
        let freedom = f64::from(row.replicates.saturating_sub(1));
        let reach = student_quantile(0.975, freedom);
        let class = if row.differs() { "worse" } else { "neither" };
        plot = plot.draw(move |svg, place| {
            let y = place.y.at(i as f64);
            let x = |v: f64| place.x.at(v.clamp(-MAX_DEVIATIONS, MAX_DEVIATIONS));
            let (left, right) = (x(-reach), x(reach));
            rectangle(svg, "tile", (left, y - 8.0, right - left, 16.0));
            if deviations.abs() <= MAX_DEVIATIONS {
                let class = format!("difference value {class}");
                svg.path(&class, &dots([(x(deviations), y)]));
            } else {
                let direction = deviations.signum();
                let (tip, back) = (x(deviations) + 9.0 * direction, Px(-9.0 * direction));
                svg.path(class, &format!("M{} {}l{back} -5v10Z", Px(tip), Px(y)));
            }
            if row.differs() {
                let words = words::of(row.figure);
                let text = if deviations > 0.0 {
                    words.higher
                } else {
                    words.lower
                };
                svg.text((place.x.px.1 + 16.0, y + 4.0), "tick ink", "start", text);
            }
        });
    }
    let caption = format!(
        "The session against {} simulated sessions of its protocol. Band: 95 % of sessions of this scene. Arrows: beyond \
         {MAX_DEVIATIONS} standard deviations. Named: not as predicted, with p values corrected for the number of figures.",
        found.seeds.len()
    );
    let sheet = Sheet::new("deviations", "Session and prediction", caption, 900.0)
        .margins(250.0, 280.0)
        .row(ROW * n as f64, [plot]);
    Some(sheet.finish(&found.origin, "", "prediction"))
}
