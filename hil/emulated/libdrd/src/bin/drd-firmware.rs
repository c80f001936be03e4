//! The firmware of an emulated arm as a program: `drd-firmware DIRECTORY`, with `arm.json` in it or the defaults.

use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1);
    let (Some(directory), None) = (arguments.next(), arguments.next()) else {
        return fail("expected one argument: the directory of the arm");
    };
    match drd::firmware::run(Path::new(&directory), false) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => fail(&format!(
            "the emulated arm in {}: {error}",
            directory.display()
        )),
    }
}

#[expect(
    clippy::print_stderr,
    reason = "a program reports errors on its terminal"
)]
fn fail(message: &str) -> ExitCode {
    eprintln!("{message}");
    ExitCode::FAILURE
}
