//! Owns the images of single presses: pixels with events, by polarity.

use skinrig_analysis::result::{PressPicture, PressView};
use skinrig_model::SENSOR_WIDTH;

use super::origin::foot;
use super::raster::{image, indexed_png};
use crate::input::ReportInput;
use crate::plot::{Axis, Figure, Plot, Sample, Sheet, WIDE, rectangle};
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
    let tallest = pictures.iter().map(rows).max().unwrap_or(1);
    let caption = "Pixels with events during single presses, cropped rows of the sensor, camera 1 left, camera 2 \
        right. Colour: majority polarity of the pixel. Pale pixels are outside the cluster. Cross: centroid of the \
        cluster; triangles: its column, the only coordinate used for localisation."
        .to_owned();
    let strips = presses.iter().flat_map(|press| {
        let mut strips: Vec<&PressPicture> =
            pictures.iter().filter(|p| p.press == *press).collect();
        strips.sort_by_key(|p| p.camera.index());
        strips
    });
    let plots = strips.map(|p| {
        let results = input.analysis.presses.iter();
        let press = results.clone().find(|r| r.press == p.press);
        strip(p, press.and_then(|r| r.views[p.camera.index()]))
    });
    // A sensor pixel is about as wide as high.
    let height = (f64::from(tallest) * 546.0 / f64::from(SENSOR_WIDTH)).max(24.0);
    let title = "Single presses: sensor images";
    let sheet = Sheet::new("press-pictures", title, caption, WIDE)
        .columns(&[1.0, 1.0])
        .legend([
            (Sample::Area("pictured-on"), "ON"),
            (Sample::Area("pictured-off"), "OFF"),
        ])
        .rows(height, plots);
    Some(sheet.finish(
        &foot(input),
        &format!("{} presses", presses.len()),
        "pictures",
    ))
}

fn rows(p: &PressPicture) -> u32 {
    u32::from(p.rows.1.saturating_sub(p.rows.0)) + 1
}

fn strip(p: &PressPicture, view: Option<PressView>) -> Plot<'_> {
    let finite = |v: Option<f64>| v.filter(|v| v.is_finite());
    let (u, v) = (
        finite(view.and_then(|v| v.centroid_u)),
        finite(view.and_then(|v| v.centroid_v)),
    );
    let ends = [p.rows.0, p.rows.1].map(|v| (f64::from(v), v.to_string()));
    let columns = [0u16, 160, 320, 480, 640].map(|u| (f64::from(u), u.to_string()));
    let rows = (f64::from(p.rows.0) - 0.5, f64::from(p.rows.1) + 0.5);
    Plot::new(
        Axis::linear((0.0, f64::from(SENSOR_WIDTH)), "").marked(columns.to_vec()),
        Axis::linear(rows, "").marked(ends.to_vec()).downwards(),
    )
    .title(format!("{} · {}", p.press, p.camera))
    .note("column u (px) across, row v (px) down")
    .deeper(6.0)
    .draw(move |svg, place| {
        rectangle(svg, "tile", place.frame());
        match png(p) {
            Some(bytes) => image(svg, "picture", place.frame(), &bytes),
            None => {
                svg.text(place.middle(), "empty", "middle", "no picture of this size");
            }
        }
        let Some(x) = u.map(|u| place.x.at(u)) else {
            return;
        };
        if let Some(y) = v.map(|v| place.y.at(v)) {
            let cross = format!("M{} {}h14M{} {}v14", Px(x - 7.0), Px(y), Px(x), Px(y - 7.0));
            svg.path("centroid under", &cross);
            svg.path("centroid", &cross);
        }
        let (_, top, _, height) = place.frame();
        svg.path("pointer", &format!("M{} {}l-4 -7h8Z", Px(x), Px(top)));
        let bottom = Px(top + height);
        svg.path("pointer", &format!("M{} {bottom}l-4 7h8Z", Px(x)));
    })
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
