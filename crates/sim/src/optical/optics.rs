//! The undisturbed skin of one camera: what dents are made from.

use crate::scene::SceneConfig;

use super::config::OpticalConfig;
use super::light::{self, Column, Illumination};
use super::pod::Pod;

/// The skin, its light, and the camera's columns.
#[derive(Debug, Clone)]
pub(super) struct Optics {
    pub(super) scene: SceneConfig,
    pub(super) config: OpticalConfig,
    pub(super) light: Illumination,
    pub(super) columns: Vec<Column>,
}

impl Optics {
    pub(super) fn new(scene: &SceneConfig, config: OpticalConfig) -> Self {
        let light = Illumination::new(&scene.outline, &config, scene.skin_seed);
        let pod = config.parts.pod_refraction.map(|p| Pod::new(&p, scene));
        let enter = |lens, d| match &pod {
            Some(pod) => pod.refract(lens, d),
            None => (lens, d),
        };
        Self {
            columns: light::columns(&scene.camera, &scene.outline, &light, &config, enter),
            scene: scene.clone(),
            config,
            light,
        }
    }
}
