//! Runs a command with access to an emulated bench: `emulated-bench [--seed N] [--level LEVEL] -- COMMAND ...`.
#![expect(clippy::print_stderr, reason = "a program reports on its terminal")]

use std::process::ExitCode;

#[cfg(target_os = "linux")]
fn main() -> ExitCode {
    match linux::run() {
        Ok(code) => code,
        Err(e) => {
            eprintln!("emulated-bench: {e}");
            ExitCode::FAILURE
        }
    }
}

#[cfg(not(target_os = "linux"))]
fn main() -> ExitCode {
    eprintln!("emulated-bench: expected Linux, whose USB file system is emulated here");
    ExitCode::FAILURE
}

#[cfg(target_os = "linux")]
mod linux {
    use std::error::Error;
    use std::process::ExitCode;

    use skinrig_emulated_bench::{BenchConfig, EmulatedBench};
    use skinrig_model::SimLevel;

    const USAGE: &str = "expected [--seed N] [--level geometric|optical] -- COMMAND ...";

    pub(crate) fn run() -> Result<ExitCode, Box<dyn Error>> {
        let mut config = BenchConfig::default();
        let mut arguments = std::env::args_os().skip(1);
        let program = loop {
            let argument = arguments.next().ok_or(USAGE)?;
            match argument.to_str() {
                Some("--") => break arguments.next().ok_or(USAGE)?,
                Some("--seed") => {
                    let seed = arguments.next().and_then(|n| n.to_str()?.parse().ok());
                    config.seed = seed.ok_or("expected --seed and a whole number")?;
                }
                Some("--level") => {
                    config.level = match arguments.next().as_deref().and_then(|l| l.to_str()) {
                        Some("geometric") => SimLevel::Geometric,
                        Some("optical") => SimLevel::Optical,
                        _ => return Err(USAGE.into()),
                    }
                }
                _ => return Err(format!("{USAGE}, found {}", argument.display()).into()),
            }
        };
        let bench = EmulatedBench::start(&config)?;
        eprintln!(
            "emulated bench: arm, two cameras and trigger box are running; this is not hardware"
        );
        let status = bench.command(program)?.args(arguments).status()?;
        let code = status.code().and_then(|code| u8::try_from(code).ok());
        Ok(code.map_or(ExitCode::FAILURE, ExitCode::from))
    }
}
