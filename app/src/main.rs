//! The command line of Intrados. `intrados --help` shows what it can do.

#![warn(clippy::print_stderr, reason = "it panics where stderr is full, and a result is lost: `session::say`")]

mod accumulator;
mod args;
mod commands;
mod drive;
mod failure;
mod output;
mod picture;
mod processor;
mod progress;
mod session;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    processor::check();
    run()
}

/// A function of its own: nothing of it may be moved before the check.
#[inline(never)]
fn run() -> ExitCode {
    let cli = args::Cli::parse();
    session::run(&cli, commands::run)
}
