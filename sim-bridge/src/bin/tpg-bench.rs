//! `tpg-bench`: runs the loops that a bench file lists; `tpg bench` starts it.

// These macros panic where the output is closed.
#![warn(clippy::print_stdout, clippy::print_stderr)]

use std::process::ExitCode;

use clap::Parser as _;
use tpg_sim_bridge::bench::{self, BenchFileArgs};
use tpg_tasks::console::report;

fn main() -> ExitCode {
    match bench::run(&BenchFileArgs::parse()) {
        Ok(status) => status.into(),
        Err(failure) => report(&failure),
    }
}
