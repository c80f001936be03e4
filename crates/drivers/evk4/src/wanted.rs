//! The settings that an EVK4 is opened with.

use std::collections::BTreeMap;

use skinrig_device::{CameraSettings, SyncMode};
use skinrig_model::Setting;

/// Biases by name, as offsets from the value in the sensor's memory (neuromorphic-drivers 0.18, `prophesee_evk4::Biases`; two
/// more have no name).
pub const BIASES: [&str; 11] = [
    "diff",
    "diff_off",
    "diff_on",
    "fo",
    "hpf",
    "inv",
    "pr",
    "refr",
    "reqpux",
    "reqpuy",
    "sendreqpdy",
];

/// The one trigger input (metavision_driver, `config/trigger_pins.yaml`, gives the main input of every model as channel 0).
pub const TRIGGER_CHANNEL: u8 = 0;

/// Whose pulses the camera counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TimeBase {
    /// Its own.
    #[default]
    Own,
    /// Its own, and others count them too.
    Given,
    /// Another's.
    Taken,
}

/// Settings that an EVK4 can take.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Wanted {
    /// Offsets by name; others stay 0.
    pub biases: BTreeMap<String, i16>,
    /// Trigger edges are part of the stream.
    pub trigger: bool,
    /// Whose pulses it counts.
    pub time_base: TimeBase,
}

impl Wanted {
    /// Checks all of `settings`.
    ///
    /// # Errors
    /// What would be accepted, and what was found instead.
    pub fn new(settings: &CameraSettings) -> Result<Self, (String, String)> {
        let mut biases = BTreeMap::new();
        for (name, &value) in &settings.biases {
            if !BIASES.contains(&name.as_str()) {
                return Err((format!("a bias out of {}", BIASES.join(", ")), name.clone()));
            }
            // Registers of eight bits hold value and offset together.
            let offset = i16::try_from(value)
                .ok()
                .filter(|v| (-255..=255).contains(v));
            let Some(offset) = offset else {
                let expected = format!("an offset of {name} in -255..=255");
                return Err((expected, value.to_string()));
            };
            biases.insert(name.clone(), offset);
        }
        let mut trigger = false;
        for &channel in &settings.trigger_channels {
            if channel != TRIGGER_CHANNEL {
                let expected = format!("trigger channel {TRIGGER_CHANNEL}");
                return Err((expected, channel.to_string()));
            }
            trigger = true;
        }
        if settings.noise_filter.is_some() {
            return Err(("no noise filter on an EVK4".into(), "one".into()));
        }
        if let Some(r) = settings.roi {
            let found = format!("{} x {} at ({}, {})", r.width, r.height, r.x, r.y);
            return Err(("no region on an EVK4".into(), found));
        }
        let time_base = match settings.sync {
            SyncMode::Standalone => TimeBase::Own,
            SyncMode::Master => TimeBase::Given,
            SyncMode::Slave => TimeBase::Taken,
        };
        Ok(Self {
            biases,
            trigger,
            time_base,
        })
    }

    /// The settings as far as anybody can tell: nothing of them is read back.
    #[must_use]
    pub fn settings(&self) -> Vec<Setting> {
        let mut all: Vec<(String, String)> = self
            .biases
            .iter()
            .map(|(name, offset)| (name.clone(), offset.to_string()))
            .collect();
        let channels = if self.trigger { "0" } else { "" };
        all.push(("trigger_channels".into(), channels.into()));
        let sync = match self.time_base {
            TimeBase::Own => "standalone",
            TimeBase::Given => "master",
            TimeBase::Taken => "slave",
        };
        all.push(("sync".into(), sync.into()));
        all.into_iter()
            .map(|(name, requested)| Setting {
                name,
                requested,
                read_back: "unverified".into(),
            })
            .collect()
    }
}
