//! Mean column of the largest cluster, or of all clusters.

use skinrig_model::{AnalysisSettings, CentroidRule};

use super::{ColumnEstimate, column_px};
use crate::dbscan::{Cluster, Dbscan};
use crate::grid::PixelGrid;
use crate::press_events::PackedEvent;

/// DBSCAN on bins of pixels. The radius is converted from the settings to bins; the core threshold counts events, which does
/// not depend on the bin size. A radius below one bin joins only events of the same bin.
#[derive(Debug, Clone)]
pub struct Clusters {
    side_px: u16,
    shift: u32,
    rule: CentroidRule,
    grid: PixelGrid,
    dbscan: Dbscan,
}

impl Clusters {
    /// For the cropped rows `rows.0..=rows.1` of a camera.
    #[must_use]
    pub fn new(settings: &AnalysisSettings, rows: (u16, u16)) -> Self {
        let side = settings.bin_px.max(1);
        Self {
            side_px: side,
            shift: side.trailing_zeros(),
            rule: settings.centroid,
            grid: PixelGrid::new((rows.0 / side, rows.1 / side)),
            dbscan: Dbscan::new(settings.eps_px / f64::from(side), settings.min_samples),
        }
    }

    /// See `super::PressEstimator::estimate`.
    pub fn estimate(&mut self, events: &[PackedEvent], core_threshold: u32) -> ColumnEstimate {
        for event in events {
            self.grid
                .add(event.x() >> self.shift, event.y() >> self.shift);
        }
        self.dbscan.set_min_samples(core_threshold);
        self.dbscan.run(&self.grid);
        self.grid.clear();
        ColumnEstimate::of_clusters(&self.dbscan, self.rule, self.side_px)
    }
}

impl ColumnEstimate {
    /// Result of the last run, on bins of side `side_px`.
    #[must_use]
    pub(crate) fn of_clusters(dbscan: &Dbscan, rule: CentroidRule, side_px: u16) -> Self {
        let chosen = match rule {
            CentroidRule::LargestCluster => dbscan.largest().map(|(_, c)| c),
            CentroidRule::AllClusters => dbscan.clusters().iter().copied().reduce(Cluster::merged),
        };
        let centroid = chosen.and_then(|c| c.centroid());
        let px = |bins: f64| bins * f64::from(side_px);
        Self {
            column: centroid.map(|(u, _)| column_px(u, side_px)),
            row: centroid.map(|(_, v)| column_px(v, side_px)),
            clusters: dbscan.clusters().len() as u32,
            // The grid holds at most u32::MAX events.
            events: chosen.map_or(0, |c| c.events) as u32,
            spread_u: chosen.and_then(|c| c.spread_u()).map(px),
            spread_v: chosen.and_then(|c| c.spread_v()).map(px),
        }
    }
}
