//! Event files from other programs.

use skinrig_formats::inspect::inspect;
use skinrig_formats::positions::{LengthUnit, PositionTable};

use super::sessions::Folder;

/// Reads a Prophesee RAW file to its end.
pub fn raw(bytes: &[u8]) {
    let folder = Folder::new();
    let path = folder.file("x.raw", bytes);
    let _ = inspect(&path, 1_000);
}

/// Reads an HDF5 file to its end.
pub fn hdf5(bytes: &[u8]) {
    let folder = Folder::new();
    let path = folder.file("x.hdf5", bytes);
    let _ = inspect(&path, 1_000);
    // Files rejected as ours are also tried as other layouts.
    let _ = PositionTable::read(&path, LengthUnit::Metre);
}
