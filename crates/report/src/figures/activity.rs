//! Owns the image of accumulated pixel activity: events per pixel over the whole recording.

use skinrig_analysis::result::Activity;

use super::origin::foot;
use super::raster::{image, indexed_png};
use crate::colour::{hex, viridis_rgb};
use crate::format::grouped;
use crate::input::ReportInput;
use crate::markup::Markup;
use crate::plot::{Axis, Figure, Plot, Scale, Sheet, WIDE, colour_bar, rectangle};

/// Number of colours; more would only enlarge the file.
const LEVELS: u8 = 64;
/// Height of an image in the figure, px.
const HEIGHT: f64 = 400.0;

/// Events per pixel of each camera over the recording on a logarithmic colour scale, with the crop (panel A with its yellow
/// box in the paper's figure of event data). `None` without events.
#[must_use]
pub fn activity(input: &ReportInput<'_>) -> Option<Figure> {
    let pictures = &input.analysis.activity;
    let counts = || pictures.iter().flat_map(|p| &p.counts).copied();
    let most = counts().max().filter(|n| *n > 0)?;
    let cell = pictures.iter().map(|p| p.cell_px).max().unwrap_or(1);
    let caption = format!(
        "Accumulated pixel activity: events over the whole recording and the whole sensor, per square of {cell} x \
         {cell} pixels. Colour: number of events, logarithmic, one scale for both cameras; squares without events are \
         blank. Box: rows that are analysed."
    );
    let last = pictures.len() - 1;
    let plots = pictures.iter().enumerate().map(|(i, picture)| {
        let plot = plot(
            picture,
            most,
            input.analysis.settings.crop_v[picture.camera.index()],
        );
        plot.draw(move |svg, place| {
            if i == last {
                let (left, top, width, height) = place.frame();
                scale(svg, most, (left + width + 12.0, top, height));
            }
        })
    });
    let sheet = Sheet::new("activity", "Accumulated pixel activity", caption, WIDE)
        .columns(&[1.0, 1.0])
        .margins(66.0, 64.0)
        .row(HEIGHT, plots);
    let n = format!("n = {} events", grouped(counts().sum()));
    Some(sheet.finish(&foot(input), &n, "activity"))
}

fn plot(picture: &Activity, most: u64, crop: (u16, u16)) -> Plot<'_> {
    let cell = f64::from(picture.cell_px.max(1));
    let size = |cells| (0.0, f64::from(cells) * cell);
    Plot::new(
        Axis::linear(size(picture.width), "column u (px)").ticks(8),
        Axis::linear(size(picture.height), "row v (px)")
            .ticks(6)
            .downwards(),
    )
    .title(format!("camera {}", picture.camera.number()))
    .draw(move |svg, place| {
        rectangle(svg, "tile", place.frame());
        match png(picture, most) {
            Some(bytes) => image(svg, "raster", place.frame(), &bytes),
            None => {
                svg.text(place.middle(), "empty", "middle", "no picture of this size");
            }
        }
        let (left, _, width, _) = place.frame();
        let ends = [f64::from(crop.0), f64::from(crop.1) + 1.0].map(|v| place.y.at(v));
        for class in ["crop-under", "crop"] {
            rectangle(svg, class, (left, ends[0], width, ends[1] - ends[0]));
        }
        let text = format!("rows {} to {}", crop.0, crop.1);
        svg.text((left + 8.0, ends[0] - 6.0), "crop-name", "start", &text);
    })
}

/// Level of a count: 0 without events, else 1 ..= LEVELS - 1 on a logarithmic scale.
fn level(count: u64, most: u64) -> u8 {
    if count == 0 {
        return 0;
    }
    let share = libm::log(count as f64) / libm::log(most.max(2) as f64);
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

/// Colour scale with decades.
fn scale(svg: &mut Markup, most: u64, (x, top, height): (f64, f64, f64)) {
    let end = libm::log10(most.max(2) as f64);
    let scale = Scale::new((0.0, end), (top + height, top));
    let marks = (0..=end.floor() as i32).map(|p| (f64::from(p), power_of_ten(p)));
    let colour = |share| hex(viridis_rgb(share));
    svg.text((x - 4.0, top - 10.0), "label", "start", "events");
    colour_bar(
        svg,
        scale,
        (x, x + 14.0),
        true,
        colour,
        Some(marks.collect()),
    );
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
