//! Emulated cameras in a separate process.
//!
//! `emulated-cameras CONFIG.json` prints the bus's folder and the preload library as a line of JSON and runs until its input ends;
//! `emulated-cameras CONFIG.json -- COMMAND ...` runs a command on the bus and exits with its status.
#![expect(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a program reports on its terminal"
)]

use std::process::ExitCode;

#[cfg(target_os = "linux")]
fn main() -> ExitCode {
    match linux::run() {
        Ok(code) => code,
        Err(e) => {
            eprintln!("emulated-cameras: {e}");
            ExitCode::FAILURE
        }
    }
}

#[cfg(not(target_os = "linux"))]
fn main() -> ExitCode {
    eprintln!("emulated-cameras: expected Linux, whose USB file system is emulated here");
    ExitCode::FAILURE
}

#[cfg(target_os = "linux")]
mod linux {
    use std::error::Error;
    use std::io::Read;
    use std::process::ExitCode;

    use skinrig_emulated_camera::bus::shim;
    use skinrig_emulated_camera::{Bus, BusConfig};

    const USAGE: &str = "expected CONFIG.json [-- COMMAND ...]";

    pub(crate) fn run() -> Result<ExitCode, Box<dyn Error>> {
        let mut arguments = std::env::args_os().skip(1);
        let path = arguments.next().ok_or(USAGE)?;
        let text = std::fs::read_to_string(&path)
            .map_err(|e| format!("{}: {e}", path.to_string_lossy()))?;
        let config: BusConfig =
            serde_json::from_str(&text).map_err(|e| format!("{}: {e}", path.to_string_lossy()))?;
        let bus = Bus::start(&config)?;
        match arguments.next() {
            None => {
                let message = serde_json::json!({ "root": bus.root(), "preload": shim()? });
                println!("{message}");
                std::io::stdin().read_to_end(&mut Vec::new())?;
                Ok(ExitCode::SUCCESS)
            }
            Some(dashes) if dashes == "--" => {
                let program = arguments.next().ok_or(USAGE)?;
                let status = bus.command(program)?.args(arguments).status()?;
                Ok(status
                    .code()
                    .and_then(|code| u8::try_from(code).ok())
                    .map_or(ExitCode::FAILURE, ExitCode::from))
            }
            Some(other) => Err(format!("{USAGE}, found {}", other.to_string_lossy()).into()),
        }
    }
}
