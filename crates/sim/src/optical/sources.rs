//! Where each constant of the scene `paper` comes from.

use skinrig_model::ScenePart;

/// Source of a constant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// A text.
    Read(&'static str),
    /// A recording.
    Measured(&'static str),
    /// Chosen so that the scene has these published figures.
    Fitted(&'static str),
    /// None: a plausible value.
    Assumed(&'static str),
}

/// A constant of a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parameter {
    /// The part.
    pub part: ScenePart,
    /// Name of the constant within the part.
    pub name: &'static str,
    /// Its source.
    pub source: Source,
}

const RECORDING: &str =
    "a public recording of an EVK1 Gen3 (test data of the faery project, 521,252 events in 96 ms)";

const fn of(part: ScenePart, name: &'static str, source: Source) -> Parameter {
    Parameter { part, name, source }
}

/// Every constant of [`Parts::PAPER`](super::Parts::PAPER).
pub const PARAMETERS: [Parameter; 26] = {
    use ScenePart::{
        DarkLatency, PodRefraction, PressScatter, Readout, SlowRecovery, UnevenLight, UnevenNoise,
        UnevenPixels, WeakPresses,
    };
    use Source::{Assumed, Fitted, Measured, Read};
    [
        of(
            PressScatter,
            "offset_mm",
            Fitted("standard deviation between repetitions"),
        ),
        of(PressScatter, "depth", Assumed("")),
        of(WeakPresses, "share", Fitted("share located")),
        of(WeakPresses, "depth", Fitted("share located")),
        of(SlowRecovery, "fraction", Assumed("soft 30:1 silicone")),
        of(SlowRecovery, "time_ms", Assumed("soft 30:1 silicone")),
        of(
            PodRefraction,
            "index",
            Read("textbook value of silicone (PDMS)"),
        ),
        of(PodRefraction, "radius_mm", Assumed("lens of some mm")),
        of(PodRefraction, "offset_mm", Fitted("RMSE")),
        of(UnevenLight, "emitters", Assumed("")),
        of(UnevenLight, "cloud", Assumed("")),
        of(UnevenLight, "cloud_mm", Assumed("")),
        of(UnevenPixels, "threshold", Fitted("event rate of presses")),
        of(
            UnevenPixels,
            "threshold_sigma",
            Assumed("as in the base model"),
        ),
        of(UnevenPixels, "refractory_least_us", Measured(RECORDING)),
        of(
            UnevenPixels,
            "refractory_mean_us",
            Assumed("as in the base model"),
        ),
        of(
            UnevenNoise,
            "leak_hz",
            Fitted("RMSE, also at 1/1024 (not reached)"),
        ),
        of(
            UnevenNoise,
            "shot_hz",
            Fitted("RMSE, also at 1/1024 (not reached)"),
        ),
        of(UnevenNoise, "dark_hz", Fitted("event rate between presses")),
        of(UnevenNoise, "hot_pixels", Assumed("")),
        of(UnevenNoise, "hot_hz", Fitted("RMSE")),
        of(UnevenNoise, "hot_ratio", Assumed("")),
        of(
            DarkLatency,
            "bright_us",
            Assumed("the sensor's nominal 200 us"),
        ),
        of(DarkLatency, "most_us", Assumed("")),
        of(Readout, "rows_per_us", Measured(RECORDING)),
        of(Readout, "events_per_us", Measured(RECORDING)),
    ]
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optical::Parts;

    #[test]
    fn every_constant_has_a_source() {
        let parts = serde_json::to_value(Parts::PAPER).unwrap();
        let mut named: Vec<(String, String)> = Vec::new();
        for (part, constants) in parts.as_object().unwrap() {
            for name in constants.as_object().unwrap().keys() {
                named.push((part.clone(), name.clone()));
            }
        }
        let mut listed: Vec<_> = PARAMETERS
            .iter()
            .map(|p| (p.part.name().to_owned(), p.name.to_owned()))
            .collect();
        named.sort();
        listed.sort();
        assert_eq!(named, listed);
    }

    #[test]
    fn the_paper_has_every_part_and_each_is_switched_alone() {
        assert_eq!(Parts::of_paper(&ScenePart::ALL), Parts::PAPER);
        assert_eq!(Parts::of_paper(&[]), Parts::default());
        for part in ScenePart::ALL {
            let parts = serde_json::to_value(Parts::of_paper(&[part])).unwrap();
            let on: Vec<_> = parts.as_object().unwrap().keys().cloned().collect();
            assert_eq!(on, [part.name()]);
        }
        assert_eq!(Parts::default().label(), None);
        assert_eq!(Parts::PAPER.label().as_deref(), Some("scene paper"));
        let label = Parts::of_paper(&ScenePart::ALL[..8]).label();
        assert_eq!(label.as_deref(), Some("scene paper without readout"));
    }
}
