//! Owns the options that trade speed for accuracy, and the combinations to try.

use serde::{Deserialize, Serialize};
use skinrig_model::{
    AnalysisSettings, CalibrationModel, CentroidRule, Estimator, Locator, Precision,
};

/// Thinning factors.
const FACTORS: [u32; 11] = [1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024];
/// Sides of bins, px.
const SIDES_PX: [u16; 5] = [1, 2, 4, 8, 16];
/// Ends of the window after contact, ms.
const WINDOWS_MS: [f64; 5] = [10.0, 20.0, 50.0, 100.0, 200.0];
/// Longer than any window: the contact does not end it.
pub(crate) const WHOLE_PRESS_MS: f64 = 60_000.0;

/// Length of a press in distances between windows, ms.
pub(super) const LONG_MS: f64 = 500.0;
/// Parts of the rows.
const REGIONS: [Region; 3] = [Region::Full, Region::Half, Region::Quarter];

/// Part of the cropped rows to read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Region {
    /// The rows of the session's settings.
    Full,
    /// The half with the calibration presses.
    Half,
    /// The quarter with the calibration presses.
    Quarter,
}

/// One way to locate a press.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Choice {
    /// Estimator.
    pub estimator: Estimator,
    /// Clusters behind the centroid; irrelevant without clustering.
    pub centroid: CentroidRule,
    /// Number width; irrelevant for estimators with integers.
    pub precision: Precision,
    /// One event in this many is used.
    pub thinning: u32,
    /// Side of a bin, px.
    pub bin_px: u16,
    /// End of the window after contact, ms; `None`: with the press.
    pub window_ms: Option<f64>,
    /// Rows to read.
    pub region: Region,
}

/// Distinct variants of the estimators: (estimator, clusters, precision).
const ESTIMATORS: [(Estimator, CentroidRule, Precision); 7] = {
    use {CentroidRule as C, Estimator as E, Precision as P};
    [
        (E::Dbscan, C::LargestCluster, P::F64),
        (E::Dbscan, C::AllClusters, P::F64),
        (E::ColumnMedian, C::LargestCluster, P::F64),
        (E::HistogramPeak, C::LargestCluster, P::F64),
        (E::HistogramPeak, C::LargestCluster, P::F32),
        (E::Streaming, C::LargestCluster, P::F64),
        (E::Streaming, C::LargestCluster, P::F32),
    ]
};

impl Choice {
    /// The choice in the session's settings.
    #[must_use]
    pub fn of(settings: &AnalysisSettings) -> Self {
        let window = settings.window_after_contact_ms;
        Self {
            estimator: settings.estimator,
            centroid: settings.centroid,
            precision: settings.precision,
            thinning: settings.thinning,
            bin_px: settings.bin_px,
            window_ms: window.filter(|ms| *ms < WHOLE_PRESS_MS),
            region: Region::Full,
        }
        .plain()
    }

    const fn with_estimator(self, how: (Estimator, CentroidRule, Precision)) -> Self {
        Self {
            estimator: how.0,
            centroid: how.1,
            precision: how.2,
            ..self
        }
    }

    /// Sets irrelevant options to their defaults, so that equal choices compare equal.
    fn plain(self) -> Self {
        let clusters = self.estimator == Estimator::Dbscan;
        let whole = clusters || self.estimator == Estimator::ColumnMedian;
        Self {
            centroid: if clusters {
                self.centroid
            } else {
                CentroidRule::LargestCluster
            },
            precision: if whole {
                Precision::F64
            } else {
                self.precision
            },
            ..self
        }
    }

    /// Settings of this choice: those of the session except for the traded options. `rows` are the rows of the region; the
    /// calibration is one named model, and the locator one named locator, for all choices.
    #[must_use]
    pub fn settings(
        &self,
        session: &AnalysisSettings,
        rows: [(u16, u16); 2],
        model: CalibrationModel,
        locator: Locator,
    ) -> AnalysisSettings {
        AnalysisSettings {
            estimator: self.estimator,
            centroid: self.centroid,
            precision: self.precision,
            thinning: self.thinning,
            bin_px: self.bin_px,
            window_after_contact_ms: match (self.window_ms, session.window_after_contact_ms) {
                // An override can only shorten what a session already truncates.
                (None, Some(_)) => Some(WHOLE_PRESS_MS),
                (own, _) => own,
            },
            crop_v: rows,
            calibration: model,
            locator,
            ..session.clone()
        }
    }
}

/// Every combination, the session's own choice first.
#[must_use]
pub(super) fn all(session: Choice) -> Vec<Choice> {
    let mut all = vec![session];
    for how in ESTIMATORS {
        for thinning in FACTORS {
            for bin_px in SIDES_PX {
                for window_ms in windows() {
                    all.extend(REGIONS.map(|region| Choice {
                        thinning,
                        bin_px,
                        window_ms,
                        region,
                        ..session.with_estimator(how)
                    }));
                }
            }
        }
    }
    distinct(all)
}

