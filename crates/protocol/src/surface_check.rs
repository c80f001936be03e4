//! The surface check: touches the skin before the first press and compares the surface with the frame.

use serde::{Deserialize, Serialize};
use skinrig_model::Point2;
use skinrig_settings::{Choice, Collector, Field, Settings};

use crate::surface::{Surface, TouchSearch};

/// Touches the skin before the first press, and ends the run if the surface is not where the frame puts it. Needs a robot that
/// reports force.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Settings)]
pub struct SurfaceCheck {
    /// Points to touch, skin frame. The touch uses the settings of `press`, or its defaults if `press` is `known` or absent.
    #[setting(items = 1..=100)]
    pub points: Vec<Point2>,
    /// Largest distance of the touched surface from z = 0. A touch on a soft skin lies about threshold / stiffness below its
    /// surface.
    #[setting(default = "0.3 mm", above = 0, max = 10)]
    pub tolerance_mm: f64,
    /// When to touch.
    #[setting(key = "at", default = "start", through = CheckTime)]
    pub each_repetition: bool,
    /// Settings of a touch.
    #[setting(skip)]
    pub search: TouchSearch,
}

#[derive(Clone, Copy, Choice)]
enum CheckTime {
    /// Before the first press.
    Start,
    /// Before the first press and at the end of each repetition.
    EachRepetition,
}

impl From<CheckTime> for bool {
    fn from(time: CheckTime) -> Self {
        matches!(time, CheckTime::EachRepetition)
    }
}

impl SurfaceCheck {
    /// The check with the touch settings of `press`. `field` is the mapping of the check.
    pub(crate) fn touching(
        self,
        press: Option<&Surface>,
        field: &Field,
        out: &mut Collector,
    ) -> Option<Self> {
        let search = match press {
            Some(Surface::Touch(search)) => *search,
            Some(Surface::Known) | None => TouchSearch::default(),
        };
        if self.tolerance_mm >= search.band_mm {
            let at = field.at("tolerance");
            out.error(
                at.span,
                at.path.as_str(),
                "the search would miss a surface beyond the tolerance",
            )
            .expected(format!(
                "less than {} mm, the band in which the surface is searched (`press.band`)",
                search.band_mm
            ))
            .found(format!("{} mm", self.tolerance_mm));
            return None;
        }
        Some(Self { search, ..self })
    }
}
