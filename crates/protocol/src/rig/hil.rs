//! What a suite of checks may do on a bench.

use serde::Serialize;

use super::build::Places;
use crate::shape::Field;
use skinrig_settings::Collector;

/// What a suite of checks may do.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct HilSetup {
    /// Drills that a bench permits; an emulated one permits all.
    pub drills: Vec<Drill>,
    /// Programs that switch the lamps.
    pub lamps: Option<Lamps>,
}

/// A drill.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Drill {
    /// The program that holds the arm is killed.
    Watchdog,
    /// The arm is stopped in the middle of a move.
    Stop,
}

/// Programs that switch the lamps, each with its arguments; they are run without a shell.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Lamps {
    /// Switches them off.
    pub dark: Vec<String>,
    /// Switches them on.
    pub lit: Vec<String>,
}

pub(super) fn hil(f: &Field, places: &Places<'_>, out: &mut Collector) -> Option<HilSetup> {
    let drills = f.get("drills")?.items().iter().map(|d| {
        Some(match d.as_word()? {
            "watchdog" => Drill::Watchdog,
            _ => Drill::Stop,
        })
    });
    let mut program = |light: &Field, key: &str| -> Option<Vec<String>> {
        let words = light.get(key)?.items().iter();
        words.map(|w| places.text(w, out)).collect()
    };
    let lamps = match f.get("light") {
        Some(light) => {
            let (dark, lit) = (program(light, "dark"), program(light, "lit"));
            Some(Lamps {
                dark: dark?,
                lit: lit?,
            })
        }
        None => None,
    };
    Some(HilSetup {
        drills: drills.collect::<Option<_>>()?,
        lamps,
    })
}
