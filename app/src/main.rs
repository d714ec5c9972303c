//! The command line of Intrados. `intrados --help` shows what it can do.

use std::process::ExitCode;

fn main() -> ExitCode {
    intrados::main(intrados::simulation)
}
