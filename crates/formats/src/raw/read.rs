//! Reads a RAW file piece by piece.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::header::{MAX_HEADER, RawHeader};
use crate::error::FormatsError;
use crate::regular;
use crate::stream::{Decoder, Geometry};

/// Bytes per read.
const CHUNK: usize = 256 * 1024;

/// An open RAW file.
#[derive(Debug)]
pub struct RawReader {
    path: PathBuf,
    file: File,
    header: RawHeader,
    buffer: Vec<u8>,
}

impl RawReader {
    /// Opens `path` and reads its header.
    ///
    /// # Errors
    /// [`FormatsError::Io`], or [`FormatsError::Header`] as [`RawHeader::parse`].
    pub fn open(path: &Path) -> Result<Self, FormatsError> {
        let io = |e| FormatsError::io(path)(e);
        let mut file = regular::open(path).map_err(io)?;
        let mut start = Vec::new();
        (&mut file)
            .take(MAX_HEADER as u64)
            .read_to_end(&mut start)
            .map_err(io)?;
        let header = RawHeader::parse(&start, path)?;
        file.seek(SeekFrom::Start(header.length)).map_err(io)?;
        Ok(Self {
            path: path.into(),
            file,
            header,
            buffer: Vec::new(),
        })
    }

    /// The header.
    #[must_use]
    pub fn header(&self) -> &RawHeader {
        &self.header
    }

    /// A decoder for the file's words; without a stated geometry it accepts every coordinate.
    #[must_use]
    pub fn decoder(&self) -> Decoder {
        let geometry = self.header.geometry.unwrap_or(Geometry::ANY);
        Decoder::with_geometry(self.header.format, geometry)
    }

    /// Length of the stream after the header, bytes.
    ///
    /// # Errors
    /// [`FormatsError::Io`].
    pub fn stream_bytes(&self) -> Result<u64, FormatsError> {
        let metadata = self.file.metadata().map_err(FormatsError::io(&self.path))?;
        Ok(metadata.len().saturating_sub(self.header.length))
    }

    /// The next bytes of the stream, at most 256 KiB; an empty slice at the end. Words may be split between
    /// two pieces.
    ///
    /// # Errors
    /// [`FormatsError::Io`].
    pub fn next_chunk(&mut self) -> Result<&[u8], FormatsError> {
        self.buffer.clear();
        (&mut self.file)
            .take(CHUNK as u64)
            .read_to_end(&mut self.buffer)
            .map_err(FormatsError::io(&self.path))?;
        Ok(&self.buffer)
    }
}
