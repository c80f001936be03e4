//! Owns the centroid tracks: where each camera saw each press.

use super::canvas::{Canvas, Figure, LINKED, press_path};
use crate::axes::{Axes, Scale};
use crate::input::ReportInput;
use crate::svg::dots;
use skinrig_analysis::result::PressResult;
use skinrig_model::{PressId, SENSOR_WIDTH, Verdict};

/// Centroid column of every press against its number, one panel per camera (panels A and B of the paper's figure
/// "centroids").
#[must_use]
pub(crate) fn centroid_tracks(input: &ReportInput<'_>) -> Figure {
    let presses = &input.analysis.presses;
    let seen = |camera: usize| {
        presses.iter().filter_map(move |p| {
            let u = p.views[camera]
                .and_then(|v| v.centroid_u)
                .filter(|u| u.is_finite())?;
            Some((p, u))
        })
    };
    let counts = [seen(0).count(), seen(1).count()];
    let caption = format!(
        "Column of the event cluster's centroid for each press, in the order of the plan. A: camera 1 ({} \
         presses), B: camera 2 ({} presses). Open squares: presses that are not valid.",
        counts[0], counts[1]
    );
    let size = (1240.0, 560.0);
    let mut canvas = Canvas::new(
        input,
        "centroid-tracks",
        "Centroid tracks",
        caption,
        size,
        &[LINKED],
    );
    let range = |pick: fn(f64, f64) -> f64, start: f64| {
        presses
            .iter()
            .map(|p| f64::from(p.press.number()))
            .fold(start, pick)
    };
    let (first, last) = (
        range(f64::min, f64::INFINITY),
        range(f64::max, f64::NEG_INFINITY),
    );
    for (camera, top) in [(0usize, 30.0), (1, 282.0)] {
        let axes = Axes {
            x: Scale::new((first - 0.5, last + 0.5), (66.0, 1224.0)),
            y: Scale::new((0.0, f64::from(SENSOR_WIDTH)), (top + 200.0, top)),
            x_label: if camera == 1 {
                "press number in the plan".into()
            } else {
                String::new()
            },
            y_label: "centroid column u (px)".into(),
            tick_count: (14, 5),
        };
        let svg = &mut canvas.svg;
        axes.draw(svg);
        let name = format!("{}   camera {}", ["A", "B"][camera], camera + 1);
        svg.text((66.0, top - 9.0), "panel", "start", &name);
        let px = |p: u32, u: f64| (axes.x.at(f64::from(p)), axes.y.at(u));
        let class = format!("dots c{}", camera + 1);
        let (valid, others): (Vec<_>, Vec<_>) =
            seen(camera).partition(|(p, _)| p.verdict == Verdict::Valid);
        let numbers = |of: &[(&PressResult, f64)]| of.iter().map(|(p, _)| p.press).collect();
        let points = valid.iter().map(|(p, u)| px(p.press.number(), *u));
        let all: Vec<PressId> = numbers(&valid);
        press_path(svg, &class, &dots(points), &all);
        let mut squares = String::new();
        for (p, u) in &others {
            let (x, y) = px(p.press.number(), *u);
            squares.push_str(&format!(
                "M{} {}h6v6h-6Z",
                crate::svg::Px(x - 3.0),
                crate::svg::Px(y - 3.0)
            ));
        }
        let all: Vec<PressId> = numbers(&others);
        press_path(svg, "other", &squares, &all);
        if counts[camera] == 0 {
            svg.text(
                (645.0, top + 104.0),
                "empty",
                "middle",
                "no centroid in this camera",
            );
        }
    }
    canvas.finish(
        &format!("n = {} and {} centroids", counts[0], counts[1]),
        "presses",
        "",
    )
}
