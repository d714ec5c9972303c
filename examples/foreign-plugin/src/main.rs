//! Intrados with two plugins more, window and command line alike: `work-light predict SCENE`,
//! `work-light view SCENE`.

use std::process::ExitCode;

fn main() -> ExitCode {
    intrados::main(work_light::app)
}
