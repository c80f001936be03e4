//! The optical level: events that follow from a light-path model of the skin.
//!
//! Light of emitters travels in the plane of the skin to the camera; the dent of the tip blocks light of the
//! rays that cross it and returns some from its flanks; each pixel turns changes of its log intensity into
//! events. The events do not depend on the touched position directly: localisation errors result from the
//! optics. Formulas, constants and limits: `docs/explanation/optical-model.md`.
//!
//! Data flow: `light` (once) -> `dent` (once per touched place) -> `pixels` (every millisecond with a change).
//! `noise` is added independently. `several` does the same for tips whose dents overlap.

mod config;
mod contact;
mod dent;
mod light;
mod noise;
mod pixels;
mod several;
#[cfg(test)]
mod several_tests;
#[cfg(test)]
mod tests;
mod untouched;

pub use config::{InvalidOpticalSetting, OpticalConfig};
pub use several::SeveralTips;

use crate::scene::{GRID_NS, PixelEvent, PixelModel, SceneConfig, TipSample};

use contact::Contact;
use dent::Dent;
use light::{Column, Illumination};
use noise::Noise;
use pixels::{Pixels, Ramp};
use untouched::Untouched;

/// Pixels of one camera over the optically modelled skin.
#[derive(Debug, Clone)]
pub struct OpticalModel {
    scene: SceneConfig,
    config: OpticalConfig,
    light: Illumination,
    columns: Vec<Column>,
    pixels: Pixels,
    noise: Noise,
    contact: Contact,
    dent: Dent,
    /// Part of the creep that happens in one grid step.
    creep_step: f64,
    first_ns: i64,
    last: Option<TipSample>,
}

impl OpticalModel {
    /// The model with the default constants.
    #[must_use]
    pub fn new(scene: &SceneConfig) -> Self {
        Self::build(scene, OpticalConfig::default())
    }

    /// The model with the lamps off: no emitter is lit and dark pixels show no shot noise. Leakage and hot pixels remain.
    #[must_use]
    pub fn dark(scene: &SceneConfig) -> Self {
        let config = OpticalConfig {
            emitters: 0,
            shot_hz: 0.0,
            ..OpticalConfig::default()
        };
        Self::build(scene, config)
    }

    /// The model with other constants.
    ///
    /// # Errors
    /// If a constant is outside its range.
    pub fn with_config(
        scene: &SceneConfig,
        config: OpticalConfig,
    ) -> Result<Self, InvalidOpticalSetting> {
        config.check()?;
        Ok(Self::build(scene, config))
    }

    /// The model with constants already checked.
    pub(crate) fn build(scene: &SceneConfig, config: OpticalConfig) -> Self {
        let Untouched {
            light,
            columns,
            noise,
            mut pixels,
            contact,
            dent,
        } = Untouched::new(scene, &config);
        pixels.start_dent(&dent);
        Self {
            scene: scene.clone(),
            config,
            light,
            columns,
            pixels,
            noise,
            contact,
            dent,
            creep_step: Contact::creep_step(&config),
            first_ns: 0,
            last: None,
        }
    }

    /// Expected noise events per second of the whole sensor, before refractory times.
    #[must_use]
    pub const fn noise_hz(&self) -> f64 {
        self.noise.total_hz()
    }

    /// One grid step from `t_ns`, at whose end the tip is at `[x, y, z]` mm.
    fn step(&mut self, t_ns: i64, tip: [f64; 3], out: &mut Vec<PixelEvent>) {
        let begin = out.len();
        let ramp = self.indent(t_ns, tip);
        self.pixels.step(&self.dent, ramp, out);
        self.noise
            .step(t_ns, t_ns - self.first_ns, &mut self.pixels, out);
        out[begin..].sort_unstable_by_key(|e| (e.t_ns, e.y, e.x, e.polarity.bit()));
    }

    fn indent(&mut self, t_ns: i64, tip: [f64; 3]) -> Ramp {
        let step = self.creep_step;
        let (ramp, moved) = self
            .contact
            .indent(&self.scene, &self.config, step, t_ns, tip);
        if moved {
            self.dent = Dent::new(
                &self.scene,
                &self.config,
                &self.light,
                &self.columns,
                self.contact.place,
                Some(&self.dent),
            );
            self.pixels.start_dent(&self.dent);
        }
        ramp
    }
}

impl PixelModel for OpticalModel {
    fn advance(&mut self, tips: &[TipSample], out: &mut Vec<PixelEvent>) {
        for &tip in tips {
            let Some(last) = self.last else {
                self.first_ns = tip.t_ns;
                self.last = Some(tip);
                continue;
            };
            let steps = (tip.t_ns - last.t_ns) / GRID_NS;
            let (a, b) = (last.position.to_array(), tip.position.to_array());
            for k in 0..steps {
                let part = (k + 1) as f64 / steps as f64;
                let at = [0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * part);
                self.step(last.t_ns + k * GRID_NS, at, out);
            }
            self.last = Some(tip);
        }
    }
}
