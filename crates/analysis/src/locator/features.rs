//! Features of a press in both cameras: the only input of a locator.

use crate::estimators::ColumnEstimate;
use crate::result::{PressResult, PressView};

/// Features of a press in one camera.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CameraFeatures {
    /// Centroid column, px; `None` without a cluster.
    pub column: Option<f64>,
    /// Standard deviations of the columns and rows of the clustered events, px.
    pub spread: Option<[f64; 2]>,
    /// Clustered events.
    pub cluster_events: u32,
}

impl From<&PressView> for CameraFeatures {
    fn from(view: &PressView) -> Self {
        Self {
            column: view.centroid_u,
            spread: spread(view.spread_u, view.spread_v),
            cluster_events: view.cluster_events,
        }
    }
}

impl From<&ColumnEstimate> for CameraFeatures {
    fn from(estimate: &ColumnEstimate) -> Self {
        Self {
            column: estimate.column,
            spread: spread(estimate.spread_u, estimate.spread_v),
            cluster_events: estimate.events,
        }
    }
}

/// Both spreads; `None` unless both are positive: the events lie on one column or row.
fn spread(u: Option<f64>, v: Option<f64>) -> Option<[f64; 2]> {
    let both = [u?, v?];
    let usable = both.iter().all(|s| s.is_finite() && *s > 0.0);
    usable.then_some(both)
}

impl CameraFeatures {
    /// Of both cameras in a press.
    #[must_use]
    pub fn of_press(press: &PressResult) -> [Self; 2] {
        let view = |k: usize| press.views[k].as_ref();
        [0, 1].map(|k| view(k).map_or_else(Self::default, Self::from))
    }
}

/// Features of a press in both cameras. They hold no position: a locator cannot see where the press was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Features {
    /// Centroid column in each camera, px.
    pub columns: [f64; 2],
    /// Standard deviations of the columns and rows of the clustered events in each camera, px.
    pub spreads: [Option<[f64; 2]>; 2],
    /// Clustered events in the weaker camera.
    pub cluster_events: u32,
}

impl Features {
    /// `None` unless both cameras see the press.
    #[must_use]
    pub fn new([one, two]: [CameraFeatures; 2]) -> Option<Self> {
        Some(Self {
            columns: [one.column?, two.column?],
            spreads: [one.spread, two.spread],
            cluster_events: one.cluster_events.min(two.cluster_events),
        })
    }

    /// Of a press; `None` unless both cameras see it.
    #[must_use]
    pub fn of_press(press: &PressResult) -> Option<Self> {
        Self::new(CameraFeatures::of_press(press))
    }
}
