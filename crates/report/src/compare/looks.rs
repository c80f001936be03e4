//! Owns the looks of a sequential comparison: their table, and the sentence that concludes.

use skinrig_compare::SequentialComparison;
use skinrig_statistics::{Interval, Outlook, Verdict};
use skinrig_text::Column as Cells;

use super::text;
use crate::document::{Column, Row, Table};
use crate::format::number;

/// Decided or not yet, in one sentence without a full stop.
pub(super) fn conclusion(of: &SequentialComparison, letter: char) -> String {
    if let Some((look, difference)) = of
        .decision()
        .and_then(|look| Some((look, look.difference_mm.as_ref()?)))
    {
        let size = number(Some(difference.value.abs()), 2);
        let word = match look.verdict {
            Some(Verdict::Better) => format!("{letter} better by {size} mm"),
            Some(Verdict::Worse) => format!("{letter} worse by {size} mm"),
            verdict => format!("{letter} {}", text::verdict(verdict)),
        };
        return format!(
            "decided after repetition {}: {word} {} (anytime valid)",
            look.repetitions,
            millimetres(difference)
        );
    }
    let [a, b] = of.complete;
    let next = match of.outlook {
        _ if of.looks.is_empty() => {
            format!(
                "a look needs a complete scored repetition of both, found {a} of A and {b} of {letter}"
            )
        }
        _ if let Some(why) = of.looks.last().and_then(|look| look.refused.as_ref()) => {
            format!("the last look allows no comparison: {why}")
        }
        Outlook::More { repetitions } => format!(
            "about {} expected if the measured difference is real",
            text::counted(repetitions as usize, "more repetition")
        ),
        Outlook::NotByRepetitions => {
            "repetitions at these locations will not decide; press more locations or record more sessions".to_owned()
        }
        Outlook::Spent => "all planned looks are used, which is the end".to_owned(),
        Outlook::Decided | Outlook::Unknown => {
            "the next repetition tells how much repetitions scatter".to_owned()
        }
    };
    format!("not yet: {next}")
}

/// One row per look.
pub(super) fn table(of: &SequentialComparison, letter: char) -> Table {
    let number_column =
        |name: &str, width| Column::new(format!("#{name}")).terminal(name, Cells::right(width));
    let columns = [
        Column::new("Looks").terminal("looks at the RMSE", Cells::left(26)),
        number_column("presses", 11),
        number_column("level (%)", 11),
        number_column("spent (%)", 11),
        Column::new(format!("{letter} − A (mm)"))
            .terminal(format!("{letter} - A (mm)"), Cells::left(0).after(2)),
    ];
    let rows = of.looks.iter().map(|look| {
        let difference = match &look.difference_mm {
            Some(difference) => format!(
                "{} {}",
                number(Some(difference.value), 2),
                millimetres(difference)
            ),
            None => text::verdict(None).to_owned(),
        };
        Row::new([
            format!("repetition {}", look.repetitions),
            format!("{} + {}", look.presses[0], look.presses[1]),
            number((look.alpha > 0.0).then_some(100.0 * (1.0 - look.alpha)), 2),
            number(Some(100.0 * look.spent), 2),
            difference,
        ])
    });
    Table::of("looks", "Looks", columns).gap(0).with(rows)
}

fn millimetres(of: &Interval) -> String {
    let end =
        |v: Option<f64>, open: &str| v.map_or_else(|| open.to_owned(), |v| number(Some(v), 2));
    format!("[{}, {}]", end(of.low, "-∞"), end(of.high, "∞"))
}
