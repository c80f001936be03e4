//! The optical level: events that follow from a light-path model of the skin.
//!
//! Light of emitters travels in the plane of the skin to the camera; the dent of a tip blocks light of the
//! rays that cross it and returns some from its flanks; each pixel turns changes of its log intensity into
//! events. The events do not depend on the touched position directly: localisation errors result from the
//! optics. Formulas, constants and limits: `docs/explanation/optical-model.md`.
//!
//! Data flow: `light` (once) -> `dent` (once per touched place) -> `touches` (the dents of this millisecond, those
//! that a tip has left among them) -> `column` (their light, row by row) -> `pixels`. `noise` is added independently;
//! `readout` delays. `parts` lists what is off in the base model.

mod column;
mod config;
mod contact;
mod dent;
mod light;
mod noise;
mod optics;
mod parts;
#[cfg(test)]
mod parts_tests;
mod pixels;
mod pod;
mod readout;
mod refractory;
#[cfg(test)]
mod several_tests;
mod sources;
#[cfg(test)]
mod tests;
mod touches;
mod variation;

pub use config::{InvalidOpticalSetting, OpticalConfig};
pub use parts::Parts;
pub use sources::{PARAMETERS, Parameter, Source};

use skinrig_model::{Point3, Skin};

use crate::random::{Purpose, Stream};
use crate::scene::{GRID_NS, PixelEvent, PixelModel, SceneConfig, TipSample};

use noise::Noise;
use optics::Optics;
use pixels::Pixels;
use readout::Output;
use touches::Touches;

/// Pixels of one camera over the optically modelled skin.
#[derive(Debug, Clone)]
pub struct OpticalModel {
    optics: Optics,
    touches: Touches,
    pixels: Pixels,
    noise: Noise,
    output: Output,
    first_ns: i64,
    last: Option<(i64, Vec<Point3<Skin>>)>,
}

impl OpticalModel {
    /// The model with the default constants.
    #[must_use]
    pub fn new(scene: &SceneConfig) -> Self {
        Self::build(scene, OpticalConfig::default(), 1)
    }

    /// The model with the lamps off: no emitter is lit and dark pixels show no shot noise. Leakage and hot pixels remain.
    #[must_use]
    pub fn dark(scene: &SceneConfig) -> Self {
        let config = OpticalConfig {
            emitters: 0,
            shot_hz: 0.0,
            ..OpticalConfig::default()
        };
        Self::build(scene, config, 1)
    }

    /// The model with other constants, touched by `tips` tips that move independently.
    ///
    /// # Errors
    /// If a constant is outside its range.
    pub fn with_config(
        scene: &SceneConfig,
        config: OpticalConfig,
        tips: usize,
    ) -> Result<Self, InvalidOpticalSetting> {
        config.check()?;
        Ok(Self::build(scene, config, tips))
    }

    /// The model with constants already checked.
    pub(crate) fn build(scene: &SceneConfig, config: OpticalConfig, tips: usize) -> Self {
        let optics = Optics::new(scene, config);
        let mut thresholds = Stream::new(scene.seed, Purpose::Pixels, 1);
        let (noise, pixels) = (
            Noise::new(scene, &config, &optics.columns),
            Pixels::new(scene, &config, &mut thresholds),
        );
        Self {
            touches: Touches::new(&optics, tips),
            optics,
            pixels,
            noise,
            output: Output::new(&config),
            first_ns: 0,
            last: None,
        }
    }

    /// Expected noise events per second of the whole sensor, before refractory times.
    #[must_use]
    pub const fn noise_hz(&self) -> f64 {
        self.noise.total_hz()
    }

    /// Moves each tip on a straight line to its position at `t_ns`, on the grid, and appends the events until then, sorted by
    /// time. The first call only places the tips; tips without a position stay off the skin.
    pub fn advance_to(&mut self, t_ns: i64, tips: &[Point3<Skin>], out: &mut Vec<PixelEvent>) {
        let Some((last_ns, mut from)) = self.last.take() else {
            self.first_ns = t_ns;
            self.last = Some((t_ns, tips.to_vec()));
            return;
        };
        let steps = (t_ns - last_ns) / GRID_NS;
        for k in 0..steps {
            let part = (k + 1) as f64 / steps as f64;
            let t_ns = last_ns + k * GRID_NS;
            let at = from.iter().zip(tips).map(|(a, b)| {
                let (a, b) = (a.to_array(), b.to_array());
                [0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * part)
            });
            self.touches.follow(&self.optics, at);
            self.step(t_ns, out);
        }
        from.clear();
        from.extend_from_slice(tips);
        self.last = Some((t_ns, from));
    }

    /// The events of the grid step from `t_ns`, through which the touches have already moved.
    fn step(&mut self, t_ns: i64, out: &mut Vec<PixelEvent>) {
        let begin = out.len();
        self.pixels.step(&mut self.touches, t_ns, out);
        self.noise
            .step(t_ns, t_ns - self.first_ns, &mut self.pixels, out);
        self.output.pass(&self.noise, t_ns + GRID_NS, begin, out);
    }
}

impl PixelModel for OpticalModel {
    fn advance(&mut self, tips: &[TipSample], out: &mut Vec<PixelEvent>) {
        for tip in tips {
            self.advance_to(tip.t_ns, &[tip.position], out);
        }
    }
}
