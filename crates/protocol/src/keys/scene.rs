//! Keys of the simulated scene.

use skinrig_model::level_bias::{
    CONDITIONS, LevelBias, SceneFigure, Tolerance, cheapest_level, level_bias,
};
use skinrig_model::{HostDuration, Point2, SceneNeed, ScenePart, SimLevel};
use skinrig_settings::{Collector, Field, Settings};

use super::camera::{NominalCamera, rays_meet};
use crate::protocol::{Scene, SimulatedSkin};

/// Default needs of a scene: event rates and the position of a press in the picture.
const USUAL_NEEDS: [SceneNeed; 2] = [SceneNeed::EventRates, SceneNeed::Localisation];

/// The simulated rig. The cheapest level that satisfies all of it is used.
#[derive(Settings)]
#[settings(name = "scene", finish = Self::sufficient)]
pub(crate) struct SceneKeys {
    /// Properties of the session that its user relies on; `[event_rates, localisation]` when neither `needs`, `tolerances` nor `level` is set.
    #[setting(items = 1..=7, example = "[event_rates, localisation]")]
    needs: Option<Vec<SceneNeed>>,
    /// How far figures of the session may be from those of the optical level, as measured over simulated skins with the published
    /// cameras, 2 mm deep.
    tolerances: Option<ToleranceKeys>,
    /// The simulation level outright; must be sufficient for `needs` and `tolerances`.
    level: Option<SimLevel>,
    /// Physics added to the optical level, fitted to the published figures (protocols/paper.md). All of it is the
    /// scene `paper`.
    #[setting(items = 1..=9, example = "[press_scatter, uneven_noise]")]
    parts: Option<Vec<ScenePart>>,
    /// A skin other than the published one. Needs the optical level.
    skin: Option<SkinKeys>,
    /// Random events of the pixels, relative to the model's. Needs the optical level.
    #[setting(min = 0.01, max = 100.0, example = "1.5")]
    noise: Option<f64>,
    /// The session that this scene was fitted to, as `skinrig twin` writes it. Needs the optical level.
    #[setting(example = "K7-03")]
    twin_of: Option<String>,
    /// Cameras at other places than in the published setup.
    cameras: Option<SceneCameras>,
}

/// The most that a cheaper level may differ from the optical one. A level counts as within when the 95 % interval of its measured
/// difference is.
#[derive(Settings)]
#[settings(name = "scene_tolerances")]
pub(crate) struct ToleranceKeys {
    /// RMSE of the scored presses.
    #[setting(at_least_one, min = 0.0, max = 100.0, example = "0.2 mm")]
    localisation_rmse_mm: Option<f64>,
    /// Median delay from contact to detection.
    #[setting(at_least_one, min = 0.0, max = 10.0, example = "1 ms")]
    latency: Option<HostDuration>,
    /// Events per second while the tip presses.
    #[setting(at_least_one, min = 0.0, max = 1000.0, example = "10 %")]
    event_rate_percent: Option<f64>,
    /// Events per second between presses.
    #[setting(at_least_one, min = 0.0, max = 1000.0, example = "10 %")]
    idle_rate_percent: Option<f64>,
}

impl ToleranceKeys {
    fn all(&self) -> Vec<Tolerance> {
        [
            (SceneFigure::LocalisationRmse, self.localisation_rmse_mm),
            (
                SceneFigure::Latency,
                self.latency.map(|t| t.as_secs_f64() * 1e3),
            ),
            (SceneFigure::EventRate, self.event_rate_percent),
            (SceneFigure::IdleRate, self.idle_rate_percent),
        ]
        .into_iter()
        .filter_map(|(figure, most)| {
            Some(Tolerance {
                figure,
                most: most?,
            })
        })
        .collect()
    }
}

