//! The `skinrig` binary: the command line in, an exit code out.

use skinrig::exit::Exit;

fn main() -> Exit {
    skinrig::main_with(std::env::args_os())
}
