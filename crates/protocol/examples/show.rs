//! Shows what a protocol compiles to, or what is wrong with it, and writes its path as an SVG:
//! `cargo run -p skinrig-protocol --example show -- FILE SVG [--set key=value]...`.

use std::io::Write;

use skinrig_protocol::{Protocol, check, path_svg};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments
        .next()
        .ok_or("expected the name of a protocol file")?;
    let svg = arguments
        .next()
        .ok_or("expected the name of the SVG to write")?;
    let overrides: Vec<String> = arguments.filter(|a| a != "--set").collect();
    let bytes = std::fs::read(&file)?;
    let mut out = std::io::stdout();
    match Protocol::parse(&file, &bytes, &overrides, &|p| std::fs::read(p)) {
        Err(diagnostics) => write!(out, "{diagnostics}")?,
        Ok(protocol) => {
            let plan = protocol.compile();
            writeln!(out, "{}", plan.summary())?;
            for violation in check(&plan, &protocol.surroundings, Some(protocol.motion.home)) {
                writeln!(out, "{violation}")?;
            }
            std::fs::write(svg, path_svg(&plan, &protocol.surroundings))?;
        }
    }
    Ok(())
}
