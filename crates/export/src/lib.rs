//! A session in other programs' formats: tables (Parquet, npz, CSV), camera files (RAW, HDF5), and bundles that prove themselves.
//!
//! Four [`tables`](Source::write): `presses` (one row per press, with what the analysis says of it), `pose`, `results`, and the
//! events of each camera. A [`TableWriter`] takes a table batch by batch, so that memory stays flat however long the session is.
//! Every file is written under another name and gets its own when it is whole; nothing is overwritten unless asked, and nothing
//! is written outside the given folder.
//!
//! What each column means is in `docs/reference/exports.md`.

pub mod bundle;
mod cameras;
mod csv_files;
mod error;
mod folder;
mod metrics;
mod npz;
mod parquet_files;
mod presses;
mod source;
mod streams;
pub mod table;
mod tables;

pub use bundle::{BundleReport, MANIFEST, seal_bundle, verify_bundle};
pub use cameras::{write_hdf5, write_raw};
pub use csv_files::CsvFiles;
pub use error::ExportError;
pub use folder::{Folder, same_bytes};
pub use npz::NpzFile;
pub use parquet_files::ParquetFiles;
pub use source::{Source, TableName};
pub use table::TableWriter;
