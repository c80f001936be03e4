//! Parser of the commands that the operator types.

use skinrig_settings::Dimension;
use skinrig_settings::quantity::{self, QuantityError};

/// A typed command.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum JogCommand {
    /// Move along an axis, 0 to 2, by a distance, mm.
    By(usize, f64),
    /// Move straight to a point, mm.
    To([f64; 3]),
    /// Set the speed of later motions, mm/s.
    Speed(f64),
    /// Print the position of the tip.
    Where,
    /// Move slowly down until contact, at most this distance, mm.
    Touch(f64),
    /// Name the last touched point; optionally with its position on the skin, mm.
    Point(String, Option<[f64; 3]>),
    /// Print the touched points as a block for the rig file.
    Points,
    /// Print the commands.
    Help,
    /// End the jog.
    Quit,
}

/// List of the commands.
pub(crate) const HELP: &str = "\
x +1mm | y -0.5mm | z +10mm   move along one axis
to 0 0 5 mm                   move straight to a point
speed 5mm/s                   speed of later moves
where                         where the tip is
touch [5mm]                   slowly down, at most this far, until the force rises; then lift off
point NAME [at 10 2 0 mm]     name the last touched point (with its position on the skin)
points                        the touched points as a block for the rig file
quit                          hold, retract, disarm";

/// Invalid command.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum JogCommandError {
    /// The first word is unknown.
    #[error(
        "expected x, y, z, to, speed, where, touch, point, points, help or quit, found `{found}`"
    )]
    Word {
        /// The word.
        found: String,
    },
    /// A command without arguments got one.
    #[error("expected nothing after `{word}`, found `{found}`")]
    Argument {
        /// The command.
        word: String,
        /// What follows it.
        found: String,
    },
    /// Not a quantity of the dimension.
    #[error("expected {}, found {}", .0.expected, .0.found)]
    Quantity(QuantityError),
    /// A speed of 0 or below.
    #[error("expected a speed above 0, found {mm_s} mm/s")]
    Speed {
        /// The speed, mm/s.
        mm_s: f64,
    },
    /// A distance of 0 or below.
    #[error("expected a distance above 0, found {mm} mm")]
    Way {
        /// The distance, mm.
        mm: f64,
    },
    /// Invalid name of a point, or extra words.
    #[error(
        "expected `point NAME` or `point NAME at 10 2 0 mm`, the name of letters, digits, - and _, found `{found}`"
    )]
    Point {
        /// What follows `point`.
        found: String,
    },
    /// Not three coordinates.
    #[error("expected three coordinates such as `0 0 5 mm`, found `{found}`")]
    Coordinates {
        /// The text.
        found: String,
    },
}

/// Default distance of `touch`, mm.
const TOUCH_WAY_MM: f64 = 5.0;

/// Parses a line; `None` for blank lines and comments.
///
/// # Errors
/// [`JogCommandError`] for an invalid command.
pub(super) fn parse(line: &str) -> Result<Option<JogCommand>, JogCommandError> {
    let line = line.split('#').next().unwrap_or("").trim();
    let (word, rest) = match line.split_once(char::is_whitespace) {
        Some((word, rest)) => (word, rest.trim()),
        None => (line, ""),
    };
    let bare = |command: JogCommand| {
        if rest.is_empty() {
            Ok(Some(command))
        } else {
            Err(JogCommandError::Argument {
                word: word.to_owned(),
                found: rest.to_owned(),
            })
        }
    };
    match word {
        "" => Ok(None),
        "x" | "y" | "z" => {
            let axis = usize::from(word == "y") + 2 * usize::from(word == "z");
            Ok(Some(JogCommand::By(axis, length(rest)?)))
        }
        "to" => Ok(Some(JogCommand::To(triple(rest)?))),
        "speed" => match measured(rest, Dimension::Speed)? {
            v if v > 0.0 => Ok(Some(JogCommand::Speed(v))),
            mm_s => Err(JogCommandError::Speed { mm_s }),
        },
        "touch" if rest.is_empty() => Ok(Some(JogCommand::Touch(TOUCH_WAY_MM))),
        "touch" => match length(rest)? {
            v if v > 0.0 => Ok(Some(JogCommand::Touch(v))),
            mm => Err(JogCommandError::Way { mm }),
        },
        "point" => point(rest).map(Some),
        "where" => bare(JogCommand::Where),
        "points" => bare(JogCommand::Points),
        "help" => bare(JogCommand::Help),
        "quit" => bare(JogCommand::Quit),
        other => Err(JogCommandError::Word {
            found: other.to_owned(),
        }),
    }
}

