//! A small harness: times related pieces of work and prints them as one table.
//!
//! A number alone describes the machine rather than the code. So every table contains a baseline from the same run, and each
//! row states how it was measured. The rounds of all rows are interleaved, so that a slow moment of the machine affects all
//! of them, and every second round runs backwards, so that no row always follows the same neighbour; the best round counts.
//!
//! [`recording`] creates the data, [`files`] and [`session`] store it, [`python`] runs the Python programs, [`memory`]
//! reads the peak.

pub mod files;
pub mod memory;
pub mod python;
pub mod recording;
pub mod session;

use std::fmt::Write as _;
use std::time::Instant;

/// A row to measure.
struct Row<'a> {
    what: String,
    work: Box<dyn FnMut() -> f64 + 'a>,
    units: f64,
    is_baseline: bool,
    /// The other rows are compared with this one.
    is_ours: bool,
    /// Seconds of each round, without the warm-up.
    seconds: Vec<f64>,
}

impl Row<'_> {
    fn best_s(&self) -> f64 {
        self.seconds.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// Factor by which this took longer than `other`: the median over the rounds.
    fn times(&self, other: &Self) -> f64 {
        let rounds = self.seconds.iter().zip(&other.seconds);
        let mut ratios: Vec<f64> = rounds.map(|(a, b)| a / b).collect();
        ratios.sort_by(f64::total_cmp);
        let middle = ratios.len() / 2;
        match ratios.len() {
            0 => f64::NAN,
            n if n % 2 == 1 => ratios[middle],
            _ => f64::midpoint(ratios[middle - 1], ratios[middle]),
        }
    }
}

/// A table of alternative implementations of the same work.
pub struct Table<'a> {
    title: String,
    unit: &'static str,
    method: String,
    rows: Vec<Row<'a>>,
}

impl<'a> Table<'a> {
    /// An empty table. `unit` names what is counted per second ("Mev"), `method` describes the measurement.
    #[must_use]
    pub fn new(title: &str, unit: &'static str, method: &str) -> Self {
        Self {
            title: title.into(),
            unit,
            method: method.into(),
            rows: Vec::new(),
        }
    }

    /// Adds a row whose `work` processes `units` (in the table's unit) per call.
    pub fn row(&mut self, what: &str, units: f64, work: impl FnMut() + 'a) -> &mut Self {
        self.push(what, units, false, timed(work))
    }

    /// Adds the row that all others are compared with: for each of them the table states the factor by which it took longer,
    /// as a median over the rounds.
    pub fn ours(&mut self, what: &str, units: f64, work: impl FnMut() + 'a) -> &mut Self {
        self.push(what, units, false, timed(work));
        if let Some(row) = self.rows.last_mut() {
            row.is_ours = true;
        }
        self
    }

    /// Adds a row whose `work` returns its own duration in seconds: of another process, or a known value.
    pub fn row_timed(
        &mut self,
        what: &str,
        units: f64,
        work: impl FnMut() -> f64 + 'a,
    ) -> &mut Self {
        self.push(what, units, false, work)
    }

    /// Adds the baseline of the ratios.
    pub fn baseline(&mut self, what: &str, units: f64, work: impl FnMut() + 'a) -> &mut Self {
        self.push(what, units, true, timed(work))
    }

    /// Adds the baseline of the ratios, whose `work` returns its own duration in seconds.
    pub fn baseline_timed(
        &mut self,
        what: &str,
        units: f64,
        work: impl FnMut() -> f64 + 'a,
    ) -> &mut Self {
        self.push(what, units, true, work)
    }

    fn push(
        &mut self,
        what: &str,
        units: f64,
        is_baseline: bool,
        work: impl FnMut() -> f64 + 'a,
    ) -> &mut Self {
        self.rows.push(Row {
            what: what.into(),
            work: Box::new(work),
            units,
            is_baseline,
            is_ours: false,
            seconds: Vec::new(),
        });
        self
    }

    /// Runs every row once to warm up and then `rounds` times, and returns the table as text.
    #[must_use]
    pub fn run(mut self, rounds: u32) -> String {
        for round in 0..=rounds {
            let mut measure = |row: &mut Row<'_>| {
                let taken_s = (row.work)();
                if round > 0 {
                    row.seconds.push(taken_s);
                }
            };
            if round % 2 == 0 {
                self.rows.iter_mut().for_each(&mut measure);
            } else {
                self.rows.iter_mut().rev().for_each(&mut measure);
            }
        }
        let rate = |row: &Row<'_>| row.units / row.best_s();
        let baseline = self.rows.iter().find(|r| r.is_baseline).map(rate);
        let ours = self.rows.iter().find(|r| r.is_ours);
        let width = self.rows.iter().map(|r| r.what.chars().count()).max();
        let width = width.unwrap_or(0).max(4);
        let mut text = format!("\n{}\n", self.title);
        for row in &self.rows {
            let ratio = match baseline {
                Some(_) if row.is_baseline => "baseline".into(),
                Some(base) => format!("{:.2} x", rate(row) / base),
                None => String::new(),
            };
            let beside = match ours {
                Some(ours) if !row.is_ours => {
                    format!("  {} is {:.1} times faster", ours.what, row.times(ours))
                }
                _ => String::new(),
            };
            let _ = writeln!(
                text,
                "  {:width$}  {:>10.1} {}/s  {:>9.4} s  {ratio:>10}{beside}",
                row.what,
                rate(row),
                self.unit,
                row.best_s(),
            );
        }
        let faster = if ours.is_some() {
            ", times faster: median of the rounds"
        } else {
            ""
        };
        let _ = writeln!(text, "  method: {}; best of {rounds}{faster}", self.method);
        text
    }
}

fn timed(mut work: impl FnMut()) -> impl FnMut() -> f64 {
    move || {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_names_every_row_and_its_ratio() {
        let mut calls = 0;
        let mut table = Table::new("sums", "Mop", "adds numbers");
        table.baseline("slow", 1.0, || calls += 1);
        table.row("fast", 2.0, || {
            std::hint::black_box(1 + 1);
        });
        let text = table.run(3);
        assert_eq!(calls, 4, "one warm-up and three rounds");
        for part in [
            "sums",
            "slow",
            "baseline",
            "fast",
            " x",
            "Mop/s",
            "adds numbers; best of 3",
        ] {
            assert!(text.contains(part), "{part} in {text}");
        }
    }

    #[test]
    fn ratios_to_ours_are_computed_round_by_round() {
        let mut table = Table::new("race", "op", "timed");
        // The first round is the warm-up.
        let mut durations = [9.0, 1.0, 8.0, 3.0].into_iter();
        table.row_timed("theirs", 1.0, move || durations.next().unwrap());
        table.ours("ours", 1.0, || ());
        table.rows[1].work = Box::new(|| 0.5);
        let text = table.run(3);
        assert!(text.contains("ours is 6.0 times faster"), "{text}");
        assert!(text.contains("1.0000 s"), "the best round: {text}");
    }

    #[test]
    fn a_returned_duration_is_used_unchanged() {
        let mut table = Table::new("timed", "op", "timed");
        table.baseline_timed("a known thing", 10.0, || 2.0);
        let text = table.run(2);
        assert!(
            text.contains("5.0 op/s") && text.contains("2.0000 s"),
            "{text}"
        );
    }
}
