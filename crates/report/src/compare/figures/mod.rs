//! Owns the figures of a comparison: maps, differences in margins, location by location, causes.

mod causes;
mod locations;
mod maps;
mod margins;
mod scales;

pub(super) use causes::causes;
pub(super) use locations::locations;
pub(super) use maps::maps;
pub(super) use margins::margins;

use skinrig_compare::Comparison;

use super::text::{short, stand_in};

/// CSS class for -1 (better), 1 (worse) or 0.
const fn sign_class(sign: i8) -> &'static str {
    match sign {
        -1 => "better",
        1 => "worse",
        _ => "neither",
    }
}

/// Footer: the sessions behind the figure.
fn foot(result: &Comparison, k: usize) -> String {
    let of = |i: usize| {
        let skin = &result.skins[i];
        let ids = skin.sessions.iter().take(3).map(|s| short(&s.session_id));
        let ids = ids.collect::<Vec<_>>().join(", ");
        let more = if skin.sessions.len() > 3 { ", …" } else { "" };
        format!("{} {} ({ids}{more})", skin.letter, skin.name)
    };
    let stand_in = stand_in(result).map_or(String::new(), |w| format!("   {w}"));
    format!("{}   {}{stand_in}", of(0), of(k))
}
