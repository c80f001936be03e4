//! Owns the errors of an estimated quantity: over all presses and by planned depth, with intervals over locations.

use skinrig_model::AnalysisSettings;

use crate::metrics::{mean_over_locations, rms_over_locations, share_over_locations};
use crate::result::{Estimate, Quantity, QuantityAtDepth, QuantityErrors, Ranged};

/// A press with estimate and measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Row {
    pub location: u32,
    /// Planned depth, mm.
    pub depth_mm: f64,
    pub estimate: Ranged,
    pub measured: f64,
}

/// What the calibration presses taught.
#[derive(Debug, Clone, Copy)]
pub(super) struct Taught {
    /// Their number.
    pub by: u32,
    /// Smallest and largest measurement.
    pub from_to: [f64; 2],
}

/// Errors at scored presses and at left-out locations. Scored presses beyond what was taught have none; of the others, those at
/// `unreached` depths have none by depth.
pub(super) fn quantity(
    scored: &[Row],
    left_out: &[Row],
    unreached: &[f64],
    taught: Taught,
    settings: &AnalysisSettings,
) -> Quantity {
    let all = scored.len();
    let scored = scored.iter().copied();
    let scored: Vec<Row> = scored
        .filter(|r| Quantity::teaches(taught.from_to, r.measured))
        .collect();
    let scored = scored.as_slice();
    let mut depths: Vec<f64> = scored.iter().chain(left_out).map(|r| r.depth_mm).collect();
    depths.sort_by(f64::total_cmp);
    depths.dedup();
    let at = |rows: &[Row], depth_mm: f64| {
        let own: Vec<Row> = rows
            .iter()
            .filter(|r| r.depth_mm == depth_mm)
            .copied()
            .collect();
        errors(&own, settings)
    };
    let reached = |depth_mm: f64| match unreached.contains(&depth_mm) {
        true => &[],
        false => scored,
    };
    let each = depths.into_iter().map(|depth_mm| QuantityAtDepth {
        depth_mm,
        scored: at(reached(depth_mm), depth_mm),
        left_out: at(left_out, depth_mm),
    });
    Quantity {
        scored: errors(scored, settings),
        left_out: errors(left_out, settings),
        depths: each.collect(),
        taught_by: taught.by,
        taught: taught.from_to,
        beyond: (all - scored.len()) as u32,
    }
}

fn errors(rows: &[Row], settings: &AnalysisSettings) -> QuantityErrors {
    let numbers = |of: &dyn Fn(&Row) -> f64, estimate: fn(&[(u32, f64)], u32, u64) -> Estimate| {
        let values: Vec<(u32, f64)> = rows.iter().map(|r| (r.location, of(r))).collect();
        estimate(&values, settings.bootstrap_resamples, settings.seed)
    };
    let error = |r: &Row| r.estimate.value - r.measured;
    let each = rows.iter();
    let inside: Vec<(u32, bool)> = each
        .filter_map(|r| {
            let [low, high] = r.estimate.interval?;
            Some((r.location, low <= r.measured && r.measured <= high))
        })
        .collect();
    QuantityErrors {
        rmse: numbers(&error, rms_over_locations),
        bias: numbers(&error, mean_over_locations),
        relative_percent: numbers(&|r| 100.0 * error(r) / r.measured, rms_over_locations),
        covered: share_over_locations(&inside, settings.bootstrap_resamples, settings.seed),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_depth_that_was_not_reached_has_no_errors_of_its_own() {
        let row = |location, depth_mm: f64| Row {
            location,
            depth_mm,
            estimate: Ranged {
                value: 0.5,
                interval: None,
            },
            measured: 0.4,
        };
        let rows: Vec<Row> = (0..8).flat_map(|k| [row(k, 1.0), row(k, 2.0)]).collect();
        let taught = Taught {
            by: 8,
            from_to: [0.4, 2.0],
        };
        let found = quantity(&rows, &rows, &[2.0], taught, &AnalysisSettings::default());
        let n = |q: &QuantityErrors| q.rmse.n;
        let by_depth: Vec<_> = found
            .depths
            .iter()
            .map(|d| (n(&d.scored), n(&d.left_out)))
            .collect();
        assert_eq!(by_depth, [(8, 8), (0, 8)]);
        assert_eq!((n(&found.scored), found.beyond), (16, 0));
        // Measured at 0.4 mm, within a tenth of 0.44 and not of 0.45.
        for (least, n_scored) in [(0.44, 16), (0.45, 0)] {
            let taught = Taught {
                from_to: [least, 2.0],
                ..taught
            };
            let found = quantity(&rows, &rows, &[], taught, &AnalysisSettings::default());
            let of = (n(&found.scored), found.beyond, n(&found.left_out));
            assert_eq!(of, (n_scored, 16 - n_scored, 16));
        }
    }
}
