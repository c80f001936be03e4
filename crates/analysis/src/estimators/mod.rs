//! Estimators that turn the events of one press in one camera into a column: clusters, median, histogram peak, running
//! histogram.
//!
//! All of them process the events of the window in time order and give the same result for the same events on every machine.
//! They see square bins of pixels: bin `b` of side `s` px is at column `s b + (s - 1) / 2`.

mod clusters;
mod columns;
mod peak;
mod real;
mod streaming;
mod thinning;

pub use clusters::Clusters;
pub(crate) use columns::ColumnCounts;
pub use columns::Median;
pub(crate) use peak::Peak;
pub use real::Real;
pub use streaming::StreamingEstimator;
pub use thinning::Thinning;

use skinrig_model::{AnalysisSettings, Estimator, Precision};

use crate::press_events::PackedEvent;

/// Result of an estimator.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ColumnEstimate {
    /// Column, px; `None` if the estimator found nothing.
    pub column: Option<f64>,
    /// Row, px, for estimators that use rows.
    pub row: Option<f64>,
    /// Clusters found; without clustering, 1 if there is a column.
    pub clusters: u32,
    /// Events behind the column; for a running histogram its weight in events.
    pub events: u32,
    /// Standard deviation of their columns, px, for estimators that cluster.
    pub spread_u: Option<f64>,
    /// The same of their rows, px.
    pub spread_v: Option<f64>,
}

impl ColumnEstimate {
    const fn at(column: f64, events: u32) -> Self {
        Self {
            column: Some(column),
            row: None,
            clusters: 1,
            events,
            spread_u: None,
            spread_v: None,
        }
    }
}

/// The estimator of the settings, with reusable buffers.
#[derive(Debug, Clone)]
pub struct PressEstimator(Kind);

#[derive(Debug, Clone)]
enum Kind {
    Clusters(Box<Clusters>),
    Median(Box<Median>),
    Peak64(Box<Peak<f64>>),
    Peak32(Box<Peak<f32>>),
    Streaming64(Box<StreamingEstimator<f64>>),
    Streaming32(Box<StreamingEstimator<f32>>),
}

impl PressEstimator {
    /// Estimator for these settings and a camera with the cropped rows `rows.0..=rows.1`. The settings are validated.
    #[must_use]
    pub fn new(settings: &AnalysisSettings, rows: (u16, u16)) -> Self {
        let (side, eps) = (settings.bin_px, settings.eps_px);
        let wide = settings.precision == Precision::F64;
        Self(match settings.estimator {
            Estimator::Dbscan => Kind::Clusters(Box::new(Clusters::new(settings, rows))),
            Estimator::ColumnMedian => Kind::Median(Box::new(Median::new(side))),
            Estimator::HistogramPeak if wide => Kind::Peak64(Box::new(Peak::new(side, eps))),
            Estimator::HistogramPeak => Kind::Peak32(Box::new(Peak::new(side, eps))),
            Estimator::Streaming if wide => {
                Kind::Streaming64(Box::new(StreamingEstimator::new(side, settings.forget_ms)))
            }
            Estimator::Streaming => {
                Kind::Streaming32(Box::new(StreamingEstimator::new(side, settings.forget_ms)))
            }
        })
    }

    /// Estimates the column of a window that begins at `from_us`, from its events in time order. Estimators that cluster use the
    /// core threshold of this window.
    pub fn estimate(
        &mut self,
        events: &[PackedEvent],
        from_us: u32,
        core_threshold: u32,
    ) -> ColumnEstimate {
        match &mut self.0 {
            Kind::Clusters(e) => e.estimate(events, core_threshold),
            Kind::Median(e) => e.estimate(events),
            Kind::Peak64(e) => e.estimate(events),
            Kind::Peak32(e) => e.estimate(events),
            Kind::Streaming64(e) => e.estimate(events, from_us),
            Kind::Streaming32(e) => e.estimate(events, from_us),
        }
    }
}

/// Column of a position among bins of this side, px.
fn column_px(bin: f64, side_px: u16) -> f64 {
    let side = f64::from(side_px);
    side * bin + (side - 1.0) / 2.0
}

#[cfg(test)]
mod tests;
