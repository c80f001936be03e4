//! Owns the image of accumulated pixel activity: events per pixel over the whole recording.

use skinrig_analysis::result::Activity;

use super::canvas::{Canvas, Figure};
use super::raster::{image, indexed_png};
use crate::axes::{Axes, Scale};
use crate::colour::viridis_rgb;
use crate::input::ReportInput;
use crate::svg::{Px, Svg};

/// Number of colours; more would only enlarge the file.
const LEVELS: u8 = 64;
/// Size of an image in the figure, px.
const PICTURE: (f64, f64) = (540.0, 405.0);

/// Events per pixel of each camera over the recording on a logarithmic colour scale, with the crop (panel A with its yellow
/// box in the paper's figure of event data). `None` without events.
#[must_use]
pub fn activity(input: &ReportInput<'_>) -> Option<Figure> {
    let pictures = &input.analysis.activity;
    let most = pictures.iter().flat_map(|p| &p.counts).copied().max()?;
    if most == 0 {
        return None;
    }
    let cell = pictures.iter().map(|p| p.cell_px).max().unwrap_or(1);
    let caption = format!(
        "Accumulated pixel activity: events over the whole recording and the whole sensor, per square of {cell} x \
         {cell} pixels. Colour: number of events, logarithmic, one scale for both cameras; squares without events are \
         blank. Box: rows that are analysed."
    );
    let mut canvas = Canvas::new(
        input,
        "activity",
        "Accumulated pixel activity",
        caption,
        (1240.0, 520.0),
        &[],
    );
    for picture in pictures {
        let left = 62.0 + 578.0 * picture.camera.index() as f64;
        panel(&mut canvas, picture, most, (left, 36.0));
    }
    scale(&mut canvas.svg, most);
    let events: u64 = pictures.iter().flat_map(|p| &p.counts).sum();
    let n = format!("n = {} events", crate::format::grouped(events));
    Some(canvas.finish(&n, "activity", ""))
}

fn panel(canvas: &mut Canvas<'_>, picture: &Activity, most: u64, (left, top): (f64, f64)) {
    let crop = canvas.input.analysis.settings.crop_v[picture.camera.index()];
    let svg = &mut canvas.svg;
    let cell = f64::from(picture.cell_px.max(1));
    let columns = f64::from(picture.width) * cell;
    let rows = f64::from(picture.height) * cell;
    let axes = Axes {
        x: Scale::new((0.0, columns), (left, left + PICTURE.0)),
        y: Scale::new((0.0, rows), (top, top + PICTURE.1)),
        x_label: "column u (px)".into(),
        y_label: if picture.camera.index() == 0 {
            "row v (px)".into()
        } else {
            String::new()
        },
        tick_count: (8, 6),
    };
    let name = format!("camera {}", picture.camera.number());
    svg.text((left, top - 10.0), "panel", "start", &name);
    let frame: [(&str, &dyn std::fmt::Display); 4] = [
        ("x", &Px(left)),
        ("y", &Px(top)),
        ("width", &Px(PICTURE.0)),
        ("height", &Px(PICTURE.1)),
    ];
    let mut tile: Vec<(&str, &dyn std::fmt::Display)> = vec![("class", &"tile")];
    tile.extend_from_slice(&frame);
    svg.leaf("rect", &tile);
    axes.draw(svg);
    match png(picture, most) {
        Some(bytes) => image(svg, "raster", (left, top, PICTURE.0, PICTURE.1), &bytes),
        None => {
            let middle = (left + PICTURE.0 / 2.0, top + PICTURE.1 / 2.0);
            svg.text(middle, "empty", "middle", "no picture of this size");
        }
    }
    let (first, last) = (f64::from(crop.0), f64::from(crop.1) + 1.0);
    let (y0, y1) = (axes.y.at(first), axes.y.at(last));
    for class in ["crop-under", "crop"] {
        svg.leaf(
            "rect",
            &[
                ("class", &class),
                ("x", &Px(left)),
                ("y", &Px(y0)),
                ("width", &Px(PICTURE.0)),
                ("height", &Px(y1 - y0)),
            ],
        );
    }
    let text = format!("rows {} to {}", crop.0, crop.1);
    svg.text((left + 8.0, y0 - 6.0), "crop-name", "start", &text);
}

