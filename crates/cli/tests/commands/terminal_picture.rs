//! Draws the terminal after a command as SVG, for light and dark pages, and compares it with `docs/pictures`.
//!
//! `SKINRIG_WRITE_DOCS=1` writes the pictures instead; look at each one, light and dark.

use std::path::Path;

use anstyle::{Color, RgbColor};
use anstyle_svg::Term;

/// Folder of the pictures.
const PICTURES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/pictures");
/// Text and background colours of a light and a dark page.
const LIGHT: [RgbColor; 2] = [RgbColor(0x1f, 0x23, 0x28), RgbColor(0xff, 0xff, 0xff)];
const DARK: [RgbColor; 2] = [RgbColor(0xe6, 0xed, 0xf3), RgbColor(0x0d, 0x11, 0x17)];
/// The eight colours and the bright ones: readable on the background.
const ON_LIGHT: [u32; 8] = [
    0x1f2328, 0xcf222e, 0x116329, 0x7d4e00, 0x0550ae, 0x8250df, 0x1b7c83, 0x6e7781,
];
const ON_DARK: [u32; 8] = [
    0x484f58, 0xff7b72, 0x3fb950, 0xd29922, 0x58a6ff, 0xbc8cff, 0x39c5cf, 0xb1bac4,
];

const fn rgb(hex: u32) -> RgbColor {
    RgbColor((hex >> 16) as u8, (hex >> 8) as u8, hex as u8)
}

fn terminal([front, back]: [RgbColor; 2], colours: [u32; 8]) -> Term {
    let [a, b, c, d, e, f, g, h] = colours.map(rgb);
    let palette = anstyle_svg::Palette([a, b, c, d, e, f, g, h, a, b, c, d, e, f, g, h]);
    Term::new()
        .palette(palette)
        .fg_color(Color::Rgb(front))
        .bg_color(Color::Rgb(back))
        .min_width_px(0)
}

/// A picture that follows the reader's choice of light or dark.
fn draw(ansi: &str) -> String {
    let light = terminal(LIGHT, ON_LIGHT).render_svg(ansi);
    let dark = terminal(DARK, ON_DARK).render_svg(ansi);
    let is_colour = |line: &&str| line.contains("{ fill: #");
    let colours: Vec<&str> = dark.lines().filter(is_colour).collect();
    let dark = format!(
        "    @media (prefers-color-scheme: dark) {{\n{}\n    }}\n  </style>",
        colours.join("\n")
    );
    // Lines of a picture end where their text ends.
    let picture = light.replacen("  </style>", &dark, 1);
    let lines: Vec<&str> = picture.lines().map(str::trim_end).collect();
    lines.join("\n") + "\n"
}

/// Compares the terminal after `command` with its picture.
#[track_caller]
pub(crate) fn assert_picture(name: &str, command: &str, printed: &str) {
    let screen = format!("\u{1b}[2m$\u{1b}[0m \u{1b}[1m{command}\u{1b}[0m\n{printed}");
    let drawn = draw(screen.trim_end());
    let path = Path::new(PICTURES).join(format!("{name}.svg"));
    if std::env::var_os("SKINRIG_WRITE_DOCS").is_some() {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, &drawn).unwrap();
    }
    let stored = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        stored == drawn,
        "{} differs from what the command prints: run the test with SKINRIG_WRITE_DOCS=1, and look at it\n{printed}",
        path.display()
    );
}
