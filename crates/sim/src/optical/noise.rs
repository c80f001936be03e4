//! Events not caused by dents: leakage, shot noise, hot pixels.

use skinrig_model::{Polarity, SENSOR_HEIGHT, SENSOR_WIDTH};

use crate::random::{Purpose, Stream};
use crate::scene::{GRID_NS, PixelEvent, SceneConfig};

use super::config::OpticalConfig;
use super::light::Column;
use super::pixels::Pixels;

/// All noise of one camera as one Poisson process.
#[derive(Debug, Clone)]
pub(super) struct Noise {
    random: Stream,
    leak_total_hz: f64,
    shot_total_hz: f64,
    /// Rows beside the skin, and the events of their pixels.
    dark_rows: Vec<u16>,
    dark_total_hz: f64,
    hot: Vec<(u16, u16, f64)>,
    total_hz: f64,
    /// Brightness of each column and row of the undisturbed image; their product is 1 at the brightest pixel.
    column_light: Vec<f64>,
    row_light: Vec<f64>,
    /// Shot-noise weights: cumulative sum over the rows, and the largest in each row.
    shot_below: Vec<f64>,
    shot_peak: Vec<f64>,
    /// Time of the next noise event, ns after the first tip sample.
    next_ns: f64,
}

/// Rate of shot-noise events at brightness `q` (1 = brightest pixel) relative to the highest rate. A
/// dark pixel is too slow to show noise, a bright one has little noise.
fn shot_weight(q: f64) -> f64 {
    /// Brightness with the highest rate.
    const WORST: f64 = 0.3;
    let r = q / WORST;
    4.0 * r / ((1.0 + r) * (1.0 + r))
}

/// A whole number below `n`.
fn below(random: &mut Stream, n: u16) -> u16 {
    (((random.bits() >> 32) * u64::from(n)) >> 32) as u16
}

impl Noise {
    pub(super) fn new(scene: &SceneConfig, config: &OpticalConfig, columns: &[Column]) -> Self {
        let dark_hz = config.parts.uneven_noise.map_or(0.0, |noise| noise.dark_hz);
        let config = &config.with_uneven_noise();
        let mut random = Stream::new(scene.seed, Purpose::Pixels, 2);
        let brightest = columns
            .iter()
            .map(|c| c.total)
            .fold(f64::MIN_POSITIVE, f64::max);
        let column_light: Vec<f64> = columns.iter().map(|c| c.total / brightest).collect();
        let (first, last) = (f64::from(scene.skin_rows.0), f64::from(scene.skin_rows.1));
        let sigma = config.band_sigma_rows * (last - first + 1.0).max(1.0);
        let row_light: Vec<f64> = (0..SENSOR_HEIGHT)
            .map(|v| {
                let z = (f64::from(v) - 0.5 * (first + last)) / sigma;
                libm::exp(-0.5 * z * z)
            })
            .collect();
        let mut weights = 0.0;
        let (mut shot_below, mut shot_peak) = (Vec::new(), Vec::new());
        for row in &row_light {
            let row_weights = column_light.iter().map(|column| shot_weight(row * column));
            weights += row_weights.clone().sum::<f64>();
            shot_below.push(weights);
            shot_peak.push(row_weights.fold(0.0, f64::max));
        }
        let pixels = f64::from(SENSOR_WIDTH) * f64::from(SENSOR_HEIGHT);
        let (leak_total_hz, shot_total_hz) = (config.leak_hz * pixels, config.shot_hz * weights);
        let dark_rows: Vec<u16> = (0..SENSOR_HEIGHT)
            .filter(|v| !scene.rows().contains(&usize::from(*v)))
            .collect();
        let dark_total_hz = dark_hz * f64::from(SENSOR_WIDTH) * dark_rows.len() as f64;
        let mut rate = config.hot_hz;
        let hot: Vec<_> = (0..config.hot_pixels)
            .map(|_| {
                let pixel = (
                    below(&mut random, SENSOR_WIDTH),
                    below(&mut random, SENSOR_HEIGHT),
                    rate,
                );
                rate *= config.hot_ratio;
                pixel
            })
            .collect();
        if scene.start > 0 {
            random = Stream::new(scene.seed_of_start(), Purpose::Pixels, 2);
        }
        let total_hz =
            leak_total_hz + shot_total_hz + hot.iter().map(|h| h.2).sum::<f64>() + dark_total_hz;
        let mut noise = Self {
            random,
            leak_total_hz,
            shot_total_hz,
            dark_rows,
            dark_total_hz,
            hot,
            total_hz,
            column_light,
            row_light,
            shot_below,
            shot_peak,
            next_ns: 0.0,
        };
        noise.wait();
        noise
    }

    /// Expected events per second before refractory times, all pixels together.
    pub(super) const fn total_hz(&self) -> f64 {
        self.total_hz
    }

    /// Brightness of a pixel in the undisturbed image, above 0 to 1.
    pub(super) fn brightness(&self, x: u16, y: u16) -> f64 {
        self.column_light[usize::from(x)] * self.row_light[usize::from(y)]
    }

    fn wait(&mut self) {
        self.next_ns = if self.total_hz > 0.0 {
            self.next_ns + self.random.exponential() / self.total_hz * 1e9
        } else {
            f64::INFINITY
        };
    }

    /// The noise of the grid step that begins at `t_ns`, `since_start_ns` after the first one.
    pub(super) fn step(
        &mut self,
        t_ns: i64,
        since_start_ns: i64,
        pixels: &mut Pixels,
        out: &mut Vec<PixelEvent>,
    ) {
        let start = since_start_ns as f64;
        while self.next_ns < start + GRID_NS as f64 {
            let us = (((self.next_ns - start) / 1e3) as i64).clamp(0, GRID_NS / 1000 - 1);
            let (x, y, polarity) = self.draw();
            pixels.inject(
                PixelEvent {
                    t_ns: t_ns + us * 1000,
                    x,
                    y,
                    polarity,
                },
                out,
            );
            self.wait();
        }
    }

    fn draw(&mut self) -> (u16, u16, Polarity) {
        let mut pick = self.random.unit() * self.total_hz;
        if pick < self.leak_total_hz {
            return (
                below(&mut self.random, SENSOR_WIDTH),
                below(&mut self.random, SENSOR_HEIGHT),
                Polarity::On,
            );
        }
        pick -= self.leak_total_hz;
        let polarity = Polarity::from_bit(self.random.unit() < 0.5);
        if pick < self.dark_total_hz {
            let row = below(&mut self.random, self.dark_rows.len() as u16);
            let x = below(&mut self.random, SENSOR_WIDTH);
            return (x, self.dark_rows[usize::from(row)], polarity);
        }
        pick -= self.dark_total_hz;
        if pick >= self.shot_total_hz {
            pick -= self.shot_total_hz;
            for &(x, y, rate) in &self.hot {
                if pick < rate {
                    return (x, y, polarity);
                }
                pick -= rate;
            }
        }
        // Shot noise (and the last bit of rounding of the hot pixels): a row by its rate, then columns until
        // one accepts.
        let threshold = self.random.unit() * self.shot_below.last().copied().unwrap_or(0.0);
        let y = self
            .shot_below
            .partition_point(|&sum| sum <= threshold)
            .min(self.row_light.len() - 1);
        loop {
            let x = below(&mut self.random, SENSOR_WIDTH);
            let weight = shot_weight(self.column_light[usize::from(x)] * self.row_light[y]);
            if self.random.unit() * self.shot_peak[y] <= weight {
                return (x, y as u16, polarity);
            }
        }
    }
}
