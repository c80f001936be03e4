//! Assembles a simulated rig.

use skinrig_device::{CameraSettings, EventCamera, Rig, TriggerBox};
use skinrig_model::level_bias::{SceneFigure, level_bias};
use skinrig_model::{CameraId, LensKind, RigGeometry, SimLevel, StereoGeometry};

use crate::camera::{PixelFactory, SimCamera};
use crate::clock::{BoxedClock, PacedClock};
use crate::config::SimConfig;
use crate::faults::Fault;
use crate::geometric::GeometricModel;
use crate::indenter::SimIndenter;
use crate::line::TRIGGER_CHANNEL;
use crate::optical::OpticalModel;
use crate::scene::{PixelModel, SceneConfig};
use crate::stalling_clock::StallingClock;
use crate::trigger::SimTriggerBox;
use crate::world::Shared;

/// Tells after a run which faults of a simulated rig came due.
#[derive(Debug, Clone)]
pub struct FaultWatch {
    shared: Shared,
    faults: Vec<Fault>,
}

impl FaultWatch {
    /// For each fault of the configuration, whether its time has come. Presses and pulses that were configured to fail always count.
    #[must_use]
    pub fn have_struck(&self) -> Vec<bool> {
        let world = self.shared.world();
        let struck = |fault: &Fault| fault.when().is_none_or(|when| world.has_occurred(when));
        self.faults.iter().map(struck).collect()
    }
}

/// The rig of `config` at time 0 with a simulated clock.
#[must_use]
pub fn simulated_rig(config: &SimConfig) -> Rig {
    watched_rig(config).0
}

/// Like [`simulated_rig`], with the watch over its faults.
#[must_use]
pub fn watched_rig(config: &SimConfig) -> (Rig, FaultWatch) {
    let shared = Shared::new(config);
    let watch = FaultWatch {
        shared: shared.clone(),
        faults: config.faults.clone(),
    };
    (rig_in(&shared, config), watch)
}

fn rig_in(shared: &Shared, config: &SimConfig) -> Rig {
    let camera = |id: CameraId| -> Box<dyn EventCamera> {
        let pixels = pixel_factory(config, id);
        Box::new(SimCamera::new(config, id, shared.clone(), pixels))
    };
    let settings = CameraSettings {
        trigger_channels: vec![TRIGGER_CHANNEL],
        ..CameraSettings::default()
    };
    let trigger_box: Box<dyn TriggerBox> = Box::new(SimTriggerBox::new(config, shared.clone()));
    Rig {
        kind: "simulated".to_owned(),
        name: name(config),
        indenter: Box::new(SimIndenter::new(config, shared.clone())),
        cameras: CameraId::ALL.map(camera),
        camera_settings: [settings.clone(), settings],
        trigger_box: Some(trigger_box),
        clock: match StallingClock::new(shared.clone(), config) {
            Some(stalling) => Box::new(stalling),
            None => Box::new(shared.clock.clone()),
        },
        robot_from_skin: config.robot_from_skin,
        geometry: RigGeometry {
            outline: config.outline,
            nominal: config.nominal,
            trigger_channel: Some(TRIGGER_CHANNEL),
            trigger_delay_us: [0; 2],
        },
        description_json: describe(config),
    }
}

/// Slows the clock of `rig` down to real time.
#[must_use]
pub fn in_real_time(mut rig: Rig) -> Rig {
    rig.clock = Box::new(PacedClock::new(BoxedClock(rig.clock)));
    rig
}

/// Level and scene.
fn name(config: &SimConfig) -> String {
    let is_optical = config.level == SimLevel::Optical;
    let scene = match &config.twin_of {
        Some(session) => Some(format!("twin of {session}")),
        None => config.optical.parts.label(),
    };
    match scene.filter(|_| is_optical) {
        Some(scene) => format!("simulated ({}, {scene})", config.level),
        None => format!("simulated ({})", config.level),
    }
}

fn pixel_factory(config: &SimConfig, id: CameraId) -> PixelFactory {
    let scene = config.scene(id);
    let level = config.level;
    let optical = config.optical;
    let mut geometric = config.geometric.clone();
    for fault in &config.faults {
        if let Fault::DeadPress { camera, contact } = *fault
            && camera == id
        {
            geometric.dead_contacts.push(contact);
        }
    }
    Box::new(move |start| -> Option<Box<dyn PixelModel>> {
        let scene = SceneConfig {
            start: scene.start + start,
            ..scene.clone()
        };
        match level {
            SimLevel::Kinematic => None,
            SimLevel::Geometric => Some(Box::new(GeometricModel::new(&scene, &geometric))),
            SimLevel::Optical => Some(Box::new(OpticalModel::build(&scene, optical, 1))),
        }
    })
}

