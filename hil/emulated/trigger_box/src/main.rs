//! Runs an emulated trigger box until its standard input ends, for manual tests.
//!
//! `skinrig-emulated-trigger-box PORT SOCKET [PPM]`: paths for its serial port and its board's socket.

use std::io::{self, Read, Write};
use std::process::ExitCode;

use skinrig_emulated_trigger_box::{BoardOptions, EmulatedBox};

fn main() -> io::Result<ExitCode> {
    let mut out = io::stdout();
    let args: Vec<String> = std::env::args().skip(1).collect();
    let (port, socket, ppm) = match &args[..] {
        [port, socket] => (port, socket, Some(0.0)),
        [port, socket, ppm] => (port, socket, ppm.parse().ok()),
        _ => {
            writeln!(
                out,
                "expected PORT SOCKET [PPM], found {} words",
                args.len()
            )?;
            return Ok(ExitCode::from(2));
        }
    };
    let Some(ppm) = ppm else {
        writeln!(out, "expected PPM as a number, found {:?}", args[2])?;
        return Ok(ExitCode::from(2));
    };
    let options = BoardOptions {
        ppm,
        serial: Some("EMULATED".to_owned()),
        port: Some(port.into()),
        socket: Some(socket.into()),
        ..BoardOptions::default()
    };
    match EmulatedBox::start(&options) {
        Ok(_board) => {
            writeln!(out, "ready: {port} {socket}")?;
            io::stdin().read_to_end(&mut Vec::new())?;
            Ok(ExitCode::SUCCESS)
        }
        Err(reason) => {
            writeln!(out, "no emulated trigger box: {reason}")?;
            Ok(ExitCode::FAILURE)
        }
    }
}