/// The simulated skin; what is missing is as in the model of the published one (docs/explanation/optical-model.md).
#[derive(Settings)]
#[settings(name = "simulated_skin")]
pub(crate) struct SkinKeys {
    /// Thickness. The paper: 4 mm.
    #[setting(default = "4 mm", min = 0.5, max = 50.0)]
    thickness_mm: f64,
    /// Length over which guided light fades to 1/e: shorter in cloudier material.
    #[setting(default = "100 mm", min = 5.0, max = 10_000.0)]
    attenuation_length_mm: f64,
    /// Part of a press's effect that follows slowly, and fades slowly after it.
    #[setting(default = "30 %", min = 0.0, max = 100.0)]
    creep_percent: f64,
    /// Time constant of that part.
    #[setting(default = "700 ms", above = 0.0, max = 60.0)]
    creep_time: HostDuration,
    /// Brightness of the flanks of a dent, relative to a matt white flank. Cameras detect a press by these flanks.
    #[setting(default = "1.8", min = 0.1, max = 10.0)]
    flank_brightness: f64,
    /// Light that a dent takes away, relative to the published skin.
    #[setting(default = "1", min = 0.01, max = 100.0)]
    light_loss: f64,
    /// Standard deviation of the dent's position about the tip, per axis, from press to press. Without: that of the part
    /// `press_scatter`, if it is listed.
    #[setting(min = 0.0, max = 20.0, example = "1.2 mm")]
    press_scatter_mm: Option<f64>,
    /// Standard deviation of the dent's depth, as a share of the depth, from press to press. Without: that of the part
    /// `press_scatter`, if it is listed.
    #[setting(min = 0.0, max = 50.0, example = "8 %")]
    depth_scatter_percent: Option<f64>,
    /// Share of the presses that dent the skin little. Without: that of the part `weak_presses`, if it is listed.
    #[setting(min = 0.0, max = 100.0, example = "3 %")]
    weak_presses_percent: Option<f64>,
    /// Distance of the round pod's centre from the lens. Without: that of the part `pod_refraction`, if it is listed.
    #[setting(min = 0.0, max = 2.9, example = "1 mm")]
    pod_offset_mm: Option<f64>,
}

/// The simulated cameras as drawn; the true ones differ a little, by the run's seed.
#[derive(Settings)]
#[settings(name = "scene_cameras")]
pub(crate) struct SceneCameras {
    /// Camera 1.
    #[setting(example = "{position: [45 mm, -38 mm], half_field_of_view: 60 deg}")]
    camera1: NominalCamera,
    /// Camera 2.
    #[setting(example = "{position: [45 mm, 42 mm], half_field_of_view: 60 deg}")]
    camera2: NominalCamera,
}

impl SceneKeys {
    /// The scene with its level decided. Cameras aim at `centre` unless the file says otherwise. Differences between levels are known for
    /// presses as measured.
    pub(crate) fn scene(self, centre: Point2, is_measured: bool) -> Scene {
        let is_optical = self.optical_key().is_some();
        let tolerances = self.tolerances.as_ref().map(ToleranceKeys::all);
        let needs = match (self.needs, self.level, &tolerances) {
            (Some(needs), ..) => needs,
            (None, None, None) => USUAL_NEEDS.to_vec(),
            (None, ..) => Vec::new(),
        };
        let tolerances = tolerances.unwrap_or_default();
        let is_known = is_measured && self.cameras.is_none();
        let unmeasured = !is_known && !tolerances.is_empty();
        let own_level = (is_optical || unmeasured).then_some(SimLevel::Optical);
        Scene {
            level: self
                .level
                .or(own_level)
                .unwrap_or_else(|| cheapest_level(&needs, &tolerances)),
            needs,
            tolerances,
            level_is_named: self.level.is_some(),
            parts: self.parts.unwrap_or_default(),
            skin: self.skin.map(SkinKeys::skin),
            noise: self.noise,
            twin_of: self.twin_of,
            cameras: self
                .cameras
                .map(|c| [c.camera1.model(centre), c.camera2.model(centre)]),
        }
    }