/// The complete configuration as JSON: nominal and true geometry, all constants, and the seed.
#[must_use]
pub fn describe(config: &SimConfig) -> String {
    let cameras = |g: &StereoGeometry| -> Vec<serde_json::Value> {
        g.cameras
            .iter()
            .map(|c| {
                let (half_fov_deg, w) = c.lens.coefficients();
                let mut camera = serde_json::json!({
                    "position_mm": [c.position.x_mm, c.position.y_mm],
                    "aim_mm": [c.aim.x_mm, c.aim.y_mm],
                    "skew_deg": c.skew_deg,
                    "half_fov_deg": half_fov_deg,
                    "w": w,
                });
                // Omit the paper's lens, which is the default.
                if c.lens.kind() != LensKind::Exponential {
                    camera["lens"] = serde_json::json!(c.lens.kind());
                }
                camera
            })
            .collect()
    };
    let (m, c, t, g) = (
        &config.motion,
        &config.camera_clock,
        &config.trigger_box,
        &config.geometric,
    );
    let mut value = serde_json::json!({
        "kind": "simulated",
        "level": config.level.name(),
        "seed": config.seed,
        "drawn_cameras": cameras(&config.nominal),
        "true_cameras": cameras(&config.true_geometry()),
        "geometry_errors": {
            "position_mm": config.geometry_errors.position_mm,
            "skew_deg": config.geometry_errors.skew_deg,
            "w": config.geometry_errors.w,
        },
        "workspace_mm": [config.workspace_mm.0, config.workspace_mm.1],
        "start_mm": config.start.to_array(),
        "skin_rows": config.skin_rows,
        "tip_side_mm": config.tip_side_mm,
        "skin_thickness_mm": config.skin_thickness_mm,
        "motion": {
            "acceleration_mm_s2": m.acceleration_mm_s2,
            "lag_rad_s": m.lag_rad_s,
            "damping": m.damping,
            "wander_mm": m.wander_mm,
            "wander_s": m.wander_s,
            "measurement_mm": m.measurement_mm,
            "force_noise_n": m.force_noise_n,
            "skin_n_per_mm": m.skin_n_per_mm,
            "skin_n_s_per_mm": m.skin_n_s_per_mm,
        },
        "camera_clock": {
            "max_drift_ppm": c.max_drift_ppm,
            "max_origin_s": c.max_origin_s,
            "trigger_jitter_ns": c.trigger_jitter_ns,
            "chunk_bytes": c.chunk_bytes,
            "buffer_bytes": c.buffer_bytes,
        },
        "trigger_box": {
            "min_latency_ns": t.min_latency_ns,
            "max_latency_ns": t.max_latency_ns,
            "max_drift_ppm": t.max_drift_ppm,
            "max_origin_s": t.max_origin_s,
            "sync_period_ms": t.sync_period_ms,
            "exchange_period_ms": t.exchange_period_ms,
            "min_delay_us": t.min_delay_us,
            "mean_delay_us": t.mean_delay_us,
            "contact_input": t.contact_input,
        },
        "faults": config.faults.iter().map(|f| f.to_string()).collect::<Vec<_>>(),
    });
    if config.level == SimLevel::Geometric {
        value["geometric"] = serde_json::json!({
            "press_per_mm": g.press_per_mm,
            "release_per_mm": g.release_per_mm,
            "relax_per_mm": g.relax_per_mm,
            "relax_s": g.relax_s,
            "polarity_share": g.polarity_share,
            "reference_mm": g.reference_mm,
            "fall_off_mm": g.fall_off_mm,
            "halo_mm": g.halo_mm,
            "row_share": g.row_share,
            "background_hz": g.background_hz,
            "hot_pixels": g.hot_pixels,
            "hottest_hz": g.hottest_hz,
            "dead_share": g.dead_share,
            "strength_spread": g.strength_spread,
        });
    }
    let against: serde_json::Map<_, _> = SceneFigure::ALL
        .into_iter()
        .filter_map(|figure| {
            let bias = level_bias(config.level, figure)?;
            Some((figure.name().to_owned(), serde_json::json!(bias)))
        })
        .collect();
    if config.level != SimLevel::Optical && !against.is_empty() {
        value["against_optical"] = serde_json::Value::Object(against);
    }
    if config.level == SimLevel::Optical {
        value["optical"] = serde_json::json!(config.optical);
    }
    value.to_string()
}
