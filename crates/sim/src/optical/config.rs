//! Every constant of the optical model, with its unit, source and valid range.

use serde::Serialize;
use thiserror::Error;

use super::parts::Parts;

/// A setting outside its valid range.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("expected optical.{name} {expected}, found {found}; correct the setting or leave it out")]
pub struct InvalidOpticalSetting {
    /// Name of the field.
    pub name: &'static str,
    /// The range, as text.
    pub expected: &'static str,
    /// The value.
    pub found: f64,
}

/// Constants of the optical model. "Assumption" marks values without a public source; the defaults are chosen
/// so that event counts, polarities and spreads resemble the published ones (`docs/explanation/optical-model.md`).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OpticalConfig {
    // ---- emitters
    /// Number of emitters, evenly spaced along the three edges without cameras (paper: 32).
    pub emitters: u32,
    /// Angle from an emitter's axis at which its intensity is half, degrees (data sheet of the VSMY1850, the
    /// same package: 60; that of the VSMY1860 was not found).
    pub half_intensity_deg: f64,
    /// Gaussian width of one emitter as seen through the skin, mm (assumption).
    pub emitter_sigma_mm: f64,

    // ---- waveguide
    /// Attenuation of guided light in the skin's plane, 1/mm (assumption).
    pub attenuation_per_mm: f64,
    /// Light scattered into a ray per length and unit of fluence, 1/mm (assumption).
    pub scatter_per_mm: f64,
    /// Light that no dent can block (over the skin, dark current), in units of an emitter's radiance
    /// (assumption).
    pub stray: f64,

    // ---- indentation
    /// Length over which the dent flattens outside the tip, in skin thicknesses (assumption).
    pub dent_decay_thicknesses: f64,
    /// Guided light lost per mm of path at full thinning of the skin, 1/mm (assumption).
    pub thinning_loss_per_mm: f64,
    /// Guided light lost per mm of path and unit of surface slope, 1/mm (assumption).
    pub slope_loss_per_mm: f64,
    /// Brightness of the dent's flanks in units of a white matt flank under the modelled fluence; above 1
    /// because light also reaches them through the skin's thickness (assumption).
    pub flank_gain: f64,
    /// Part of the indentation's effect that follows with a delay, 0..=1 (assumption).
    pub creep_fraction: f64,
    /// Time constant of that part, ms (assumption: soft 30:1 PDMS).
    pub creep_time_ms: f64,
    /// Lateral motion of the tip beyond which its dent is recomputed, mm.
    pub same_place_mm: f64,

    // ---- image
    /// Gaussian height of the skin's illuminated band over its rows, as a fraction of the number of rows
    /// (assumption).
    pub band_sigma_rows: f64,
    /// Height of a dent's image apart from its distance: due to the range of inclinations of the light, px
    /// (assumption).
    pub dent_sigma_px: f64,
    /// Lower limit on the distance of a dent from the camera, mm: keeps the height of its image finite.
    pub nearest_mm: f64,

    // ---- pixels
    /// Mean ON threshold, natural-log intensity (not published for the EVK1; assumption, a common nominal
    /// value).
    pub threshold_on: f64,
    /// Mean OFF threshold, natural-log intensity (assumption, as above).
    pub threshold_off: f64,
    /// Standard deviation of either threshold from pixel to pixel, natural-log intensity (assumption).
    pub threshold_sigma: f64,
    /// A pixel is blind for this long after an event, µs, at least 1 (not published; assumption).
    pub refractory_us: u32,
    /// Delay from light to event, µs, 0..=1000 (nominal of the sensor: 200).
    pub latency_us: u32,

    // ---- noise
    /// ON events by leakage, per pixel and second (assumption).
    pub leak_hz: f64,
    /// Shot-noise events per second of a pixel at the brightness where they are most frequent (assumption).
    pub shot_hz: f64,
    /// Number of hot pixels.
    pub hot_pixels: u32,
    /// Events per second of the hottest pixel.
    pub hot_hz: f64,
    /// Rate of each hot pixel as a fraction of the next hotter one's.
    pub hot_ratio: f64,

    /// Physics beyond this model.
    #[serde(flatten)]
    pub parts: Parts,
}

