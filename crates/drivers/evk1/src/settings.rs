//! The settings of a camera: checked as a whole, written in an order that keeps the camera's rules, read back.

use skinrig_device::{CameraSettings, SyncMode};
use skinrig_model::Setting;

use crate::access::Registers;
use crate::biases::{self, BIASES, Values};
use crate::error::Evk1Error;
use crate::roi::Map;
use crate::{noise_filter, sync, triggers};

/// Settings that the camera can take.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Checked {
    settings: CameraSettings,
    biases: Values,
    map: Map,
}

impl Checked {
    /// Checks all of `settings`; nothing is written.
    ///
    /// # Errors
    /// [`Evk1Error::Refused`] naming the first that the camera cannot take.
    pub fn new(settings: &CameraSettings) -> Result<Self, Evk1Error> {
        triggers::check(&settings.trigger_channels, settings.sync)?;
        noise_filter::check(settings.noise_filter)?;
        Ok(Self {
            settings: settings.clone(),
            biases: biases::complete(&settings.biases)?,
            map: Map::of(settings.roi)?,
        })
    }

    /// Whose time base the camera follows.
    #[must_use]
    pub fn sync(&self) -> SyncMode {
        self.settings.sync
    }

    /// The trigger inputs to enable.
    #[must_use]
    pub fn trigger_channels(&self) -> &[u8] {
        &self.settings.trigger_channels
    }

    /// Writes everything; the camera is stopped.
    ///
    /// # Errors
    /// [`Evk1Error::Refused`] for a master whose trigger output is on, before anything is written;
    /// [`Evk1Error::Usb`], [`Evk1Error::ReadBack`].
    pub fn write(&self, registers: &mut Registers<'_>) -> Result<(), Evk1Error> {
        sync::check(self.sync(), triggers::read_out(registers)?)?;
        // Whichever mode it comes from and goes to, the auxiliary input is off meanwhile.
        triggers::write(registers, &[])?;
        sync::write(registers, self.sync())?;
        triggers::write(registers, self.trigger_channels())?;
        biases::write(registers, &self.biases)?;
        self.map.write(registers)?;
        noise_filter::write(registers, self.settings.noise_filter)
    }

    /// Reads everything from the registers.
    ///
    /// # Errors
    /// [`Evk1Error::Usb`].
    pub fn read_back(&self, registers: &mut Registers<'_>) -> Result<Vec<Setting>, Evk1Error> {
        let mut all = Vec::new();
        let mut add = |name: &str, requested: String, read_back: String| {
            all.push(Setting {
                name: name.to_owned(),
                requested,
                read_back,
            });
        };
        for bias in &BIASES {
            if let Some(&mv) = self.biases.get(bias.name) {
                let found = biases::read_as(registers, bias, mv)?;
                add(bias.name, mv.to_string(), found);
            }
        }
        let found = Map::read(registers)?.describe();
        add("roi", self.map.describe(), found);
        let mut channels = self.settings.trigger_channels.clone();
        channels.sort_unstable();
        channels.dedup();
        add(
            "trigger_channels",
            list(&channels),
            list(&triggers::read(registers)?),
        );
        add(
            "sync",
            sync::name(self.sync()).to_owned(),
            sync::read(registers)?,
        );
        add(
            "noise_filter",
            noise_filter::describe(self.settings.noise_filter),
            noise_filter::read(registers)?,
        );
        Ok(all)
    }
}

/// The first setting that differs, as an error.
///
/// # Errors
/// [`Evk1Error::Setting`].
pub fn expect_equal(settings: &[Setting]) -> Result<(), Evk1Error> {
    match settings.iter().find(|s| s.requested != s.read_back) {
        Some(s) => Err(Evk1Error::Setting {
            name: s.name.clone(),
            expected: s.requested.clone(),
            found: s.read_back.clone(),
        }),
        None => Ok(()),
    }
}

fn list(channels: &[u8]) -> String {
    let texts: Vec<String> = channels.iter().map(u8::to_string).collect();
    texts.join(",")
}
