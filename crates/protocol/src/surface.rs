//! How presses find the surface of the skin.

use serde::{Deserialize, Serialize};
use skinrig_model::HostDuration;
use skinrig_settings::{Choice, Collector, Field, Settings};

/// Source of the surface height of a press.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(tag = "surface", rename_all = "snake_case")]
pub enum Surface {
    /// At z = 0 of the skin's frame.
    #[default]
    Known,
    /// Where the force rises.
    Touch(TouchSearch),
}

impl Surface {
    /// True for [`Surface::Known`].
    #[must_use]
    pub const fn is_known(&self) -> bool {
        matches!(self, Self::Known)
    }
}

/// Settings of the surface search: from clearance height to `band_mm` above the frame's surface at the approach's speed,
/// then down at `speed_mm_s` until the force is `threshold_n` above that in free air.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Settings)]
pub struct TouchSearch {
    /// With `touch`: a force this far above that in free air is a contact. Friction hides less than about 0.1 N.
    #[setting(default = "0.2 N", above = 0, max = 12)]
    pub threshold_n: f64,
    /// With `touch`: this many samples in a row must be above the threshold.
    #[setting(default = "5", min = 1, max = 1000)]
    pub samples: u32,
    /// With `touch`: speed of the search.
    #[setting(default = "2 mm/s", above = 0, max = 10)]
    pub speed_mm_s: f64,
    /// With `touch`: largest distance of a touch from the frame's surface, above or below; the search starts and ends there.
    #[setting(default = "1 mm", above = 0, max = 10)]
    pub band_mm: f64,
    /// With `touch`: how long the force in free air is averaged at clearance height.
    #[setting(default = "300 ms", above = 0, max = 10)]
    pub tare: HostDuration,
}

/// How a press finds the surface.
#[derive(Settings)]
#[settings(name = "press", builds(Surface, PressKeys::surface))]
struct PressKeys {
    /// Source of the surface height.
    #[setting(default = "known")]
    surface: SurfaceWord,
    #[setting(flatten)]
    search: TouchSearch,
}

#[derive(Clone, Copy, Choice)]
enum SurfaceWord {
    /// At z = 0 of the frame.
    Known,
    /// Where the force rises; depths count from there, the floor limit stays where it is.
    Touch,
}

impl PressKeys {
    fn surface(self, _: &Field, _: &mut Collector) -> Option<Surface> {
        Some(match self.surface {
            SurfaceWord::Known => Surface::Known,
            SurfaceWord::Touch => Surface::Touch(self.search),
        })
    }
}
