//! Constants of the optical scene that a twin fits, and what is assumed of them before.

use serde::{Deserialize, Serialize};
use skinrig_statistics::seeded;

/// Stream of random numbers of the draws.
const DRAWS: u64 = 0x7477_696e;
/// Draws stay off the ends of the range, whose logit is infinite.
const WITHIN: f64 = 0.999_999;

/// A constant of the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TwinConstant {
    /// Light that a dent takes away, relative to the published skin.
    LightLoss,
    /// Brightness of the flanks of a dent.
    FlankBrightness,
    /// Length over which guided light fades to 1/e, mm.
    AttenuationLength,
    /// Part of a press's effect that follows slowly, %.
    Creep,
    /// Time constant of that part, s.
    CreepTime,
    /// Standard deviation of the dent's position from press to press, mm.
    PressScatter,
    /// Standard deviation of its depth from press to press, %.
    DepthScatter,
    /// Share of weak presses, %.
    WeakPresses,
    /// Distance of the pod's centre from the lens, mm.
    PodOffset,
    /// Random events of the pixels, relative to the model's.
    Noise,
}

/// How values are spread over their range before a session is seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Prior {
    Uniform,
    /// Of the logarithm.
    LogUniform,
}

impl TwinConstant {
    /// All, in the order of the tables.
    pub const ALL: [Self; 10] = [
        Self::LightLoss,
        Self::FlankBrightness,
        Self::AttenuationLength,
        Self::Creep,
        Self::CreepTime,
        Self::PressScatter,
        Self::DepthScatter,
        Self::WeakPresses,
        Self::PodOffset,
        Self::Noise,
    ];

    /// The protocol's key.
    #[must_use]
    pub const fn key(self) -> &'static str {
        match self {
            Self::LightLoss => "scene.skin.light_loss",
            Self::FlankBrightness => "scene.skin.flank_brightness",
            Self::AttenuationLength => "scene.skin.attenuation_length",
            Self::Creep => "scene.skin.creep",
            Self::CreepTime => "scene.skin.creep_time",
            Self::PressScatter => "scene.skin.press_scatter",
            Self::DepthScatter => "scene.skin.depth_scatter",
            Self::WeakPresses => "scene.skin.weak_presses",
            Self::PodOffset => "scene.skin.pod_offset",
            Self::Noise => "scene.noise",
        }
    }

    /// Unit of the values; empty for a ratio.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::LightLoss | Self::FlankBrightness | Self::Noise => "",
            Self::Creep | Self::DepthScatter | Self::WeakPresses => "%",
            Self::CreepTime => "s",
            Self::AttenuationLength | Self::PressScatter | Self::PodOffset => "mm",
        }
    }

    /// Range before a session is seen (assumed: about the published skin, from a nearly perfect skin to one worse than it; none without any scatter).
    #[must_use]
    pub const fn range(self) -> (f64, f64) {
        self.prior().0
    }

    const fn prior(self) -> ((f64, f64), Prior) {
        use Prior::{LogUniform, Uniform};
        match self {
            Self::LightLoss => ((0.4, 2.5), LogUniform),
            Self::FlankBrightness => ((0.6, 5.0), LogUniform),
            Self::AttenuationLength => ((30.0, 300.0), LogUniform),
            Self::Creep => ((0.0, 60.0), Uniform),
            Self::CreepTime => ((0.1, 3.0), LogUniform),
            Self::PressScatter => ((0.05, 3.0), LogUniform),
            Self::DepthScatter => ((0.0, 30.0), Uniform),
            Self::WeakPresses => ((0.0, 12.0), Uniform),
            Self::PodOffset => ((0.05, 2.5), LogUniform),
            Self::Noise => ((0.2, 5.0), LogUniform),
        }
    }

    /// Value at a share of the range's probability, 0 to 1.
    #[must_use]
    pub fn at(self, share: f64) -> f64 {
        let ((low, high), prior) = self.prior();
        match prior {
            Prior::Uniform => low + share * (high - low),
            Prior::LogUniform => low * libm::exp(share * libm::log(high / low)),
        }
    }

    /// A draw of all constants, as shares of their ranges' probability, above 0 and below 1. Equal seeds draw alike.
    #[must_use]
    pub fn draw(seed: u64) -> Vec<f64> {
        let mut random = seeded::generator(seed, DRAWS);
        let share = |_: &Self| 0.5 + 0.5 * seeded::signed_unit(&mut random) * WITHIN;
        Self::ALL.iter().map(share).collect()
    }

    /// The setting of a protocol, as `key=value`, with four significant digits.
    #[must_use]
    pub fn setting(self, share: f64) -> String {
        let value = self.at(share);
        let digits = 3 - libm::floor(libm::log10(value.max(1e-9))) as i32;
        let text = format!("{value:.*}", digits.clamp(0, 6) as usize);
        format!("{}={text} {}", self.key(), self.unit())
            .trim_end()
            .to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_stay_within_their_range() {
        for constant in TwinConstant::ALL {
            let (low, high) = constant.range();
            let near = |a: f64, b: f64| (a - b).abs() < 1e-9 * b.abs().max(1.0);
            assert!(near(constant.at(0.0), low) && near(constant.at(1.0), high));
            assert!(constant.at(0.5) > low && constant.at(0.5) < high);
        }
    }

    #[test]
    fn settings_carry_key_value_and_unit() {
        assert_eq!(TwinConstant::Creep.setting(0.5), "scene.skin.creep=30.00 %");
        assert_eq!(TwinConstant::Noise.setting(0.5), "scene.noise=1.000");
        assert_eq!(
            TwinConstant::PressScatter.setting(0.0),
            "scene.skin.press_scatter=0.05000 mm"
        );
    }
}
