//! Touch felt while a session is recorded: how, and what presses do then.

use serde::{Deserialize, Serialize};
use skinrig_model::{
    HostDuration, LEAST_PRESSES_OF_DEPTHS, LEAST_PRESSES_OF_REGIONS, PressRole, Reaction,
};
use skinrig_settings::{Collector, Field, Settings};

/// Feels touches while the session is recorded. The calibrating repetitions teach it; it feels from the first scored press on.
/// Scored presses are never learnt from, and the analysis after the run does not use what was felt.
#[derive(Settings)]
#[settings(name = "online")]
pub(crate) struct OnlineKeys {
    /// Touches felt on the idle skin, at most; the threshold of the detector keeps to it.
    #[setting(default = "0.13 Hz", min = 0.001, max = 10.0)]
    pub false_alarms_hz: f64,
    /// Time between two positions of a touch.
    #[setting(default = "10 ms", min = 0.005, max = 1.0)]
    pub position_every: HostDuration,
    /// What scored presses do when they are felt; nothing when absent.
    pub react: Option<ReactKeys>,
}

/// What a scored press does when it is felt. Safety never depends on it: every limit of the run stays, and a press that is not felt goes
/// on as planned.
#[derive(Settings)]
#[settings(name = "react")]
pub(crate) struct ReactKeys {
    /// What it does.
    #[setting(default = "stop")]
    pub then: Reaction,
    /// Only once the 95 % region of the position reaches no further than this; absent: as soon as a touch is felt.
    #[setting(above = 0.0, max = 100.0)]
    pub region_mm: Option<f64>,
    /// Only once the touch is felt to be this deep, or will be where the robot is already on its way; a press that lifts then does not go on
    /// to its own depth.
    #[setting(above = 0.0, max = 100.0)]
    pub depth_mm: Option<f64>,
}

/// How touches are felt while the session is recorded.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Online {
    /// False alarms per second, at most.
    pub false_alarms_hz: f64,
    /// Time between two positions of a touch.
    pub position_every: HostDuration,
    /// What scored presses do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub react: Option<React>,
}

/// What a press does when it is felt.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct React {
    /// What it does.
    pub then: Reaction,
    /// The longer semi-axis of the position's region is at most this, mm; `None`: a touch is felt.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub region_mm: Option<f64>,
    /// The touch is felt to be at least this deep, with the set point's way ahead of the tip, mm; `None`: at any depth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth_mm: Option<f64>,
}

/// What calibrates.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Taught {
    /// Presses that calibrate.
    pub(crate) presses: usize,
    /// Locations at which they do.
    pub(crate) places: usize,
    /// All locations.
    pub(crate) of: usize,
}

impl React {
    /// Reports a region or depth that is never known, since so few presses or places calibrate, and a depth that no press reaches.
    pub(crate) fn can_act(
        &self,
        taught: Taught,
        deepest_mm: f64,
        field: &Field,
        out: &mut Collector,
    ) {
        let teach = [
            (
                "region",
                self.region_mm,
                LEAST_PRESSES_OF_REGIONS,
                "how far a position may be off",
            ),
            (
                "depth",
                self.depth_mm,
                LEAST_PRESSES_OF_DEPTHS,
                "how deep a touch is",
            ),
        ];
        for (key, wanted, least, what) in teach {
            if wanted.is_none() || taught.presses >= least {
                continue;
            }
            let at = field.at(key);
            out.error(at.span, at.path.as_str(), "no press would react")
                .expected(format!(
                    "at least {least} calibration presses, which teach {what}"
                ))
                .found(taught.presses.to_string())
                .help(format!("calibrate with more repetitions or locations, or remove `{key}`: presses then react as soon as they are felt"));
        }
        let least = LEAST_PRESSES_OF_DEPTHS;
        let is_partial = taught.places < taught.of && taught.places < least;
        if self.depth_mm.is_some() && is_partial && taught.presses >= least {
            let at = field.at("depth");
            let message = "presses where none calibrates would not react";
            out.error(at.span, at.path.as_str(), message)
                .expected(format!("at least {least} calibration locations, which teach how deep a touch is at others, or all"))
                .found(format!("{} of {}", taught.places, taught.of))
                .help("calibrate at more locations, or remove `calibrate_at`");
        }
        if let Some(depth_mm) = self.depth_mm.filter(|mm| *mm >= deepest_mm) {
            let at = field.at("depth");
            out.error(at.span, at.path.as_str(), "no press would react")
                .expected(format!(
                    "less than the depth of the presses, {deepest_mm} mm: they never go deeper than planned"
                ))
                .found(format!("{depth_mm} mm"))
                .help("press deeper, or state a smaller depth");
        }
    }
}

impl OnlineKeys {
    /// The settings for a protocol with these repetitions; a finding if they calibrate late or never.
    pub(crate) fn online(
        &self,
        roles: &[PressRole],
        field: &Field,
        out: &mut Collector,
    ) -> Option<Online> {
        let last = roles.iter().rposition(|r| *r == PressRole::Calibrate);
        let first = roles.iter().position(|r| *r == PressRole::Score);
        let problem = match (last, first) {
            (None, _) => "no repetition calibrates",
            (Some(last), Some(first)) if last > first => {
                "a repetition calibrates after the first scored one"
            }
            _ => {
                return Some(Online {
                    false_alarms_hz: self.false_alarms_hz,
                    position_every: self.position_every,
                    react: self.react.as_ref().map(|react| React {
                        then: react.then,
                        region_mm: react.region_mm,
                        depth_mm: react.depth_mm,
                    }),
                });
            }
        };
        out.error(field.span, field.path.as_str(), problem)
            .expected("calibrating repetitions before all scored ones: they teach what a touch is")
            .found(match last {
                None => "no calibrating repetition".to_owned(),
                Some(last) => format!("repetition {} calibrates", last + 1),
            })
            .help("list the first repetitions in `evaluation.calibrate`");
        None
    }
}
