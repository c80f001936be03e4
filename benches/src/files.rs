//! A recording as files in the published layout, and as an event source for the analysis.

use std::path::{Path, PathBuf};

use skinrig_analysis::{EventSource, EventSourceError};
use skinrig_formats::hdf5::{Container, EventWriter};
use skinrig_formats::{FormatsError, Geometry};
use skinrig_model::{CameraId, CdEvent};

/// One HDF5 container per camera in a folder.
#[derive(Debug, Clone)]
pub struct Files(PathBuf);

impl Files {
    /// Writes the events of both cameras.
    ///
    /// # Errors
    /// If a file exists or cannot be written.
    pub fn write(folder: &Path, events: &[Vec<CdEvent>; 2]) -> Result<Self, FormatsError> {
        let files = Self(folder.into());
        for (camera, events) in CameraId::ALL.into_iter().zip(events) {
            let mut writer = EventWriter::create(&files.path(camera), 0)?;
            writer.append(events)?;
            writer.finish()?;
        }
        Ok(files)
    }

    /// Uses existing files.
    #[must_use]
    pub fn at(folder: &Path) -> Self {
        Self(folder.into())
    }

    /// The file of a camera.
    #[must_use]
    pub fn path(&self, camera: CameraId) -> PathBuf {
        self.0.join(format!("camera{}.hdf5", camera.number()))
    }
}

impl EventSource for Files {
    fn for_each_slice(
        &self,
        camera: CameraId,
        each: &mut dyn FnMut(&[CdEvent]),
    ) -> Result<(), EventSourceError> {
        let container = Container::open(&self.path(camera))?;
        let mut reader = container.events(None, Geometry::EVK1)?;
        loop {
            match reader.next_batch()? {
                [] => return Ok(()),
                batch => each(batch),
            }
        }
    }
}

/// Events in memory.
#[derive(Debug, Clone)]
pub struct Memory(pub [Vec<CdEvent>; 2]);

impl EventSource for Memory {
    fn for_each_slice(
        &self,
        camera: CameraId,
        each: &mut dyn FnMut(&[CdEvent]),
    ) -> Result<(), EventSourceError> {
        self.0[camera.index()].chunks(16_384).for_each(each);
        Ok(())
    }
}
