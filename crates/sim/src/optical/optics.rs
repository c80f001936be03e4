//! The undisturbed skin of one camera: what dents are made from.

use crate::scene::SceneConfig;

use super::config::OpticalConfig;
use super::light::{self, Column, Illumination};

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
        let light = Illumination::new(&scene.outline, &config);
        Self {
            columns: light::columns(&scene.camera, &scene.outline, &light, &config),
            scene: scene.clone(),
            config,
            light,
        }
    }
}
