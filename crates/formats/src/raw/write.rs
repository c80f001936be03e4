//! Writes a RAW file: a header for old and new vendor tools, then the camera's bytes unmodified.

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

use skinrig_model::StreamFormat;

use crate::error::FormatsError;
use crate::stream::Geometry;

/// Values of a header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RawMetadata {
    /// Word format.
    pub format: StreamFormat,
    /// The sensor's size.
    pub geometry: Geometry,
    /// Local time at the start of the recording, `2022-03-01 10:11:12`.
    pub date: String,
    /// The camera's serial number.
    pub serial_number: String,
    /// Number of the camera type; 28 is EVK1 Gen3.1. Old readers choose their decoder by it.
    pub system_id: u32,
    /// Generation of the sensor, `3.1`.
    pub sensor_generation: String,
    /// Additional keys, such as `firmware_version`.
    pub more: Vec<(String, String)>,
}

impl RawMetadata {
    /// An EVK1 Gen3.1.
    #[must_use]
    pub fn evk1(date: &str, serial_number: &str) -> Self {
        Self {
            format: StreamFormat::Evt2,
            geometry: Geometry::EVK1,
            date: date.into(),
            serial_number: serial_number.into(),
            system_id: 28,
            sensor_generation: "3.1".into(),
            more: Vec::new(),
        }
    }

    /// The header as text, keys in ASCII order, `% end` last.
    ///
    /// # Errors
    /// [`FormatsError::HeaderValue`] for a key or value that would not read back: empty, with a line break or
    /// multiple spaces, or a key that this header already has.
    pub fn header(&self) -> Result<String, FormatsError> {
        let Geometry { width, height } = self.geometry;
        let (name, version, order) = match self.format {
            StreamFormat::Evt2 => ("EVT2", "2.0", ""),
            StreamFormat::Evt21 => ("EVT21", "2.1", "endianness=little;"),
            StreamFormat::Evt21Legacy => ("EVT21", "2.1", "endianness=legacy;"),
            StreamFormat::Evt3 => ("EVT3", "3.0", ""),
        };
        let mut entries = vec![
            ("camera_integrator_name", "Prophesee".to_owned()),
            ("date", self.date.clone()),
            ("evt", version.to_owned()),
            (
                "format",
                format!("{name};{order}height={height};width={width}"),
            ),
            ("geometry", format!("{width}x{height}")),
            ("plugin_integrator_name", "Prophesee".to_owned()),
            ("plugin_name", "hal_plugin_prophesee".to_owned()),
            ("sensor_generation", self.sensor_generation.clone()),
            ("serial_number", self.serial_number.clone()),
            ("system_ID", self.system_id.to_string()),
        ];
        entries.extend(self.more.iter().map(|(k, v)| (k.as_str(), v.clone())));
        entries.sort_by(|a, b| a.0.cmp(b.0));
        let mut text = String::new();
        for (index, (key, value)) in entries.iter().enumerate() {
            let single_spaced = value.split_whitespace().collect::<Vec<_>>().join(" ");
            let one_token = key.split_whitespace().eq([*key]);
            let twice = index > 0 && entries[index - 1].0 == *key;
            if !one_token || twice || *key == "end" || value.is_empty() || single_spaced != *value {
                return Err(FormatsError::HeaderValue {
                    key: (*key).into(),
                    value: value.clone(),
                });
            }
            text.push_str(&format!("% {key} {value}\n"));
        }
        text.push_str("% end\n");
        Ok(text)
    }
}

/// Writes one RAW file.
#[derive(Debug)]
pub struct RawWriter {
    path: PathBuf,
    file: BufWriter<File>,
}

impl RawWriter {
    /// Creates `path`, which must not exist, and writes the header.
    ///
    /// # Errors
    /// [`FormatsError::Io`], or [`FormatsError::HeaderValue`].
    pub fn create(path: &Path, metadata: &RawMetadata) -> Result<Self, FormatsError> {
        let header = metadata.header()?;
        let io = |e| FormatsError::io(path)(e);
        let mut file = BufWriter::new(File::create_new(path).map_err(io)?);
        file.write_all(header.as_bytes()).map_err(io)?;
        Ok(Self {
            path: path.into(),
            file,
        })
    }

    /// Appends bytes of the stream.
    ///
    /// # Errors
    /// [`FormatsError::Io`].
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), FormatsError> {
        self.file
            .write_all(bytes)
            .map_err(FormatsError::io(&self.path))
    }

    /// Flushes the buffer.
    ///
    /// # Errors
    /// [`FormatsError::Io`].
    pub fn finish(mut self) -> Result<(), FormatsError> {
        self.file.flush().map_err(FormatsError::io(&self.path))
    }
}
