//! Owns the table of the data-reduction study.

use skinrig_analysis::result::{Analysis, Estimate, Thinning};

use crate::document::Table;
use crate::format::{NONE, grouped, interval, number};

/// Display name of a kind of thinning.
pub(crate) const fn thinning(kind: Thinning) -> &'static str {
    match kind {
        Thinning::Exact => "exact count",
        Thinning::Bernoulli => "Bernoulli",
    }
}

/// One row per kind and factor.
pub(super) fn reduction(a: &Analysis) -> Option<Table> {
    let study = a.reduction.as_ref()?;
    let within = format!("#within {} mm (%)", number(Some(study.within_mm), 1));
    let mut grid = Table::new(
        "reduction-table",
        "Data reduction, row by row",
        &[
            "Thinning",
            "#k",
            "#events",
            "#RMSE (mm)",
            "#single seeds (mm)",
            "#pass (%)",
            &within,
            "#located (%)",
            "#press (kB/s)",
            "#idle (kB/s)",
        ],
    );
    let with = |e: &Estimate, scale: f64, digits| {
        if e.value.is_none() {
            return NONE.to_owned();
        }
        format!(
            "{} {}",
            number(e.value.map(|v| v * scale), digits),
            interval(e, scale, digits)
        )
    };
    for curve in &study.curves {
        for row in &curve.rows {
            let kilo = |bytes: &Estimate| {
                let large = bytes.value.is_some_and(|b| b >= 1e4);
                with(bytes, 1e-3, if large { 1 } else { 3 })
            };
            let seeds = row.rmse_of_seeds_mm.map_or_else(
                || NONE.to_owned(),
                |(low, high)| format!("{} to {}", number(Some(low), 2), number(Some(high), 2)),
            );
            grid.marked_row(
                [
                    thinning(curve.thinning).to_owned(),
                    grouped(u64::from(row.factor)),
                    number(
                        Some(row.events_per_view),
                        if row.events_per_view < 100.0 { 1 } else { 0 },
                    ),
                    with(&row.rmse_mm, 1.0, 2),
                    seeds,
                    with(&row.pass_rate, 100.0, 1),
                    with(&row.within_rate, 100.0, 1),
                    with(&row.located_rate, 100.0, 1),
                    kilo(&row.press_bytes_per_s),
                    kilo(&row.idle_bytes_per_s),
                ],
                row.factor == crate::comparison::FACTOR,
            );
        }
    }
    grid.note(format!(
        "n = {} presses, {} seeds. Brackets: 95 % intervals over locations, exact where a \
         share is 0 or 100 %. Events are per press and camera. Highlighted: the published factor.",
        study.presses, study.seeds
    ));
    grid.download("reduction");
    Some(grid)
}
