//! Which warnings concern every number.

use super::quiet_part::QuietPart;
use super::warning::WarningCause;

impl WarningCause {
    /// Whether something else was done or counted than was asked for, which concerns every number.
    #[must_use]
    pub const fn is_grave(&self) -> bool {
        matches!(
            self,
            Self::NotSealed
                | Self::WithoutReaction { .. }
                | Self::UndecidedLooks { .. }
                | Self::WindowsOverlap
                | Self::UnsuitableSettings { .. }
                | Self::UnusedSetting { .. }
                | Self::RepeatedPositions { .. }
                | Self::CameraChanged(_)
                | Self::Readout(_)
                | Self::FewDecide { .. }
                | Self::LeftOutUnknown { .. }
                | Self::LocatorUnfit { .. }
                | Self::FewLocationsForModel { .. }
                | Self::ImplausibleModel { .. }
                | Self::QuietPart(QuietPart {
                    presses: Some(_),
                    ..
                })
        )
    }
}
