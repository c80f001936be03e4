//! Owns the images of single presses: pixels with events, by polarity.

use skinrig_analysis::result::{PressPicture, PressView};
use skinrig_model::SENSOR_WIDTH;

use super::canvas::{Canvas, Figure};
use super::raster::{image, indexed_png};
use crate::axes::tick_label;
use crate::input::ReportInput;
use crate::svg::Px;

/// Colours of an image: no event, then ON and OFF outside the cluster, then ON and OFF inside it. An image cannot follow the
/// page's theme, so these colours work on light and dark; they match `.pictured-on` and `.pictured-off` in the figure's
/// style.
const PALETTE: [[u8; 4]; 5] = [
    [0, 0, 0, 0],
    [0x10, 0xa5, 0x7c, 90],
    [0xc4, 0x62, 0x9c, 90],
    [0x10, 0xa5, 0x7c, 255],
    [0xc4, 0x62, 0x9c, 255],
];

/// Pixels with mostly ON or mostly OFF events, one strip per press and camera; pixels outside the cluster are pale. `None`
/// without images.
#[must_use]
pub(crate) fn press_pictures(input: &ReportInput<'_>) -> Option<Figure> {
    let pictures = &input.analysis.pictures;
    let presses = crate::tables::pictured(input.analysis);
    if presses.is_empty() {
        return None;
    }
    let tallest = pictures
        .iter()
        .map(|p| f64::from(rows(p)))
        .fold(1.0, f64::max);
    // Two strips side by side; a sensor pixel is `k` px wide and high.
    let k = 570.0 / f64::from(SENSOR_WIDTH);
    let row_height = tallest * k + 56.0;
    let size = (1240.0, 46.0 + row_height * presses.len() as f64 + 26.0);
    let caption = "Pixels with events during single presses, cropped rows of the sensor, camera 1 left, camera 2 \
        right. Colour: majority polarity of the pixel. Pale pixels are outside the cluster. Cross: centroid of the \
        cluster; triangles: its column, the only coordinate used for localisation."
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
                .find(|p| p.press == *press && p.camera.index() == camera)
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
                .find(|r| r.press == *press)
                .and_then(|r| r.views[camera]);
            strip(&mut canvas, p, (x, y), k, view);
        }
    }
    for (i, (name, class)) in [("ON", "pictured-on"), ("OFF", "pictured-off")]
        .into_iter()
        .enumerate()
    {
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
        &format!("{} · {}", p.press, p.camera),
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
    match png(p) {
        Some(bytes) => image(svg, "picture", (at.0, at.1, width, height), &bytes),
        None => {
            let middle = (at.0 + width / 2.0, at.1 + height / 2.0);
            svg.text(middle, "empty", "middle", "no picture of this size");
        }
    }
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

/// The image as a PNG, one px per sensor pixel. Ignores pixels outside the rows or the sensor.
fn png(p: &PressPicture) -> Option<Vec<u8>> {
    let size = (u32::from(SENSOR_WIDTH), rows(p));
    let mut indices = vec![0u8; (size.0 * size.1) as usize];
    let inside = |u: u16, v: u16| u < SENSOR_WIDTH && (p.rows.0..=p.rows.1).contains(&v);
    for q in p.pixels.iter().filter(|q| inside(q.u, q.v)) {
        let at = u32::from(q.v - p.rows.0) * size.0 + u32::from(q.u);
        indices[at as usize] = 1 + u8::from(q.on < q.off) + 2 * u8::from(q.clustered);
    }
    indexed_png(size, &indices, &PALETTE)
}

#[cfg(test)]
mod tests {
    use skinrig_analysis::result::PicturePixel;

    use super::*;

    /// In the decoded image every pixel has its polarity and cluster, and nothing outside the rows is drawn.
    #[test]
    fn the_picture_holds_every_pixel_within_its_rows() {
        let pixel = |u, v, on, off, clustered| PicturePixel {
            u,
            v,
            on,
            off,
            clustered,
        };
        let picture = PressPicture {
            press: skinrig_model::PressId::from_index(1),
            camera: skinrig_model::CameraId::One,
            rows: (10, 11),
            pixels: vec![
                pixel(0, 10, 1, 0, true),
                pixel(639, 11, 0, 3, false),
                pixel(2, 11, 2, 2, false),
                pixel(5, 12, 1, 0, true),
                pixel(640, 10, 1, 0, true),
                pixel(7, 9, 0, 1, true),
                pixel(3, 10, 0, 1, true),
            ],
        };
        let mut reader = png::Decoder::new(std::io::Cursor::new(png(&picture).unwrap()))
            .read_info()
            .unwrap();
        let mut indices = [0; 2 * 640];
        reader.next_frame(&mut indices).unwrap();
        let drawn: Vec<(usize, u8)> = (0..).zip(indices).filter(|(_, i)| *i > 0).collect();
        assert_eq!(drawn, [(0, 3), (3, 4), (642, 1), (1279, 2)]);
    }
}
