//! Keys of the simulated scene.

use skinrig_model::{SceneNeed, SimLevel, scene::cheapest_level};
use skinrig_settings::{Collector, Field, Settings};

use crate::protocol::Scene;

/// Requirements for a simulated rig; set `needs`, `level` or both. The cheapest sufficient level is used.
#[derive(Settings)]
#[settings(name = "scene", no_default, finish = Self::sufficient)]
pub(crate) struct SceneKeys {
    /// Properties of the session that its user relies on.
    #[setting(items = 1..=7, at_least_one, example = "[event_rates, localisation]")]
    needs: Option<Vec<SceneNeed>>,
    /// The simulation level outright; must be sufficient for `needs`.
    #[setting(at_least_one)]
    level: Option<SimLevel>,
}

impl SceneKeys {
    /// The scene with its level decided.
    pub(crate) fn scene(self) -> Scene {
        let needs = self.needs.unwrap_or_default();
        Scene {
            level: self.level.unwrap_or_else(|| cheapest_level(&needs)),
            needs,
            level_is_named: self.level.is_some(),
        }
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
        let enough = cheapest_level(needs);
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
