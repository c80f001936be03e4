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
/// Longer than any press: a window that ends only with the release.
pub(crate) const WHOLE_PRESS_MS: f64 = 60_000.0;

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

/// Distinct choices to try, the session's own first.
#[must_use]
pub(super) fn sweep(session: Choice, full: bool) -> Vec<Choice> {
    let mut all = vec![session];
    let windows = || WINDOWS_MS.iter().map(|w| Some(*w)).chain([None]);
    let regions = [Region::Full, Region::Half, Region::Quarter];
    if full {
        for how in ESTIMATORS {
            for thinning in FACTORS {
                for bin_px in SIDES_PX {
                    for window_ms in windows() {
                        all.extend(regions.map(|region| {
                            let choice = session.with_estimator(how);
                            Choice {
                                thinning,
                                bin_px,
                                window_ms,
                                region,
                                ..choice
                            }
                        }));
                    }
                }
            }
        }
    } else {
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
        all.extend(regions.map(|region| Choice { region, ..session }));
        all.extend(candidates(session));
    }
    let mut fresh: Vec<Choice> = Vec::new();
    for choice in all {
        if !fresh.contains(&choice) {
            fresh.push(choice);
        }
    }
    fresh
}

/// Combinations that save in several ways at once: cheap estimators with short windows and thinned events, and clusters on
/// coarse bins.
fn candidates(session: Choice) -> Vec<Choice> {
    let mut all = Vec::new();
    for (estimator, precision) in [
        (Estimator::Dbscan, Precision::F64),
        (Estimator::ColumnMedian, Precision::F64),
        (Estimator::HistogramPeak, Precision::F32),
        (Estimator::Streaming, Precision::F32),
    ] {
        let how = (estimator, CentroidRule::LargestCluster, precision);
        let choice = session.with_estimator(how);
        for window_ms in [Some(20.0), Some(50.0), Some(100.0), None] {
            for thinning in [1, 8, 64] {
                all.push(Choice {
                    window_ms,
                    thinning,
                    ..choice
                });
            }
        }
        for bin_px in [4, 8] {
            for window_ms in [Some(100.0), None] {
                all.push(Choice {
                    window_ms,
                    bin_px,
                    ..choice
                });
            }
        }
    }
    all
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