/// Level of a count: 0 without events, else 1 ..= LEVELS - 1 on a logarithmic scale.
fn level(count: u64, most: u64) -> u8 {
    if count == 0 {
        return 0;
    }
    let share = (count as f64).ln() / (most.max(2) as f64).ln();
    1 + (share * f64::from(LEVELS - 2)).round() as u8
}

/// PNG with a palette; level 0 is transparent. `None` if the counts do not fill the image.
fn png(picture: &Activity, most: u64) -> Option<Vec<u8>> {
    let size = (u32::from(picture.width), u32::from(picture.height));
    let levels: Vec<u8> = picture.counts.iter().map(|c| level(*c, most)).collect();
    let colour = |i: u8| {
        let [r, g, b] = viridis_rgb(f64::from(i.saturating_sub(1)) / f64::from(LEVELS - 2));
        [r, g, b, if i == 0 { 0 } else { 255 }]
    };
    let palette: Vec<[u8; 4]> = (0..LEVELS).map(colour).collect();
    indexed_png(size, &levels, &palette)
}

/// Colour scale with decades, at the right edge.
fn scale(svg: &mut Svg, most: u64) {
    let (x, top, height) = (1186.0, 60.0, 357.0);
    let steps = u32::from(LEVELS) - 1;
    let step = height / f64::from(steps);
    svg.open("g", &[("class", &"colour-bar")]);
    svg.text((x - 4.0, 26.0), "label", "start", "events");
    for i in 0..steps {
        let [r, g, b] = viridis_rgb(f64::from(i) / f64::from(steps - 1));
        svg.leaf(
            "rect",
            &[
                ("x", &Px(x)),
                ("y", &Px(top + height - f64::from(i + 1) * step)),
                ("width", &"14"),
                ("height", &Px(step + 0.4)),
                ("fill", &format_args!("#{r:02x}{g:02x}{b:02x}")),
            ],
        );
    }
    let top_log = (most.max(2) as f64).log10();
    for power in 0..=top_log.floor() as i32 {
        let y = top + height * (1.0 - f64::from(power) / top_log);
        svg.line("axis", (x + 14.0, y), (x + 18.0, y));
        svg.text((x + 21.0, y + 4.0), "tick", "start", &power_of_ten(power));
    }
    svg.close();
}

fn power_of_ten(power: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    match power {
        0 => "1".into(),
        1 => "10".into(),
        _ => {
            let digits = power.unsigned_abs().to_string();
            let raised = digits.chars().filter_map(|c| c.to_digit(10));
            let raised: String = raised.map(|d| DIGITS[d as usize]).collect();
            format!("10{raised}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The decoded image equals the levels of the counts, and only squares without events are transparent.
    #[test]
    fn the_picture_holds_the_level_of_every_cell() {
        let picture = Activity {
            camera: skinrig_model::CameraId::One,
            cell_px: 2,
            width: 3,
            height: 2,
            counts: vec![0, 1, 10, 100, 1_000, 10_000],
        };
        let bytes = png(&picture, 10_000).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes))
            .read_info()
            .unwrap();
        let see_through = reader.info().trns.as_deref().unwrap();
        assert_eq!(see_through.iter().position(|a| *a == 255), Some(1));
        assert_eq!(see_through.iter().filter(|a| **a == 0).count(), 1);
        let mut pixels = [0; 6];
        reader.next_frame(&mut pixels).unwrap();
        assert_eq!(pixels[0], 0);
        assert_eq!(pixels[1], 1);
        assert_eq!(pixels[5], LEVELS - 1);
        let steps: Vec<u8> = pixels[1..].windows(2).map(|w| w[1] - w[0]).collect();
        assert!(steps.iter().all(|s| (15..=16).contains(s)), "{steps:?}");
        let short = Activity {
            counts: vec![1],
            ..picture
        };
        assert!(png(&short, 1).is_none());
    }
}
