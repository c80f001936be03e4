//! Constants of the optical model for the scene of a protocol.

use skinrig_protocol::{Scene, SimulatedSkin};
use skinrig_sim::optical::{OpticalConfig, Parts};

/// The model's constants with those that the scene changes.
pub(super) fn optical(scene: &Scene) -> OpticalConfig {
    let parts = Parts::of_paper(&scene.parts);
    let mut config = OpticalConfig::default();
    if let Some(skin) = scene.skin {
        config = OpticalConfig {
            attenuation_per_mm: 1.0 / skin.attenuation_length_mm,
            creep_fraction: skin.creep_share,
            creep_time_ms: 1e3 * skin.creep_time.as_secs_f64(),
            flank_gain: skin.flank_brightness,
            thinning_loss_per_mm: skin.light_loss * config.thinning_loss_per_mm,
            slope_loss_per_mm: skin.light_loss * config.slope_loss_per_mm,
            parts: of_skin(parts, &skin),
            ..config
        };
    } else {
        config.parts = parts;
    }
    match scene.noise {
        Some(noise) => config.with_noise(noise),
        None => config,
    }
}

/// The parts with the constants of the skin. A constant switches its part on; what the part needs besides is the paper's.
fn of_skin(parts: Parts, skin: &SimulatedSkin) -> Parts {
    let paper = Parts::PAPER;
    let mut found = parts;
    if skin.press_scatter_mm.is_some() || skin.depth_scatter.is_some() {
        let mut scatter = parts.press_scatter.unwrap_or_default();
        scatter.offset_mm = skin.press_scatter_mm.unwrap_or(scatter.offset_mm);
        scatter.depth = skin.depth_scatter.unwrap_or(scatter.depth);
        found.press_scatter = Some(scatter);
    }
    if let Some(share) = skin.weak_presses {
        found.weak_presses = paper.weak_presses;
        if let Some(weak) = &mut found.weak_presses {
            weak.share = share;
        }
    }
    if let Some(offset_mm) = skin.pod_offset_mm {
        found.pod_refraction = paper.pod_refraction;
        if let Some(pod) = &mut found.pod_refraction {
            pod.offset_mm = offset_mm;
        }
    }
    found
}
