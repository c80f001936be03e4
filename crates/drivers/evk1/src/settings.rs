//! The settings of a camera: checked together, written in a valid order, read back.

use skinrig_device::{CameraSettings, NoiseFilter, SyncMode};
use skinrig_model::Setting;

use crate::access::Registers;
use crate::biases::{self, BIASES, Values};
use crate::error::Evk1Error;
use crate::registers::{ATIS_CONTROL, EXT_TRIGGERS_ENABLE, NFL_CTRL, NFL_THRESH};
use crate::roi::Map;
use crate::{noise_filter, sync, triggers};

/// Validated settings.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ValidatedSettings {
    settings: CameraSettings,
    biases: Values,
    map: Map,
}

impl ValidatedSettings {
    /// Checks all of `settings`; nothing is written.
    ///
    /// # Errors
    /// [`Evk1Error::Refused`] with the first setting that the camera does not support.
    pub fn new(settings: &CameraSettings) -> Result<Self, Evk1Error> {
        triggers::check(&settings.trigger_channels, settings.sync)?;
        noise_filter::check(settings.noise_filter)?;
        Ok(Self {
            settings: settings.clone(),
            biases: biases::complete(&settings.biases)?,
            map: Map::of(settings.roi)?,
        })
    }

    /// Time base that the camera follows.
    #[must_use]
    pub fn sync(&self) -> SyncMode {
        self.settings.sync
    }

    /// The trigger inputs to enable.
    #[must_use]
    pub fn trigger_channels(&self) -> &[u8] {
        &self.settings.trigger_channels
    }

    /// The noise filter; `None`: off.
    #[must_use]
    pub fn noise_filter(&self) -> Option<NoiseFilter> {
        self.settings.noise_filter
    }

    /// Writes everything; the camera must be stopped.
    ///
    /// # Errors
    /// [`Evk1Error::Refused`] for a master whose trigger output is on, before anything is written;
    /// [`Evk1Error::Usb`], [`Evk1Error::ReadBack`].
    pub fn write(&self, registers: &mut Registers<'_>) -> Result<(), Evk1Error> {
        sync::check(self.sync(), triggers::read_out(registers)?)?;
        // The auxiliary input is off while the mode changes.
        triggers::write(registers, &[])?;
        sync::write(registers, self.sync())?;
        triggers::write(registers, self.trigger_channels())?;
        biases::write(registers, &self.biases)?;
        self.map.write(registers)?;
        noise_filter::write(registers, self.settings.noise_filter)
    }

    /// Reads everything from the registers and compares it with the written values, except for registers with a
    /// known deviation: their settings contain the value read.
    ///
    /// # Errors
    /// [`Evk1Error::Setting`] with the first that differs; [`Evk1Error::Usb`].
    pub fn read_back(&self, registers: &mut Registers<'_>) -> Result<Vec<Setting>, Evk1Error> {
        let mut all = Vec::new();
        let mut add = |name: &str, requested: String, read_back: String, excused: bool| {
            let differs = requested != read_back;
            if differs && !excused {
                return Err(Evk1Error::Setting {
                    name: name.to_owned(),
                    expected: requested,
                    found: read_back,
                });
            }
            // An accepted deviation is reported as a value, not as a difference.
            all.push(match differs {
                false => Setting {
                    name: name.to_owned(),
                    requested,
                    read_back,
                },
                true => Setting {
                    name: name.to_owned(),
                    read_back: format!("{read_back} (after writing {requested})"),
                    requested: Setting::AS_FOUND.to_owned(),
                },
            });
            Ok(())
        };
        for bias in &BIASES {
            if let Some(&mv) = self.biases.get(bias.name) {
                let found = biases::read_as(registers, bias, mv)?;
                let excused = registers.excuses(bias.register());
                add(bias.name, mv.to_string(), found, excused)?;
            }
        }
        let found = Map::read(registers)?.describe();
        let excused = Map::registers().any(|r| registers.excuses(r));
        add("roi", self.map.describe(), found, excused)?;
        let mut channels = self.settings.trigger_channels.clone();
        channels.sort_unstable();
        channels.dedup();
        let found = list(&triggers::read(registers)?);
        let excused = registers.excuses(EXT_TRIGGERS_ENABLE);
        add("trigger_channels", list(&channels), found, excused)?;
        let requested = sync::name(self.sync()).to_owned();
        let found = sync::read(registers)?;
        add("sync", requested, found, registers.excuses(ATIS_CONTROL))?;
        let requested = noise_filter::describe(self.settings.noise_filter);
        let found = noise_filter::read(registers)?;
        let excused = registers.excuses(NFL_CTRL) || registers.excuses(NFL_THRESH);
        add("noise_filter", requested, found, excused)?;
        Ok(all)
    }
}

fn list(channels: &[u8]) -> String {
    let texts: Vec<String> = channels.iter().map(u8::to_string).collect();
    texts.join(",")
}
