//! The command line of Intrados. `intrados --help` shows what it can do.

mod accumulator;
mod args;
mod commands;
mod drive;
mod failure;
mod output;
mod picture;
mod progress;
mod session;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    let cli = args::Cli::parse();
    session::run(&cli, commands::run)
}
