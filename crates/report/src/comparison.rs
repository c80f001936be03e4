//! Owns the session's side of the comparison with published numbers.

use serde::Serialize;
use skinrig_analysis::result::{Analysis, Estimate, ReductionRow, Thinning};

use crate::published::{MSOWS, Metric};

/// Thinning factor of the published comparison.
pub(crate) const FACTOR: u32 = 1024;

/// Value of the session for one quantity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Cell {
    /// Not measured, or the study is missing.
    Missing,
    /// A qualitative value.
    Text(&'static str),
    /// A number in the unit of [`Metric::name`], with its interval.
    Value(Estimate),
}

/// One quantity of the session, without reduction and at `FACTOR`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Row {
    /// The quantity.
    pub metric: Metric,
    /// Value with all events.
    pub session: Cell,
    /// Value with one event in `FACTOR` kept at random, exact count, as in the public code (emulated).
    pub reduced: Cell,
    /// Lo Preti et al. 2022, as given in the paper.
    pub msows: &'static str,
    /// The paper without reduction.
    pub paper: &'static str,
    /// The paper at `FACTOR`.
    pub paper_reduced: &'static str,
    /// Marks of the footnotes (`crate::published::FOOTNOTES`).
    pub notes: &'static str,
}

/// Compares the session with the multitouch soft optical waveguide skin (the paper's table "MSOWS"), row by row.
#[must_use]
pub fn rows(analysis: &Analysis) -> Vec<Row> {
    let thinned = reduced_row(analysis);
    let cells = |metric| {
        if !analysis.is_valid() {
            return (Cell::Text("INVALID"), Cell::Missing);
        }
        (
            whole(analysis, metric),
            thinned.map_or(Cell::Missing, |row| reduced(analysis, &row, metric)),
        )
    };
    MSOWS
        .iter()
        .map(|p| {
            let (session, reduced) = cells(p.metric);
            Row {
                metric: p.metric,
                session,
                reduced,
                msows: p.msows,
                paper: p.paper,
                paper_reduced: p.paper_1024,
                notes: p.notes,
            }
        })
        .collect()
}

/// The study's row at [`FACTOR`] with exact-count thinning.
fn reduced_row(analysis: &Analysis) -> Option<ReductionRow> {
    let curves = &analysis.reduction.as_ref()?.curves;
    let curve = curves.iter().find(|c| c.thinning == Thinning::Exact)?;
    curve.rows.iter().find(|r| r.factor == FACTOR).copied()
}

/// A number without an interval.
const fn plain(value: Option<f64>, n: u32) -> Cell {
    match value {
        Some(_) => Cell::Value(Estimate {
            value,
            low: None,
            high: None,
            n,
        }),
        None => Cell::Missing,
    }
}

fn scaled(e: &Estimate, by: f64) -> Cell {
    let times = |v: Option<f64>| v.map(|v| v * by);
    match e.value {
        Some(_) => Cell::Value(Estimate {
            value: times(e.value),
            low: times(e.low),
            high: times(e.high),
            n: e.n,
        }),
        None => Cell::Missing,
    }
}

fn whole(a: &Analysis, metric: Metric) -> Cell {
    let rates = a.bit_rates.as_ref();
    let latency = a.latency.as_ref();
    let of = |e: Option<&Estimate>, by: f64| e.map_or(Cell::Missing, |e| scaled(e, by));
    match metric {
        Metric::Sensor => Cell::Text("2 event cameras"),
        Metric::ViewPoints => plain(Some(2.0), 0),
        Metric::Processing => Cell::Text("offline, on events"),
        Metric::Samples => {
            let first = a
                .reduction
                .as_ref()
                .and_then(|r| r.curves.first()?.rows.first());
            let first = first.filter(|r| r.factor == 1);
            plain(
                first.map(|r| r.events_per_view),
                first.map_or(0, |r| r.located_rate.n),
            )
        }
        Metric::Bits => plain(Some(a.settings.bits_per_event), 0),
        Metric::PressDuration => of(rates.map(|r| &r.press_s), 1.0),
        Metric::PressRate => of(rates.map(|r| &r.press_bytes_per_s), 1e-3),
        Metric::IdleRate => of(rates.map(|r| &r.idle_bytes_per_s), 1e-3),
        Metric::LatencyWidth => of(latency.map(|l| &l.width_ms), 1.0),
        Metric::LatencyFromContact => {
            let measured = latency.and_then(|l| l.from_contact.as_ref());
            of(measured.map(|c| &c.median_ms), 1.0)
        }
        Metric::GlobalError => of(a.cmre.as_ref().map(|c| &c.percent), 1.0),
        Metric::DiagonalError => scaled(&a.scored.rmse_mm, 100.0 / a.rig.outline.diagonal_mm()),
        Metric::Rmse => scaled(&a.scored.rmse_mm, 1.0),
        Metric::PassRate => {
            let first = a
                .reduction
                .as_ref()
                .and_then(|r| r.curves.first()?.rows.first());
            of(first.filter(|r| r.factor == 1).map(|r| &r.pass_rate), 100.0)
        }
        Metric::TaxelsSkin => of(a.coverage.as_ref().map(|c| &c.taxels_skin), 1.0),
        Metric::TaxelsProbed => of(a.coverage.as_ref().map(|c| &c.taxels_probed), 1.0),
    }
}

fn reduced(a: &Analysis, row: &ReductionRow, metric: Metric) -> Cell {
    let latency = a.latency.as_ref().and_then(|l| l.reduced.as_ref());
    let latency = latency.filter(|l| l.factor == FACTOR);
    // Circles with radius RMSE that fill the area, as without reduction: area / (pi RMSE²).
    let taxels = |area: Option<f64>| {
        let (Some(area), Some(rmse)) = (area, row.rmse_mm.value.filter(|r| *r > 0.0)) else {
            return Cell::Missing;
        };
        let of = |r: Option<f64>| {
            r.filter(|r| *r > 0.0)
                .map(|r| area / (std::f64::consts::PI * r * r))
        };
        Cell::Value(Estimate {
            value: of(Some(rmse)),
            low: of(row.rmse_mm.high),
            high: of(row.rmse_mm.low),
            n: row.rmse_mm.n,
        })
    };
    match metric {
        Metric::Sensor
        | Metric::ViewPoints
        | Metric::Processing
        | Metric::Bits
        | Metric::PressDuration => whole(a, metric),
        Metric::Samples => plain(Some(row.events_per_view), row.located_rate.n),
        Metric::PressRate => scaled(&row.press_bytes_per_s, 1e-3),
        Metric::IdleRate => scaled(&row.idle_bytes_per_s, 1e-3),
        Metric::LatencyWidth => latency.map_or(Cell::Missing, |l| scaled(&l.width_ms, 1.0)),
        Metric::LatencyFromContact | Metric::GlobalError => Cell::Missing,
        Metric::DiagonalError => {
            // Percent of the diagonal per millimetre, from the headline's own pair of values.
            let per_mm = a.scored.rmse_diagonal_percent.zip(a.scored.rmse_mm.value);
            match per_mm.filter(|(_, rmse)| *rmse > 0.0) {
                Some((percent, rmse)) => scaled(&row.rmse_mm, percent / rmse),
                None => Cell::Missing,
            }
        }
        Metric::Rmse => scaled(&row.rmse_mm, 1.0),
        Metric::PassRate => scaled(&row.pass_rate, 100.0),
        Metric::TaxelsSkin => taxels(a.coverage.as_ref().map(|c| c.skin_mm2)),
        Metric::TaxelsProbed => taxels(a.coverage.as_ref().and_then(|c| c.probed_mm2)),
    }
}
