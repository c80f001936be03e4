//! Owns the change of an image in events: ON minus OFF of each pixel, and sums over its pixels.

use skinrig_model::SENSOR_WIDTH;

const WIDTH: usize = SENSOR_WIDTH as usize;
/// A pixel counts as changed by the press from this many events in one direction on: single events are mostly noise.
const CHANGED: u16 = 2;

/// ON minus OFF events of each pixel of a crop.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Image {
    rows: (u16, u16),
    pixels: Vec<i16>,
}

/// Sums over an image.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct ImageSums {
    /// Sum of the absolute changes, events.
    pub changed: u64,
    /// Standard deviation of the columns and of the rows of the changed pixels, weighted by change, px; 0 without any.
    pub spread: [f64; 2],
    /// Largest change of a column, and of a pixel, events.
    pub peaks: [u64; 2],
}

/// Remainder of a change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct ReturnSums {
    /// Sum of what is left in the direction of the change, events.
    pub toward: i64,
    /// Sum of the absolute changes, events.
    pub size: u64,
    /// Changed pixels.
    pub pixels: u64,
}

impl Image {
    /// Without change.
    pub(super) fn new(rows: (u16, u16)) -> Self {
        let height = (usize::from(rows.1) + 1).saturating_sub(usize::from(rows.0));
        Self {
            rows,
            pixels: vec![0; height * WIDTH],
        }
    }

    pub(super) const fn len(&self) -> usize {
        self.pixels.len()
    }

    pub(super) fn clear(&mut self) {
        self.pixels.fill(0);
    }

    /// Index of a pixel; `None` off the crop.
    pub(super) fn index(&self, x: u16, y: u16) -> Option<usize> {
        let inside = x < SENSOR_WIDTH && self.rows.0 <= y && y <= self.rows.1;
        inside.then(|| usize::from(y - self.rows.0) * WIDTH + usize::from(x))
    }

    pub(super) fn add(&mut self, pixel: usize, on: bool) {
        let change = if on { 1 } else { -1 };
        let value = &mut self.pixels[pixel];
        *value = value.saturating_add(change);
    }

    pub(super) fn sums(&self) -> ImageSums {
        let mut columns = vec![0u64; WIDTH];
        let mut rows = vec![0u64; self.pixels.len() / WIDTH];
        let (mut changed, mut peak) = (0, 0);
        for (v, row) in self.pixels.chunks_exact(WIDTH).enumerate() {
            for (u, value) in row.iter().enumerate().filter(|(_, s)| **s != 0) {
                let size = value.unsigned_abs();
                changed += u64::from(size);
                if size >= CHANGED {
                    columns[u] += u64::from(size);
                    rows[v] += u64::from(size);
                    peak = peak.max(u64::from(size));
                }
            }
        }
        ImageSums {
            changed,
            spread: [deviation(&columns), deviation(&rows)],
            peaks: [columns.iter().copied().max().unwrap_or(0), peak],
        }
    }

    /// Projection of this image on `change`.
    pub(super) fn along(&self, change: &Self) -> ReturnSums {
        let mut sums = ReturnSums::default();
        for (own, change) in self.pixels.iter().zip(&change.pixels) {
            if change.unsigned_abs() >= CHANGED {
                sums.toward += i64::from(*own) * i64::from(change.signum());
                sums.size += u64::from(change.unsigned_abs());
                sums.pixels += 1;
            }
        }
        sums
    }
}

/// Standard deviation of the indices with these weights; 0 without weights.
fn deviation(weights: &[u64]) -> f64 {
    let total: u64 = weights.iter().sum();
    if total == 0 {
        return 0.0;
    }
    let mean_of = |of: &dyn Fn(f64) -> f64| {
        let each = weights.iter().enumerate();
        let sum: f64 = each.map(|(i, w)| *w as f64 * of(i as f64)).sum();
        sum / total as f64
    };
    let mean = mean_of(&|i| i);
    mean_of(&|i| (i - mean) * (i - mean)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_those_of_the_changed_pixels() {
        let mut image = Image::new((100, 109));
        for (x, y, n) in [(10, 100, 3), (20, 104, -3), (15, 102, 1)] {
            let pixel = image.index(x, y).unwrap();
            (0..i32::abs(n)).for_each(|_| image.add(pixel, n > 0));
        }
        let sums = image.sums();
        assert_eq!(
            (sums.changed, sums.spread, sums.peaks),
            (7, [5.0, 2.0], [3, 3])
        );
        assert_eq!(image.index(0, 99), None);
        assert_eq!(image.index(SENSOR_WIDTH, 100), None);
        let back = Image::new((100, 109)).along(&image);
        assert_eq!((back.toward, back.size, back.pixels), (0, 6, 2));
        assert_eq!(image.along(&image).toward, 6);
    }
}
