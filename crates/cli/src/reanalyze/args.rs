//! Arguments of `skinrig reanalyze`.

use std::path::PathBuf;

use clap::Args;

/// Where the analyses run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Engine {
    /// Processes of this computer.
    Local,
    /// The Dask cluster with this scheduler, `tcp://HOST:PORT`.
    Dask(String),
}

/// Text that names no engine.
#[derive(Debug, Clone, Copy, thiserror::Error)]
#[error("expected `local` or `dask://HOST:PORT`")]
pub(crate) struct UnknownEngine;

fn engine(text: &str) -> Result<Engine, UnknownEngine> {
    match text.split_once("://") {
        None if text == "local" => Ok(Engine::Local),
        Some(("dask", place)) if place.contains(':') && !place.ends_with(':') => {
            Ok(Engine::Dask(format!("tcp://{place}")))
        }
        _ => Err(UnknownEngine),
    }
}

/// Arguments of `reanalyze`.
#[derive(Debug, Args)]
pub(crate) struct ReanalyzeArgs {
    /// Session files, folders of sessions, or selections.
    #[arg(required = true, value_name = "SESSION")]
    pub sessions: Vec<PathBuf>,

    /// The file of settings that change: `skinrig_settings: 1` and a mapping `analysis`, as in a protocol.
    #[arg(long, value_name = "FILE")]
    pub settings: PathBuf,

    /// Name of the variant [default: that of the file of settings].
    #[arg(long, value_name = "VARIANT", value_parser = crate::analyses::parse)]
    pub name: Option<String>,

    /// Where: on this computer (`local`), or on the workers of a Dask cluster, as `dask://HOST:8786`; sessions are on folders that
    /// all of them see under the same path, and skinrig is installed on each.
    #[arg(long, value_name = "ENGINE", default_value = "local", value_parser = engine)]
    pub on: Engine,

    /// Sessions analysed at the same time on this computer, each by its own process [default: the number of cores].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub jobs: Option<u32>,
}