    /// The key that only the optical level models, if there is one.
    fn optical_key(&self) -> Option<&'static str> {
        let keys = [
            ("skin", self.skin.is_some()),
            ("parts", self.parts.is_some()),
            ("noise", self.noise.is_some()),
            ("twin_of", self.twin_of.is_some()),
        ];
        keys.into_iter()
            .find(|(_, given)| *given)
            .map(|(key, _)| key)
    }

    fn sufficient(self, field: &Field, out: &mut Collector) -> Option<Self> {
        let needs = self.needs.as_deref().unwrap_or_default();
        for (i, (need, item)) in needs.iter().zip(field.at("needs").items()).enumerate() {
            if needs.iter().take(i).any(|earlier| earlier == need) {
                out.error(item.span, item.path.as_str(), "the need is given twice")
                    .expected("each need once")
                    .found(format!("`{}`", need.name()));
            }
        }
        let parts = self.parts.as_deref().unwrap_or_default();
        for (i, (part, item)) in parts.iter().zip(field.at("parts").items()).enumerate() {
            if parts.iter().take(i).any(|earlier| earlier == part) {
                out.error(item.span, item.path.as_str(), "the part is given twice")
                    .expected("each part once")
                    .found(format!("`{}`", part.name()));
            }
        }
        if let Some(level) = self.level
            && level < SimLevel::Optical
            && let Some(key) = self.optical_key()
        {
            let at = field.at("level");
            out.error(at.span, "scene.level", "this level does not model the skin")
                .expected(format!("`optical`, because of `scene.{key}`"))
                .found(format!("`{level}`"))
                .help("write `level: optical`, or remove the key: the cheapest sufficient level is chosen");
        }
        if let Some(level) = self.level {
            self.within_tolerances(level, field, out);
        }
        let enough = cheapest_level(needs, &[]);
        if let Some(level) = self.level.filter(|level| *level < enough)
            && let Some(need) = needs.iter().find(|n| n.level() > level)
        {
            let at = field.at("level");
            out.error(at.span, "scene.level", "the level does not meet the needs of the scene")
                .expected(format!("`{enough}`, because of the need `{}`", need.name()))
                .found(format!("`{level}`"))
                .help(format!(
                    "write `level: {enough}`, or remove the key: the cheapest sufficient level is chosen"
                ));
        }
        Some(self)
    }
}

impl SceneKeys {
    /// Reports drawn cameras that see no angles.
    pub(crate) fn cameras_see(
        &self,
        locations: &[Point2],
        centre: Point2,
        least_sine: f64,
        field: &Field,
        out: &mut Collector,
    ) {
        let Some(SceneCameras { camera1, camera2 }) = &self.cameras else {
            return;
        };
        let one = camera1.checked(centre, field.at("camera1"), out);
        let two = camera2.checked(centre, field.at("camera2"), out);
        if let (Some(one), Some(two)) = (one, two) {
            rays_meet([&one, &two], locations, least_sine, field, out);
        }
    }

    /// Refuses a named level with tolerances where the differences between levels are not measured.
    pub(crate) fn within_measured(&self, is_measured: bool, field: &Field, out: &mut Collector) {
        let Some(level) = self.level.filter(|level| *level < SimLevel::Optical) else {
            return;
        };
        if is_measured || self.tolerances.is_none() {
            return;
        }
        let at = field.at("level");
        out.error(
            at.span,
            "scene.level",
            "the level's differences are not measured for these presses or this analysis",
        )
        .expected(format!("`optical`, or presses as measured: {CONDITIONS}"))
        .found(format!("`{level}` for other presses"))
        .help("remove `level`: the optical level is chosen");
    }

    fn within_tolerances(&self, level: SimLevel, field: &Field, out: &mut Collector) {
        let tolerances = self.tolerances.as_ref().map(ToleranceKeys::all);
        let is_measured = self.cameras.is_none() || level == SimLevel::Optical;
        let beyond = |t: &Tolerance| !is_measured || !t.allows(level);
        let Some(tolerance) = tolerances.unwrap_or_default().into_iter().find(beyond) else {
            return;
        };
        let (name, unit) = (tolerance.figure.name(), tolerance.figure.unit());
        let difference = level_bias(level, tolerance.figure).map_or_else(
            || "which has no events".to_owned(),
            |LevelBias { mean, low, high }| {
                if !is_measured {
                    return "whose difference is not measured for other cameras".to_owned();
                }
                format!("whose difference is {mean} {unit}, 95 % interval [{low}, {high}]")
            },
        );
        let at = field.at("level");
        out.error(
            at.span,
            "scene.level",
            "the level does not meet the tolerances of the scene",
        )
        .expected(format!(
            "a level within `{name}: {} {unit}` of the optical one",
            tolerance.most
        ))
        .found(format!("`{level}`, {difference}"))
        .help("remove `level`: the cheapest sufficient level is chosen");
    }
}

impl SkinKeys {
    fn skin(self) -> SimulatedSkin {
        SimulatedSkin {
            thickness_mm: self.thickness_mm,
            attenuation_length_mm: self.attenuation_length_mm,
            creep_share: self.creep_percent / 100.0,
            creep_time: self.creep_time,
            flank_brightness: self.flank_brightness,
            light_loss: self.light_loss,
            press_scatter_mm: self.press_scatter_mm,
            depth_scatter: self.depth_scatter_percent.map(|p| p / 100.0),
            weak_presses: self.weak_presses_percent.map(|p| p / 100.0),
            pod_offset_mm: self.pod_offset_mm,
        }
    }
}
