//! Owns the pictures of single presses: pixels with events, by polarity.

use std::fmt::Write as _;

use skinrig_analysis::result::{PicturePixel, PressPicture, PressView};
use skinrig_model::SENSOR_WIDTH;

use super::{Canvas, Figure};
use crate::ReportInput;
use crate::axes::tick_label;
use crate::svg::Px;

/// Pixels that saw mostly ON or mostly OFF events, one strip per press and camera; pixels outside the
/// cluster are pale. `None` without any picture.
#[must_use]
pub fn press_pictures(input: &ReportInput<'_>) -> Option<Figure> {
    let pictures = &input.analysis.pictures;
    let presses = crate::tables::pictured(input.analysis);
    if presses.is_empty() {
        return None;
    }
    let tallest = pictures
        .iter()
        .map(|p| f64::from(rows(p)))
        .fold(1.0, f64::max);
    // Two strips beside each other; a pixel of the sensor is `k` wide and high.
    let k = 570.0 / f64::from(SENSOR_WIDTH);
    let row_height = tallest * k + 56.0;
    let size = (1240.0, 46.0 + row_height * presses.len() as f64 + 26.0);
    let caption = "Pixels with events during single presses, cropped rows of the sensor, camera 1 left, camera 2 \
         right. Colour: the polarity that the pixel saw more often. Pale pixels are not part of the cluster. \
         Cross: centroid of the cluster; triangles: its \
         column, the only coordinate that locates."
        .to_owned();
    let mut canvas = Canvas::new(
        input,
        "press-pictures",
        "Single presses: sensor images",
        caption,
        size,
        &[],
    );
    for (i, press) in presses.iter().enumerate() {
        for camera in 0..2 {
            let Some(p) = pictures
                .iter()
                .find(|p| p.press.0 == *press && p.camera.index() == camera)
            else {
                continue;
            };
            let (x, y) = (
                50.0 + 610.0 * f64::from(camera as u8),
                46.0 + row_height * i as f64,
            );
            let view = input
                .analysis
                .presses
                .iter()
                .find(|r| r.press.0 == *press)
                .and_then(|r| r.views[camera]);
            strip(&mut canvas, p, (x, y), k, view);
        }
    }
    for (i, (name, class)) in [("ON", "on"), ("OFF", "off")].into_iter().enumerate() {
        let x = 1120.0 + 58.0 * i as f64;
        canvas.svg.leaf(
            "rect",
            &[
                ("class", &class),
                ("x", &Px(x)),
                ("y", &"8"),
                ("width", &"11"),
                ("height", &"11"),
            ],
        );
        canvas.svg.text((x + 16.0, 18.0), "tick", "start", name);
    }
    Some(canvas.finish(&format!("{} presses", presses.len()), "pictures", ""))
}

fn rows(p: &PressPicture) -> u32 {
    u32::from(p.rows.1.saturating_sub(p.rows.0)) + 1
}

fn strip(
    canvas: &mut Canvas<'_>,
    p: &PressPicture,
    at: (f64, f64),
    k: f64,
    view: Option<PressView>,
) {
    let svg = &mut canvas.svg;
    let height = f64::from(rows(p)) * k;
    let width = f64::from(SENSOR_WIDTH) * k;
    svg.text(
        (at.0, at.1 - 11.0),
        "panel",
        "start",
        &format!("press {} · camera {}", p.press.0, p.camera.number()),
    );
    svg.leaf(
        "rect",
        &[
            ("class", &"tile"),
            ("x", &Px(at.0)),
            ("y", &Px(at.1)),
            ("width", &Px(width)),
            ("height", &Px(height)),
        ],
    );
    svg.text(
        (at.0 + width, at.1 - 11.0),
        "tick",
        "end",
        "column u (px) across, row v (px) down",
    );
    // Run lengths in sensor pixels: the group carries place and size.
    svg.open(
        "g",
        &[(
            "transform",
            &format_args!("translate({} {}) scale({k:.5})", Px(at.0), Px(at.1)),
        )],
    );
    for (class, clustered, on) in [
        ("on noise", false, true),
        ("off noise", false, false),
        ("on", true, true),
        ("off", true, false),
    ] {
        let wanted = |q: &&PicturePixel| {
            q.clustered == clustered && (q.on >= q.off) == on && q.v >= p.rows.0 && q.v <= p.rows.1
        };
        svg.path(class, &runs(p.pixels.iter().filter(wanted), p.rows.0));
    }
    svg.close();
    for u in [0.0, 160.0, 320.0, 480.0, 640.0] {
        svg.text(
            (at.0 + u * k, at.1 + height + 19.0),
            "tick",
            "middle",
            &tick_label(u, 1.0),
        );
    }
    for v in [p.rows.0, p.rows.1] {
        let y = at.1 + (f64::from(v) - f64::from(p.rows.0) + 0.5) * k;
        svg.text((at.0 - 5.0, y + 4.0), "tick", "end", &v.to_string());
    }
    if let Some(u) = view.and_then(|v| v.centroid_u).filter(|u| u.is_finite()) {
        let x = at.0 + u * k;
        let v = view.and_then(|v| v.centroid_v).filter(|v| v.is_finite());
        if let Some(v) = v {
            let y = at.1 + (v - f64::from(p.rows.0) + 0.5) * k;
            let cross = format!("M{} {}h14M{} {}v14", Px(x - 7.0), Px(y), Px(x), Px(y - 7.0));
            svg.path("centroid under", &cross);
            svg.path("centroid", &cross);
        }
        svg.path("pointer", &format!("M{} {}l-4 -7h8Z", Px(x), Px(at.1)));
        svg.path(
            "pointer",
            &format!("M{} {}l-4 7h8Z", Px(x), Px(at.1 + height)),
        );
    }
}

/// Path data of horizontal runs of neighbouring pixels (given row by row), in pixels below `top`.
fn runs<'a>(pixels: impl Iterator<Item = &'a PicturePixel>, top: u16) -> String {
    let mut d = String::new();
    let mut run: Option<(u16, u16, u16)> = None; // row, first and last column
    let flush = |d: &mut String, run: Option<(u16, u16, u16)>| {
        if let Some((v, from, to)) = run {
            let n = u32::from(to - from) + 1;
            let _ = write!(d, "M{from} {}h{n}v1h-{n}z", v - top);
        }
    };
    for q in pixels {
        match run {
            Some((v, from, to)) if v == q.v && to.checked_add(1) == Some(q.u) => {
                run = Some((v, from, q.u))
            }
            other => {
                flush(&mut d, other);
                run = Some((q.v, q.u, q.u));
            }
        }
    }
    flush(&mut d, run);
    d
}