/// Single changes of the session's choice, then a few of every other estimator: the curves of which combinations are composed.
#[must_use]
pub(super) fn curves(session: Choice) -> Vec<Choice> {
    let mut all = vec![session];
    all.extend(ESTIMATORS.map(|how| session.with_estimator(how)));
    all.extend(FACTORS.map(|thinning| Choice {
        thinning,
        ..session
    }));
    all.extend(SIDES_PX.map(|bin_px| Choice { bin_px, ..session }));
    all.extend(windows().map(|window_ms| Choice {
        window_ms,
        ..session
    }));
    all.extend(REGIONS.map(|region| Choice { region, ..session }));
    for how in ESTIMATORS.into_iter().filter(|how| how.2 == Precision::F64) {
        let base = session.with_estimator(how);
        all.extend([4, 16, 64, 256].map(|thinning| Choice { thinning, ..base }));
        all.extend([20.0, 100.0].map(|ms| Choice {
            window_ms: Some(ms),
            ..base
        }));
        all.push(Choice { bin_px: 8, ..base });
        all.push(Choice {
            region: Region::Quarter,
            ..base
        });
    }
    distinct(all)
}

/// Every bin with every part of the rows, otherwise as `about`: the front of pixels.
#[must_use]
pub(super) fn grids(about: Choice) -> Vec<Choice> {
    let grid = |bin_px| {
        REGIONS.map(|region| Choice {
            bin_px,
            region,
            ..about
        })
    };
    SIDES_PX.into_iter().flat_map(grid).collect()
}

/// True if the choices differ in one option by one step: half or twice the thinning or the bin, the next window, the next part
/// of the rows, or another estimator.
pub(super) fn are_neighbours(a: Choice, b: Choice) -> bool {
    let rung = |c: Choice| windows().position(|w| w == c.window_ms);
    let windows = match (rung(a), rung(b)) {
        (Some(a), Some(b)) => a.abs_diff(b),
        // A session may have a window of its own: it has no neighbours.
        _ => 2 * usize::from(a.window_ms != b.window_ms),
    };
    let halvings = |a: u32, b: u32| match (a.min(b), a.max(b)) {
        (a, b) if a == b => 0,
        (a, b) if b % 2 == 0 && b / 2 == a => 1,
        _ => 2,
    };
    let estimators = usize::from((a.estimator, a.centroid) != (b.estimator, b.centroid));
    let thinnings = halvings(a.thinning, b.thinning);
    let bins = halvings(a.bin_px.into(), b.bin_px.into());
    let regions = (a.region as usize).abs_diff(b.region as usize);
    estimators + thinnings + bins + windows + regions == 1
}

fn windows() -> impl Iterator<Item = Option<f64>> {
    WINDOWS_MS.iter().map(|w| Some(*w)).chain([None])
}

fn distinct(all: Vec<Choice>) -> Vec<Choice> {
    let mut fresh: Vec<Choice> = Vec::new();
    for choice in all {
        if !fresh.contains(&choice) {
            fresh.push(choice);
        }
    }
    fresh
}

/// True if the estimator has a variant in 32 bits.
pub(super) const fn has_f32(choice: Choice) -> bool {
    matches!(
        choice.estimator,
        Estimator::HistogramPeak | Estimator::Streaming
    )
}

/// Overrides (`analysis.key`, value) that turn the settings `from` into `to`, as in a protocol.
#[must_use]
pub(super) fn overrides(from: &AnalysisSettings, to: &AnalysisSettings) -> Vec<(String, String)> {
    let mut out = Vec::new();
    let mut put = |differs: bool, key: &str, value: String| {
        if differs {
            out.push((format!("analysis.{key}"), value));
        }
    };
    put(
        from.estimator != to.estimator,
        "estimator",
        variant_name(&to.estimator),
    );
    put(
        from.centroid != to.centroid,
        "centroid",
        variant_name(&to.centroid),
    );
    put(
        from.precision != to.precision,
        "precision",
        variant_name(&to.precision),
    );
    put(
        from.thinning != to.thinning,
        "thinning",
        to.thinning.to_string(),
    );
    put(from.bin_px != to.bin_px, "bin", format!("{} px", to.bin_px));
    if let Some(ms) = to.window_after_contact_ms {
        let differs = from.window_after_contact_ms != Some(ms);
        put(differs, "window_after_contact", format!("{ms} ms"));
    }
    for (k, (first, last)) in to.crop_v.iter().enumerate() {
        let key = format!("crop.camera{}", k + 1);
        put(
            from.crop_v[k] != to.crop_v[k],
            &key,
            format!("[{first} px, {last} px]"),
        );
    }
    put(
        from.calibration != to.calibration,
        "calibration",
        variant_name(&to.calibration),
    );
    put(
        from.locator != to.locator,
        "locator",
        to.locator.name().to_owned(),
    );
    out
}

/// Serialised name of a unit variant.
fn variant_name<T: Serialize>(value: &T) -> String {
    match serde_json::to_value(value) {
        Ok(serde_json::Value::String(word)) => word,
        _ => String::new(),
    }
}
