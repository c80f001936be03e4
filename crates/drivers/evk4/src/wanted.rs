//! The settings that a camera is opened with.

use std::collections::BTreeMap;

use skinrig_device::{CameraSettings, SyncMode};
use skinrig_model::Setting;

use crate::model::Model;

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

/// Settings that a camera can take.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Wanted {
    /// Values by name, in the unit of `Model::bias_range`; others keep their default.
    pub biases: BTreeMap<String, i16>,
    /// Trigger edges are part of the stream.
    pub trigger: bool,
    /// Whose pulses it counts.
    pub time_base: TimeBase,
}

impl Wanted {
    /// Checks all of `settings` against what `model` offers.
    ///
    /// # Errors
    /// What would be accepted, and what was found instead.
    pub fn new(model: Model, settings: &CameraSettings) -> Result<Self, (String, String)> {
        let name = model.name();
        let mut biases = BTreeMap::new();
        for (bias, &value) in &settings.biases {
            let names = model.biases();
            if !names.contains(&bias.as_str()) {
                let expected = match names {
                    [] => format!("no bias of the {name}: they keep their defaults"),
                    _ => format!("a bias out of {}", names.join(", ")),
                };
                return Err((expected, bias.clone()));
            }
            let range = model.bias_range();
            let fits = i16::try_from(value).ok().filter(|v| range.contains(v));
            let Some(fits) = fits else {
                let expected = format!("{bias} in {}..={}", range.start(), range.end());
                return Err((expected, value.to_string()));
            };
            biases.insert(bias.clone(), fits);
        }
        let channels = model.trigger_channels();
        for channel in &settings.trigger_channels {
            if !channels.contains(channel) {
                let expected = match channels {
                    [] => format!("no trigger input of the {name}: its driver offers none"),
                    [only, ..] => format!("trigger channel {only}"),
                };
                return Err((expected, channel.to_string()));
            }
        }
        let trigger = !settings.trigger_channels.is_empty();
        if settings.noise_filter.is_some() {
            return Err((format!("no noise filter on the {name}"), "one".into()));
        }
        if let Some(r) = settings.roi {
            let found = format!("{} x {} at ({}, {})", r.width, r.height, r.x, r.y);
            return Err((format!("no region on the {name}"), found));
        }
        if settings.sync != SyncMode::Standalone && !model.shares_time_base() {
            let expected = format!("the {name} standalone: its driver shares no time base");
            return Err((expected, format!("{:?}", settings.sync).to_lowercase()));
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
            .map(|(name, value)| (name.clone(), value.to_string()))
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
