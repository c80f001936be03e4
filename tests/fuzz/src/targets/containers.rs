//! Files of events by other programs.

use skinrig_formats::inspect::inspect;
use skinrig_formats::positions::{LengthUnit, PositionTable};

use super::sessions::Folder;

/// A Prophesee RAW file, read to its end.
pub fn raw(bytes: &[u8]) {
    let folder = Folder::new();
    let path = folder.file("x.raw", bytes);
    let _ = inspect(&path, 1_000);
}

/// An HDF5 file, read to its end.
pub fn hdf5(bytes: &[u8]) {
    let folder = Folder::new();
    let path = folder.file("x.hdf5", bytes);
    let _ = inspect(&path, 1_000);
    // A file that is none of ours to read is also tried as what it is not.
    let _ = PositionTable::read(&path, LengthUnit::Metre);
}
