//! Conditions that suspend a run until a disturbance is over.

use serde::{Deserialize, Serialize};
use skinrig_model::HostDuration;

use skinrig_settings::{Choice, Collector, Field, Setting, Settings, ValueRange};

/// Conditions that suspend the run at clearance height until they are over.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Settings)]
pub struct Suspend {
    /// An event storm: the rate of either camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[setting(shape = Storm::SHAPE, read = Storm::threshold)]
    pub event_rate: Option<Threshold>,
    /// A dark or covered scene: the event rate of either camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[setting(shape = Dark::SHAPE, read = Dark::threshold)]
    pub dark: Option<Threshold>,
    /// Lost data of either camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[setting(shape = Loss::SHAPE, read = Loss::threshold)]
    pub lost_bytes: Option<Threshold>,
    /// Free space where the session is written.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[setting(shape = FreeSpace::SHAPE, read = FreeSpace::threshold)]
    pub disk_free: Option<Threshold>,
    /// Temperature of either camera; a camera that does not report it is not monitored. The camera's maker states the limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[setting(shape = Heat::SHAPE, read = Heat::threshold)]
    pub temperature: Option<Threshold>,
    /// How the current press is handled.
    #[setting(default = "finish")]
    pub press: PressHandling,
    /// How long every condition must be over before the run continues.
    #[setting(default = "5 s", above = 0, max = 3600)]
    pub resume_after: HostDuration,
    /// The run ends after this time in suspension.
    #[setting(default = "10 min", above = 0, max = 86_400)]
    pub give_up_after: HostDuration,
}

/// Two levels: one that suspends, and another, on the safe side of it, at which the condition is over. In events per second,
/// bytes per second, bytes or °C, depending on the condition.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Threshold {
    /// A value beyond this suspends.
    pub trip: f64,
    /// The condition is over from here; above `trip` when values below `trip` suspend.
    pub resume: f64,
    /// How long values must stay beyond `trip`.
    pub lasting: HostDuration,
}

impl Threshold {
    /// True for values that suspend; never for NaN.
    #[must_use]
    pub fn is_beyond(&self, value: f64) -> bool {
        if self.trip > self.resume {
            value > self.trip
        } else {
            value < self.trip
        }
    }

    /// True for values at which the condition is over; never for NaN.
    #[must_use]
    pub fn is_calm(&self, value: f64) -> bool {
        if self.trip > self.resume {
            value <= self.resume
        } else {
            value >= self.resume
        }
    }
}

/// How the current press is handled when the run is suspended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, Choice)]
#[serde(rename_all = "snake_case")]
pub enum PressHandling {
    /// Finish it; its outcome depends on the recorded data.
    #[default]
    Finish,
    /// Break it off; its outcome is invalid.
    BreakOff,
}

impl Suspend {
    pub(crate) fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

const AMOUNT: ValueRange = ValueRange::from_zero(1e15);
const DEGREES: ValueRange = ValueRange::between(-40.0, 150.0);

/// Side of the first level on which a condition suspends.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Above,
    Below,
}

/// A threshold; its levels must be in the right order.
fn threshold(
    side: Side,
    threshold: Threshold,
    f: &Field,
    out: &mut Collector,
) -> Option<Threshold> {
    let Threshold { trip, resume, .. } = threshold;
    let (in_order, expected) = match side {
        Side::Above => (trip > resume, "`resume_below` smaller than `above`"),
        Side::Below => (trip < resume, "`resume_above` larger than `below`"),
    };
    if !in_order {
        let message = "the two levels are not apart";
        out.error(f.span, f.path.as_str(), message)
            .expected(expected)
            .found(format!("{resume} and {trip}"));
        return None;
    }
    Some(threshold)
}

/// The file form of a [`Threshold`]: two levels of one unit, the first of which suspends.
macro_rules! levels {
    (
        $(#[$doc:meta])* $name:ident($table:literal), $range:ident,
        $side:ident $trip:ident $trip_example:literal, $resume:ident $resume_example:literal, $lasting:literal
    ) => {
        $(#[$doc])*
        #[derive(Settings)]
        #[settings(name = $table)]
        struct $name {
            /// Suspends the run.
            #[setting(range = $range, example = $trip_example)]
            $trip: f64,
            /// The condition is over.
            #[setting(range = $range, example = $resume_example)]
            $resume: f64,
            /// How long the condition must last.
            #[setting(key = "for", default = $lasting, max = 3600)]
            lasting: HostDuration,
        }

        impl $name {
            fn threshold(f: &Field, out: &mut Collector) -> Option<Threshold> {
                let Self { $trip: trip, $resume: resume, lasting } = Self::from_mapping(f, out)?;
                threshold(Side::$side, Threshold { trip, resume, lasting }, f, out)
            }
        }
    };
}

levels!(
    /// Two event rates: `resume_below` is the smaller one.
    Storm("suspend_event_rate"), AMOUNT,
    Above above_ev_s "5 Mev/s", resume_below_ev_s "1 Mev/s", "1 s"
);
levels!(
    /// Two event rates: `resume_above` is the larger one.
    Dark("suspend_dark"), AMOUNT,
    Below below_ev_s "100 ev/s", resume_above_ev_s "1 kev/s", "10 s"
);
levels!(
    /// Two rates of loss: `resume_below` is the smaller one.
    Loss("suspend_lost_bytes"), AMOUNT,
    Above above_b_s "1 MB/s", resume_below_b_s "1 kB/s", "1 s"
);
levels!(
    /// Two amounts of free space: `resume_above` is the larger one.
    FreeSpace("suspend_disk_free"), AMOUNT,
    Below below_b "5 GB", resume_above_b "6 GB", "0 s"
);
levels!(
    /// Two temperatures: `resume_below` is the smaller one.
    Heat("suspend_temperature"), DEGREES,
    Above above_deg_c "60 degC", resume_below_deg_c "50 degC", "2 s"
);
