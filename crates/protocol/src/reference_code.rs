//! The choices of the public analysis code as overrides of a protocol's `analysis`.

/// Overrides that select the public code's choices where it departs from the paper or from the defaults here: all
/// clusters make the centroid, rays alone locate, a press window is one whole period about the middle of the press, no
/// threshold, response or angle excludes anything, data reduction has a core threshold of one event, the background is
/// taken after the press, thresholds 17 to 19, and 3 to 8 at 1/1024 of the events. Each has its source in `docs/reference/paper.md`.
///
/// The calibration stays the protocol's: the block that judges as published fits the paper's eight parameters itself.
pub const REFERENCE_CODE: [&str; 36] = [
    "analysis.crop.camera1=[185 px, 360 px]",
    "analysis.crop.camera2=[200 px, 355 px]",
    "analysis.window_anchor=middle",
    "analysis.window_before=868 s / 578",
    "analysis.window_after=868 s / 578",
    "analysis.eps=10 px",
    "analysis.min_samples=10",
    "analysis.background_margin=0",
    "analysis.hot_pixel_ratio=0",
    "analysis.centroid=all_clusters",
    "analysis.locator=geometry",
    "analysis.estimator=dbscan",
    "analysis.thinning=1",
    "analysis.bin=1 px",
    "analysis.window_after_contact=60 s",
    "analysis.window_after_depth=60 s",
    "analysis.cluster_threshold=fixed",
    "analysis.min_cluster_events=0",
    "analysis.min_response_sigma=0",
    "analysis.min_ray_sine=0",
    "analysis.bits_per_event=21",
    "analysis.reduction.max_power=10",
    "analysis.reduction.seeds=10",
    "analysis.reduction.min_samples=1",
    "analysis.latency.bin=0.2 ms",
    "analysis.latency.sigma=0.5 ms",
    "analysis.latency.alpha=4",
    "analysis.latency.thresholds.from=17",
    "analysis.latency.thresholds.to=19",
    "analysis.latency.thresholds.count=3",
    "analysis.latency.background=after",
    "analysis.latency.reduced.factor=1024",
    "analysis.latency.reduced.thresholds.from=3",
    "analysis.latency.reduced.thresholds.to=8",
    "analysis.latency.reduced.thresholds.count=6",
    "analysis.latency.reduced.target_rate=0.85",
];
