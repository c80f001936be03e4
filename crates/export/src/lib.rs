//! Exports a session in other formats: tables (Parquet, npz, CSV), camera files (RAW, HDF5), verifiable bundles,
//! RO-Crates, and a data lake of many sessions.
//!
//! There are four [`tables`](Source::write): `presses` (one row per press, with its analysis), `pose`, `results`, and the
//! events of each camera. A [`TableWriter`] takes a table batch by batch, so memory stays constant for any session length.
//! Every file is written under a temporary name and renamed when complete; nothing is overwritten unless requested, and
//! nothing is written outside the given folder.
//!
//! `docs/reference/exports.md` defines the columns.

pub mod bundle;
mod cameras;
pub mod challenge;
mod csv_files;
mod error;
mod folder;
mod lake;
mod lake_tables;
mod metrics;
mod npz;
mod parquet_files;
mod presses;
mod rocrate;
mod source;
mod streams;
pub mod table;
mod table_files;
mod tables;

pub use bundle::{BundleReport, MANIFEST, SIGNATURE_ENDING, seal_bundle, verify_bundle};
pub use cameras::{write_hdf5, write_raw};
pub use csv_files::CsvFiles;
pub use error::ExportError;
pub use folder::{Folder, same_bytes};
pub use lake::{Lake, LakeCommit, LakeState, Partition};
pub use metrics::{MetricRow, metric_rows};
pub use npz::NpzFile;
pub use parquet_files::ParquetFiles;
pub use rocrate::{
    CrateDescription, CrateNumber, CrateOrganisation, CratePerson, CrateReport, METADATA,
    compare_description, is_signature, seal_crate, verify_crate,
};
pub use source::{Source, TableName};
pub use table::TableWriter;
