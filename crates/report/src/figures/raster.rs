//! Owns raster images inside a figure: PNG with a palette, embedded in the SVG.

use std::fmt::Display;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use crate::markup::Markup;
use crate::svg::Px;

/// Rectangle in a figure: left, top, width, height, px.
pub(super) type Rectangle = (f64, f64, f64, f64);

/// PNG of indices into a palette of (red, green, blue, alpha). `None` if the indices do not fill the size or exceed the
/// palette.
pub(super) fn indexed_png(
    (width, height): (u32, u32),
    indices: &[u8],
    palette: &[[u8; 4]],
) -> Option<Vec<u8>> {
    let size = u64::from(width) * u64::from(height);
    if size == 0
        || indices.len() as u64 != size
        || indices.iter().any(|i| usize::from(*i) >= palette.len())
    {
        return None;
    }
    let mut bytes = vec![];
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    encoder.set_palette(
        palette
            .iter()
            .flat_map(|c| [c[0], c[1], c[2]])
            .collect::<Vec<u8>>(),
    );
    encoder.set_trns(palette.iter().map(|c| c[3]).collect::<Vec<u8>>());
    let mut writer = encoder.write_header().ok()?;
    writer.write_image_data(indices).ok()?;
    writer.finish().ok()?;
    Some(bytes)
}

/// Draws a PNG over the whole frame.
pub(super) fn image(svg: &mut Markup, class: &str, frame: Rectangle, png: &[u8]) {
    let data = format!("data:image/png;base64,{}", STANDARD.encode(png));
    let attributes: [(&str, &dyn Display); 7] = [
        ("class", &class),
        ("preserveAspectRatio", &"none"),
        ("href", &data),
        ("x", &Px(frame.0)),
        ("y", &Px(frame.1)),
        ("width", &Px(frame.2)),
        ("height", &Px(frame.3)),
    ];
    svg.leaf("image", &attributes);
}
