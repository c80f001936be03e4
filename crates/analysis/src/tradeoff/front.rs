//! Pareto fronts.

use super::rows::{Cost, Tradeoff};

/// For points (error, cost), true if no other point dominates: none is as good in both and better in one. `None` does not
/// compete.
#[must_use]
pub(crate) fn pareto(points: &[Option<(f64, f64)>]) -> Vec<bool> {
    let mut order: Vec<(usize, f64, f64)> = points
        .iter()
        .enumerate()
        .filter_map(|(i, p)| p.map(|(error, cost)| (i, error, cost)))
        .collect();
    order.sort_by(|a, b| a.2.total_cmp(&b.2).then(a.1.total_cmp(&b.1)));
    let mut out = vec![false; points.len()];
    let mut best: Option<(f64, f64)> = None;
    for (i, error, cost) in order {
        // Equal to the last one on the front in both: neither dominates the other.
        if best.is_none_or(|(e, c)| error < e || (error == e && cost == c)) {
            out[i] = true;
            best = Some((error, cost));
        }
    }
    out
}

/// Marks competing rows and rows on each front.
pub(super) fn mark_fronts(result: &mut Tradeoff) {
    for row in &mut result.rows {
        let located = row.located_rate.value.unwrap_or(0.0);
        row.competes = row.rmse_mm.value.is_some() && located >= result.least_located;
    }
    for cost in Cost::ALL {
        let points: Vec<Option<(f64, f64)>> = result
            .rows
            .iter()
            .map(|r| {
                r.rmse_mm
                    .value
                    .filter(|_| r.competes)
                    .map(|e| (e, cost.of(r)))
            })
            .collect();
        for (row, on) in result.rows.iter_mut().zip(pareto(&points)) {
            if on {
                row.fronts.push(cost);
            }
        }
    }
}
