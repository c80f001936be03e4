//! The skin and the pixels of one camera before the first touch: what all models of tips begin with.

use super::config::OpticalConfig;
use super::contact::Contact;
use super::dent::Dent;
use super::light::{self, Column, Illumination};
use super::noise::Noise;
use super::pixels::Pixels;
use crate::random::{Purpose, Stream};
use crate::scene::SceneConfig;

pub(super) struct Untouched {
    pub light: Illumination,
    pub columns: Vec<Column>,
    pub noise: Noise,
    pub pixels: Pixels,
    pub contact: Contact,
    /// Of depth zero.
    pub dent: Dent,
}

impl Untouched {
    pub(super) fn new(scene: &SceneConfig, config: &OpticalConfig) -> Self {
        let light = Illumination::new(&scene.outline, config);
        let columns = light::columns(&scene.camera, &scene.outline, &light, config);
        let contact = Contact::none(scene);
        let mut thresholds = Stream::new(scene.seed, Purpose::Pixels, 1);
        Self {
            noise: Noise::new(scene, config, &columns),
            pixels: Pixels::new(scene, config, &mut thresholds),
            dent: Dent::new(scene, config, &light, &columns, contact.place, None),
            light,
            columns,
            contact,
        }
    }
}
