//! Settings with which a camera is opened.

use std::collections::BTreeMap;

use skinrig_device::{CameraSettings, SyncMode};
use skinrig_model::Setting;

use crate::model::Model;

/// Source of the camera's time base.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TimeBase {
    /// Its own clock.
    #[default]
    Standalone,
    /// Its own clock, which it also sends to others.
    Master,
    /// Another camera's clock.
    Slave,
}

/// Validated settings.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct StreamSettings {
    /// Bias values by name, in the unit of `Model::bias_range`; others keep their default.
    pub biases: BTreeMap<String, i16>,
    /// Whether trigger edges are part of the stream.
    pub trigger: bool,
    /// Source of the time base.
    pub time_base: TimeBase,
}

/// A setting that the camera's driver crate does not support.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected {expected}, found {found}")]
pub struct UnsupportedSetting {
    /// Supported values.
    pub expected: String,
    /// Requested value.
    pub found: String,
}

impl UnsupportedSetting {
    fn new(expected: String, found: impl ToString) -> Self {
        Self {
            expected,
            found: found.to_string(),
        }
    }
}

impl StreamSettings {
    /// Validates `settings` for `model`.
    ///
    /// # Errors
    /// The first unsupported setting.
    pub fn new(model: Model, settings: &CameraSettings) -> Result<Self, UnsupportedSetting> {
        let name = model.name();
        let mut biases = BTreeMap::new();
        for (bias, &value) in &settings.biases {
            let names = model.biases();
            if !names.contains(&bias.as_str()) {
                let expected = match names {
                    [] => format!("no bias of the {name}: they keep their defaults"),
                    _ => format!("a bias out of {}", names.join(", ")),
                };
                return Err(UnsupportedSetting::new(expected, bias));
            }
            let range = model.bias_range();
            let fits = i16::try_from(value).ok().filter(|v| range.contains(v));
            let Some(fits) = fits else {
                let expected = format!("{bias} in {}..={}", range.start(), range.end());
                return Err(UnsupportedSetting::new(expected, value));
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
                return Err(UnsupportedSetting::new(expected, channel));
            }
        }
        let trigger = !settings.trigger_channels.is_empty();
        if settings.noise_filter.is_some() {
            let expected = format!("no noise filter on the {name}");
            return Err(UnsupportedSetting::new(expected, "a noise filter"));
        }
        if let Some(r) = settings.roi {
            let found = format!("{} x {} at ({}, {})", r.width, r.height, r.x, r.y);
            return Err(UnsupportedSetting::new(
                format!("no region on the {name}"),
                found,
            ));
        }
        if settings.sync != SyncMode::Standalone && !model.shares_time_base() {
            let expected = format!("the {name} standalone: its driver shares no time base");
            let found = format!("{:?}", settings.sync).to_lowercase();
            return Err(UnsupportedSetting::new(expected, found));
        }
        let time_base = match settings.sync {
            SyncMode::Standalone => TimeBase::Standalone,
            SyncMode::Master => TimeBase::Master,
            SyncMode::Slave => TimeBase::Slave,
        };
        Ok(Self {
            biases,
            trigger,
            time_base,
        })
    }

    /// Settings for the record. None of them is read back.
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
            TimeBase::Standalone => "standalone",
            TimeBase::Master => "master",
            TimeBase::Slave => "slave",
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