impl Default for OpticalConfig {
    fn default() -> Self {
        Self {
            emitters: 32,
            half_intensity_deg: 60.0,
            emitter_sigma_mm: 1.5,
            attenuation_per_mm: 0.01,
            scatter_per_mm: 0.003,
            stray: 0.02,
            dent_decay_thicknesses: 0.5,
            thinning_loss_per_mm: 0.07,
            slope_loss_per_mm: 0.07,
            flank_gain: 1.8,
            creep_fraction: 0.3,
            creep_time_ms: 700.0,
            same_place_mm: 0.25,
            band_sigma_rows: 0.2,
            dent_sigma_px: 15.0,
            nearest_mm: 15.0,
            threshold_on: 0.2,
            threshold_off: 0.2,
            threshold_sigma: 0.03,
            refractory_us: 500,
            latency_us: 200,
            leak_hz: 0.002,
            shot_hz: 0.05,
            hot_pixels: 8,
            hot_hz: 300.0,
            hot_ratio: 0.45,
            parts: Parts::default(),
        }
    }
}

impl OpticalConfig {
    /// The same constants without noise: no leak, no shot noise, no hot pixels, equal thresholds.
    #[cfg(test)]
    pub(crate) const fn without_noise(self) -> Self {
        Self {
            threshold_sigma: 0.0,
            leak_hz: 0.0,
            shot_hz: 0.0,
            hot_pixels: 0,
            ..self
        }
    }

    /// The same constants with so many times the random events of the pixels; hot pixels stay.
    #[must_use]
    pub fn with_noise(self, factor: f64) -> Self {
        let mut parts = self.parts;
        if let Some(noise) = &mut parts.uneven_noise {
            noise.leak_hz *= factor;
            noise.shot_hz *= factor;
            noise.dark_hz *= factor;
        }
        Self {
            leak_hz: factor * self.leak_hz,
            shot_hz: factor * self.shot_hz,
            parts,
            ..self
        }
    }

    /// With the noise of the part, if it is on.
    pub(super) const fn with_uneven_noise(self) -> Self {
        match self.parts.uneven_noise {
            None => self,
            Some(noise) => Self {
                leak_hz: noise.leak_hz,
                shot_hz: noise.shot_hz,
                hot_pixels: noise.hot_pixels,
                hot_hz: noise.hot_hz,
                hot_ratio: noise.hot_ratio,
                ..self
            },
        }
    }

    /// Checks every field.
    ///
    /// # Errors
    /// The first field outside its range; NaN is outside every range.
    pub fn check(&self) -> Result<(), InvalidOpticalSetting> {
        let positive = |v: f64| v > 0.0 && v.is_finite();
        let not_negative = |v: f64| v >= 0.0 && v.is_finite();
        let positive_fields = [
            ("emitter_sigma_mm", self.emitter_sigma_mm),
            ("stray", self.stray),
            ("dent_decay_thicknesses", self.dent_decay_thicknesses),
            ("creep_time_ms", self.creep_time_ms),
            ("same_place_mm", self.same_place_mm),
            ("band_sigma_rows", self.band_sigma_rows),
            ("dent_sigma_px", self.dent_sigma_px),
            ("nearest_mm", self.nearest_mm),
            ("threshold_on", self.threshold_on),
            ("threshold_off", self.threshold_off),
        ];
        let not_negative_fields = [
            ("attenuation_per_mm", self.attenuation_per_mm),
            ("scatter_per_mm", self.scatter_per_mm),
            ("thinning_loss_per_mm", self.thinning_loss_per_mm),
            ("slope_loss_per_mm", self.slope_loss_per_mm),
            ("flank_gain", self.flank_gain),
            ("threshold_sigma", self.threshold_sigma),
            ("leak_hz", self.leak_hz),
            ("shot_hz", self.shot_hz),
            ("hot_hz", self.hot_hz),
        ];
        let ranged_fields = [
            (
                "half_intensity_deg",
                "above 0 and below 90",
                self.half_intensity_deg,
                self.half_intensity_deg > 0.0 && self.half_intensity_deg < 90.0,
            ),
            (
                "creep_fraction",
                "in 0..=1",
                self.creep_fraction,
                (0.0..=1.0).contains(&self.creep_fraction),
            ),
            (
                "hot_ratio",
                "above 0 and at most 1",
                self.hot_ratio,
                self.hot_ratio > 0.0 && self.hot_ratio <= 1.0,
            ),
            (
                "refractory_us",
                "at least 1",
                f64::from(self.refractory_us),
                self.refractory_us >= 1,
            ),
            (
                "latency_us",
                "at most 1000",
                f64::from(self.latency_us),
                self.latency_us <= 1000,
            ),
        ];
        let checked = positive_fields
            .map(|(n, v)| (n, "above 0", v, positive(v)))
            .into_iter()
            .chain(not_negative_fields.map(|(n, v)| (n, "at least 0", v, not_negative(v))))
            .chain(ranged_fields);
        for (name, expected, found, good) in checked {
            if !good {
                return Err(InvalidOpticalSetting {
                    name,
                    expected,
                    found,
                });
            }
        }
        Ok(())
    }
}
