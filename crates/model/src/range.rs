//! Ranges.
use skinrig_settings::ValueRange;
/// Ranges of [`crate::AnalysisSettings`], each in the unit that the field's name says.
pub mod analysis {
    use super::ValueRange;

    /// Times are kept in whole nanoseconds: less than one is none.
    const NANOSECOND_MS: f64 = 1e-6;

    /// `window_before_ms` and `window_after_ms`. A window of ten seconds is longer than any press.
    pub const WINDOW_MARGIN_MS: ValueRange = ValueRange::between(0.0, 10_000.0);
    /// `window_after_contact_ms`.
    pub const WINDOW_AFTER_CONTACT_MS: ValueRange = ValueRange::between(NANOSECOND_MS, 60_000.0);
    /// `eps_px`: the neighbourhood search is laid out for up to 50 px.
    pub const EPS_PX: ValueRange = ValueRange::above(0.0, 50.0);
    /// `min_samples`.
    pub const MIN_SAMPLES: ValueRange = ValueRange::between(1.0, 1e6);
    /// `forget_ms`.
    pub const FORGET_MS: ValueRange = ValueRange::between(0.1, 60_000.0);
    /// `thinning` and `latency.reduced.factor`.
    pub const THINNING: ValueRange = ValueRange::between(1.0, 1_048_576.0);
    /// `min_cluster_events`.
    pub const MIN_CLUSTER_EVENTS: ValueRange = ValueRange::between(0.0, 1e6);
    /// `min_response_sigma`.
    pub const MIN_RESPONSE_SIGMA: ValueRange = ValueRange::between(0.0, 1000.0);
    /// `min_ray_sine`. At a sine of 1 every press would be excluded.
    pub const MIN_RAY_SINE: ValueRange = ValueRange::between(0.0, 0.999);
    /// `failure_penalty_mm`, `within_mm`.
    pub const LENGTH_MM: ValueRange = ValueRange::above(0.0, 1000.0);
    /// `bits_per_event`.
    pub const BITS_PER_EVENT: ValueRange = ValueRange::above(0.0, 1024.0);
    /// `study_presses`.
    pub const STUDY_PRESSES: ValueRange = ValueRange::between(0.0, 100_000.0);
    /// `bootstrap_resamples`; 0 gives no intervals.
    pub const BOOTSTRAP_RESAMPLES: ValueRange = ValueRange::between(0.0, 1e6);
    /// `rate_bin_ms`.
    pub const RATE_BIN_MS: ValueRange = ValueRange::between(0.1, 10_000.0);
    /// `reduction.max_power`.
    pub const REDUCTION_MAX_POWER: ValueRange = ValueRange::between(0.0, 20.0);
    /// `reduction.seeds`.
    pub const REDUCTION_SEEDS: ValueRange = ValueRange::between(1.0, 1000.0);
    /// `reduction.min_samples`.
    pub const REDUCTION_MIN_SAMPLES: ValueRange = ValueRange::between(0.0, 1e6);
    /// `latency.bin_ms`.
    pub const LATENCY_BIN_MS: ValueRange = ValueRange::between(0.01, 10.0);
    /// `latency.sigma_ms`.
    pub const LATENCY_SIGMA_MS: ValueRange = ValueRange::between(0.0, 50.0);
    /// `latency.alpha`: the detector looks for an increase.
    pub const LATENCY_ALPHA: ValueRange = ValueRange::between(1.01, 1000.0);
    /// `latency.consecutive`, and the number of thresholds of either grid.
    pub const LATENCY_COUNT: ValueRange = ValueRange::between(1.0, 1000.0);
    /// Thresholds of the latency study.
    pub const LATENCY_THRESHOLD: ValueRange = ValueRange::above(0.0, 1e6);
    /// `latency.window_ms`.
    pub const LATENCY_WINDOW_MS: ValueRange = ValueRange::between(NANOSECOND_MS, 10_000.0);
    /// Times of the alignment certificate that may not be zero: `max_residual_us`, `max_camera_interval_us`, `max_host_interval_us`.
    pub const ALIGNMENT_TIME_US: ValueRange = ValueRange::between(1e-3, 1e6);
    /// `alignment.max_tie_distance_us`, up to a day.
    pub const TIE_DISTANCE_US: ValueRange = ValueRange::between(1e-3, 86_400e6);
    /// `alignment.robot_delay_us`.
    pub const ROBOT_DELAY_US: ValueRange = ValueRange::from_zero(1e6);
    /// `alignment.max_drift_ppm`.
    pub const DRIFT_PPM: ValueRange = ValueRange::above_zero(1e6);
    /// `alignment.min_log_odds`.
    pub const LOG_ODDS: ValueRange = ValueRange::from_zero(1000.0);
    /// Shares: target rates of the latency study, limits of the alignment certificate.
    pub const SHARE: ValueRange = ValueRange::between(0.0, 1.0);
    /// `cmre.cell_mm`.
    pub const CMRE_CELL_MM: ValueRange = ValueRange::between(0.5, 100.0);
    /// `cmre.sigma_mm`, `cmre.sr_mm`: below a micrometre the Gaussian is no contact map.
    pub const CMRE_WIDTH_MM: ValueRange = ValueRange::between(0.001, 1000.0);
}
