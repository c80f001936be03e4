//! The optical level: events that follow from a light-path model of the skin.
//!
//! Light of emitters travels in the plane of the skin to the camera; the dent of the tip blocks light of the
//! rays that cross it and returns some from its flanks; each pixel turns changes of its log intensity into
//! events. The events do not depend on the touched position directly: localisation errors result from the
//! optics. Formulas, constants and limits: `docs/explanation/optical-model.md`.
//!
//! Data flow: `light` (once) -> `dent` (once per touched place) -> `pixels` (every millisecond with a change).
//! `noise` is added independently.

mod config;
mod dent;
mod light;
mod noise;
mod pixels;
#[cfg(test)]
mod tests;

pub use config::{InvalidOpticalSetting, OpticalConfig};

use crate::random::{Purpose, Stream};
use crate::scene::{GRID_NS, PixelEvent, PixelModel, SceneConfig, TipSample};
use skinrig_model::Point2;

use dent::Dent;
use light::{Column, Illumination, Vec2};
use noise::Noise;
use pixels::{Pixels, Ramp};

/// Depth below which a relaxing dent is dropped, mm: no pixel can detect it.
const GONE_MM: f64 = 1e-5;

/// Depth and position of the indentation. The optical effect of a held depth `d` is
/// `(1 - creep) d + creep m` with `m' = (d - m) / tau`: the standard linear solid, driven by depth.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Contact {
    /// Position of first touch.
    place: Vec2,
    /// Depth of the tip, mm.
    depth_mm: f64,
    /// The creeping part `m`, mm.
    memory_mm: f64,
    /// The effective depth, mm.
    effect_mm: f64,
    /// The effective depth as pixels see it, after their latency, mm.
    seen_mm: f64,
}

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
        let light = Illumination::new(&scene.outline, &config);
        let columns = light::columns(&scene.camera, &scene.outline, &light, &config);
        let noise = Noise::new(scene, &config, &columns);
        let contact = Contact {
            place: [scene.outline.centre.x_mm, scene.outline.centre.y_mm],
            depth_mm: 0.0,
            memory_mm: 0.0,
            effect_mm: 0.0,
            seen_mm: 0.0,
        };
        let dent = Dent::new(scene, &config, &light, &columns, contact.place, None);
        let mut pixels = Pixels::new(
            scene,
            &config,
            &mut Stream::new(scene.seed, Purpose::Pixels, 1),
        );
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
            creep_step: -libm::expm1(-(GRID_NS as f64 * 1e-6) / config.creep_time_ms),
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

    fn indent(&mut self, t_ns: i64, [x, y, z]: [f64; 3]) -> Ramp {
        let c = &mut self.contact;
        // The base is rigid: the depth is limited to the skin's thickness.
        let on_skin = z < 0.0 && self.scene.outline.contains(Point2::new(x, y));
        let depth_mm = if on_skin {
            (-z).min(self.scene.skin_thickness_mm)
        } else {
            0.0
        };
        let (dx, dy) = (x - c.place[0], y - c.place[1]);
        let elsewhere = dx * dx + dy * dy > self.config.same_place_mm * self.config.same_place_mm;
        if depth_mm > 0.0 && elsewhere {
            if c.depth_mm == 0.0 {
                // A new touch; the remainder of the previous dent is dropped.
                (c.memory_mm, c.effect_mm, c.seen_mm) = (0.0, 0.0, 0.0);
            }
            c.place = [x, y];
            self.dent = Dent::new(
                &self.scene,
                &self.config,
                &self.light,
                &self.columns,
                c.place,
                Some(&self.dent),
            );
            self.pixels.start_dent(&self.dent);
        }
        c.depth_mm = depth_mm;
        c.memory_mm += (depth_mm - c.memory_mm) * self.creep_step;
        if depth_mm == 0.0 && c.memory_mm < GONE_MM {
            c.memory_mm = 0.0;
        }
        let creep = self.config.creep_fraction;
        let effect_mm = (1.0 - creep) * depth_mm + creep * c.memory_mm;
        let late = f64::from(self.config.latency_us) / (GRID_NS as f64 * 1e-3);
        let seen_mm = effect_mm - (effect_mm - c.effect_mm) * late;
        let ramp = Ramp {
            t_ns,
            from_mm: c.seen_mm,
            to_mm: seen_mm,
        };
        (c.effect_mm, c.seen_mm) = (effect_mm, seen_mm);
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
