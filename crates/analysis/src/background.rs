//! Owns what the background adds to a window, and the core threshold that keeps it out of clusters.

use skinrig_model::{AnalysisSettings, CameraId, SENSOR_WIDTH};

/// Events of a camera in the idle time before a window.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Background {
    /// Events of the crop.
    pub events: u64,
    /// Length of the idle time, µs; 0 if there is none.
    pub idle_us: u64,
}

impl Background {
    /// Events that a background with this rate adds to a window of this length; 0 without idle time.
    #[must_use]
    pub fn events_in(&self, window_us: u64) -> f64 {
        if self.idle_us == 0 {
            return 0.0;
        }
        self.events as f64 * (window_us as f64 / self.idle_us as f64)
    }

    /// Events that a background with this rate, uniform over the crop, puts within eps of a pixel in a window of this length; 0
    /// without idle time.
    #[must_use]
    pub fn neighbours(&self, settings: &AnalysisSettings, camera: CameraId, window_us: u64) -> f64 {
        let (first, last) = settings.crop_v[camera.index()];
        let rows = f64::from(last.saturating_sub(first)) + 1.0;
        let pixels = f64::from(SENSOR_WIDTH) * rows;
        self.events_in(window_us) * pixels_within(settings.eps_px) / pixels
    }

    /// Core threshold of DBSCAN for a window of this length.
    #[must_use]
    pub fn core_threshold(
        &self,
        settings: &AnalysisSettings,
        camera: CameraId,
        window_us: u64,
    ) -> u32 {
        CoreThreshold::of(settings).at(self.neighbours(settings, camera, window_us))
    }
}

/// Pixels of a disc, its centre included.
fn pixels_within(eps_px: f64) -> f64 {
    let reach = eps_px.min(f64::from(SENSOR_WIDTH)).floor();
    let mut pixels = 0.0;
    let mut row = -reach;
    while row <= reach {
        pixels += 2.0 * (eps_px * eps_px - row * row).max(0.0).sqrt().floor() + 1.0;
        row += 1.0;
    }
    pixels
}

/// How the core threshold of DBSCAN follows the background.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoreThreshold {
    /// Least threshold, events.
    pub min_samples: u32,
    /// Standard deviations above the background; 0 leaves the threshold at `min_samples`.
    pub margin: f64,
}

impl CoreThreshold {
    /// What a caveat advises.
    pub(crate) const ADVISED: Self = Self {
        min_samples: 1,
        margin: 4.0,
    };

    /// As in the settings.
    #[must_use]
    pub const fn of(settings: &AnalysisSettings) -> Self {
        Self {
            min_samples: settings.min_samples,
            margin: settings.background_margin,
        }
    }

    /// The threshold, events, where the background puts `neighbours` events within eps of a pixel. An event counts as its own
    /// neighbour, so at the threshold n the others are n - 1.
    #[must_use]
    pub fn at(&self, neighbours: f64) -> u32 {
        if self.margin == 0.0 {
            return self.min_samples;
        }
        let above = (neighbours + self.margin * neighbours.sqrt()).floor() + 1.0;
        self.min_samples.max(above as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dbscan::Dbscan;
    use crate::grid::PixelGrid;
    use proptest::prelude::*;
    use skinrig_statistics::seeded;

    const CAMERA: CameraId = CameraId::One;

    #[test]
    fn a_disc_holds_its_centre_and_every_pixel_up_to_its_radius() {
        let count = |eps: f64| {
            let reach = eps as i32;
            let all = (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| x * x + y * y));
            all.filter(|d| f64::from(*d) <= eps * eps).count() as f64
        };
        for eps in [0.0, 0.5, 1.0, 1.5, 3.0, 10.0, 49.9] {
            assert_eq!(pixels_within(eps), count(eps), "{eps}");
        }
    }

    #[test]
    fn without_a_margin_or_idle_time_the_threshold_is_that_of_the_settings() {
        let dense = Background {
            events: 1_000_000,
            idle_us: 500_000,
        };
        let mut settings = AnalysisSettings::default();
        let threshold = |settings: &AnalysisSettings, background: Background| {
            background.core_threshold(settings, CAMERA, 500_000)
        };
        assert!(threshold(&settings, dense) > 1000);
        assert_eq!(threshold(&settings, Background::default()), 10);
        settings.background_margin = 0.0;
        assert_eq!(threshold(&settings, dense), 10);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        /// Whatever the rate and the length of the window, a background alone has hardly a cluster, and a press on it is found with
        /// little of the background around it.
        #[test]
        fn a_press_is_found_in_any_background(
            per_pixel in 0.001..1.0_f64, window_us in 100_000u64..10_000_000, seed in 0u64..1000,
        ) {
            let settings = AnalysisSettings::default();
            let rows = settings.crop_v[CAMERA.index()];
            let pixels = f64::from(SENSOR_WIDTH) * f64::from(rows.1 - rows.0 + 1);
            let noise = (per_pixel * pixels) as u64;
            let background = Background { events: noise, idle_us: window_us };
            let threshold = background.core_threshold(&settings, CAMERA, window_us);
            let mut rng = seeded::generator(seed, 0);
            let mut grid = PixelGrid::new(rows);
            for _ in 0..noise {
                let u = seeded::index(&mut rng, usize::from(SENSOR_WIDTH)) as u16;
                let v = rows.0 + seeded::index(&mut rng, usize::from(rows.1 - rows.0 + 1)) as u16;
                prop_assert!(grid.add(u, v));
            }
            let mut dbscan = Dbscan::new(settings.eps_px, threshold);
            let clustered = |dbscan: &Dbscan| -> u64 { dbscan.clusters().iter().map(|c| c.events).sum() };
            dbscan.run(&grid);
            // An event of the background has enough neighbours by chance about once in 10,000.
            prop_assert!(clustered(&dbscan) as f64 <= 0.05 * noise as f64, "{} of {noise}", clustered(&dbscan));
            // A press as dense as five backgrounds, or three events per pixel.
            let each = (5.0 * per_pixel).ceil().max(3.0) as u32;
            for u in 300..340 {
                for v in rows.0 + 60..rows.0 + 100 {
                    prop_assert!(grid.add_many(u, v, each));
                }
            }
            dbscan.run(&grid);
            let (_, press) = dbscan.largest().unwrap();
            let (u, v) = press.centroid().unwrap();
            let off = libm::hypot(u - 319.5, v - f64::from(rows.0) - 79.5);
            // Of a press of 40 px; background at its edge joins it on one side by chance.
            prop_assert!(off < 2.0, "{off} px off");
        }
    }
}