fn point(rest: &str) -> Result<JogCommand, JogCommandError> {
    let (name, place) = match rest.split_once(" at ") {
        Some((name, place)) => (name.trim(), Some(triple(place.trim())?)),
        None => (rest, None),
    };
    let plain = |c: char| c.is_alphanumeric() || c == '-' || c == '_';
    if name.is_empty() || !name.chars().all(plain) {
        return Err(JogCommandError::Point {
            found: rest.to_owned(),
        });
    }
    Ok(JogCommand::Point(name.to_owned(), place))
}

fn measured(text: &str, dimension: Dimension) -> Result<f64, JogCommandError> {
    quantity::parse(text, &[dimension])
        .map(|q| q.value)
        .map_err(JogCommandError::Quantity)
}

fn length(text: &str) -> Result<f64, JogCommandError> {
    measured(text, Dimension::Length)
}

/// Three lengths: each with its unit, or one unit for all at the end. Commas between them are allowed.
fn triple(text: &str) -> Result<[f64; 3], JogCommandError> {
    let flat = text.replace(',', " ");
    let words: Vec<&str> = flat.split_whitespace().collect();
    let one = |a: &str, unit: &str| length(&format!("{a}{unit}"));
    match words.as_slice() {
        [x, y, z] => {
            // `0 0 5mm`: the last unit applies to the numbers without one.
            let unit = z.trim_start_matches(|c: char| !c.is_alphabetic() && c != 'µ');
            let each = |a: &str| {
                let has_unit = a.ends_with(char::is_alphabetic);
                one(a, if has_unit { "" } else { unit })
            };
            Ok([each(x)?, each(y)?, each(z)?])
        }
        [x, y, z, unit] => Ok([one(x, unit)?, one(y, unit)?, one(z, unit)?]),
        [x, a, y, b, z, c] => Ok([one(x, a)?, one(y, b)?, one(z, c)?]),
        _ => Err(JogCommandError::Coordinates {
            found: text.to_owned(),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_parsed() {
        let parsed = |line: &str| parse(line).unwrap();
        assert_eq!(parsed("x +1mm"), Some(JogCommand::By(0, 1.0)));
        assert_eq!(parsed("  z -0.5 mm # down"), Some(JogCommand::By(2, -0.5)));
        for line in [
            "to 0 -1 5 mm",
            "to 0mm -1mm 5mm",
            "to 0 mm -1 mm 5 mm",
            "to 0, -1, 5mm",
        ] {
            assert_eq!(
                parsed(line),
                Some(JogCommand::To([0.0, -1.0, 5.0])),
                "{line}"
            );
        }
        assert_eq!(parsed("speed 0.5 cm/s"), Some(JogCommand::Speed(5.0)));
        assert_eq!(parsed("touch"), Some(JogCommand::Touch(5.0)));
        assert_eq!(parsed("touch 12mm"), Some(JogCommand::Touch(12.0)));
        assert_eq!(
            parsed("point nw"),
            Some(JogCommand::Point("nw".into(), None))
        );
        let named = JogCommand::Point("nw".into(), Some([-30.0, 40.0, 0.0]));
        assert_eq!(parsed("point nw at -3 4 0 cm"), Some(named));
        assert_eq!((parsed(""), parsed("# nothing")), (None, None));
        for line in [
            "x",
            "x 1",
            "x 1 s",
            "to 1 2",
            "to 0 0 5",
            "speed 0 mm/s",
            "touch -1mm",
            "point",
            "point a b",
            "where now",
            "jump",
            "to nan nan nan mm",
            "speed -1 mm/s",
        ] {
            assert!(parse(line).is_err(), "{line}");
        }
    }
}
