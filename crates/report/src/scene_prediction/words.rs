//! The figures in words: name, unit, digits, and what a higher or lower value means.

use skinrig_compare::scene::SessionFigure;

use crate::format::number;

/// A figure in words.
pub(crate) struct Words {
    pub(crate) name: &'static str,
    unit: &'static str,
    /// Factor from the figure's unit to that of the text, and digits after the point.
    scale: f64,
    digits: usize,
    /// What a value above the prediction means, before "than modelled".
    pub(crate) higher: &'static str,
    pub(crate) lower: &'static str,
}

impl Words {
    pub(crate) fn value(&self, x: Option<f64>) -> String {
        number(x.map(|x| x * self.scale), self.digits)
    }

    /// The unit after a value.
    pub(crate) fn unit(&self) -> String {
        match self.unit {
            "" => String::new(),
            unit => format!(" {unit}"),
        }
    }

    pub(crate) fn unit_in_parentheses(&self) -> String {
        match self.unit {
            "" => String::new(),
            unit => format!(" ({unit})"),
        }
    }
}

const fn words(
    name: &'static str,
    (unit, scale, digits): (&'static str, f64, usize),
    (higher, lower): (&'static str, &'static str),
) -> Words {
    Words {
        name,
        unit,
        scale,
        digits,
        higher,
        lower,
    }
}

const RATE: (&str, f64, usize) = ("kev/s", 1e-3, 2);
const PERCENT: (&str, f64, usize) = ("%", 100.0, 1);
const MM: (&str, f64, usize) = ("mm", 1.0, 3);
const FACTOR: (&str, f64, usize) = ("", 1.0, 2);

pub(crate) const fn of(figure: SessionFigure) -> Words {
    use SessionFigure as F;
    match figure {
        F::PressRate => words(
            "events of a press",
            RATE,
            ("more events at presses", "fewer events at presses"),
        ),
        F::PressSpread => words(
            "spread between presses",
            FACTOR,
            ("presses differ more", "presses differ less"),
        ),
        F::IdleRate => words(
            "events between presses",
            RATE,
            (
                "more events between presses",
                "fewer events between presses",
            ),
        ),
        F::OnAtPress => words(
            "ON in the 200 ms from a contact",
            PERCENT,
            ("more ON events at contacts", "fewer ON events at contacts"),
        ),
        F::OnAtLift => words(
            "ON in the 200 ms from a lift",
            PERCENT,
            ("more ON events at lifts", "fewer ON events at lifts"),
        ),
        F::Rise => words(
            "half of the peak rate after a contact",
            ("ms", 1.0, 1),
            ("responds later", "responds sooner"),
        ),
        F::Fading => words(
            "rate left 0.2 s after a lift",
            PERCENT,
            ("relaxes faster or more", "relaxes slower or less"),
        ),
        F::Width => words(
            "width of a touch",
            ("px", 1.0, 1),
            ("touches look wider", "touches look narrower"),
        ),
        F::Dispersion => words(
            "variance / mean of counts in 10 ms",
            ("", 1.0, 1),
            (
                "events come in stronger bursts",
                "events come in weaker bursts",
            ),
        ),
        F::Neighbours => words(
            "events 8 px away, times chance",
            ("", 1.0, 1),
            (
                "neighbouring pixels respond together more",
                "neighbouring pixels respond together less",
            ),
        ),
        F::ActivePixels => words(
            "pixels with events",
            PERCENT,
            ("more pixels send events", "fewer pixels send events"),
        ),
        F::BusiestPixels => words(
            "events of the busiest 1 % of pixels",
            PERCENT,
            (
                "few pixels send more of the events",
                "few pixels send less of the events",
            ),
        ),
        F::EqualTimes => words(
            "timestamp of the event before",
            PERCENT,
            (
                "more events share a timestamp",
                "fewer events share a timestamp",
            ),
        ),
        F::Located => words(
            "presses located",
            PERCENT,
            ("more presses are located", "fewer presses are located"),
        ),
        F::Rmse => words("RMSE", MM, ("errors are larger", "errors are smaller")),
        F::RepeatStd => words(
            "std between repetitions",
            MM,
            ("repetitions differ more", "repetitions differ less"),
        ),
    }
}
