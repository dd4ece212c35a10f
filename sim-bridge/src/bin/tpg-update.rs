//! `tpg-update`: gives a board a new policy; `tpg update` starts it.

// These macros panic where the output is closed.
#![warn(clippy::print_stdout, clippy::print_stderr)]

use std::process::ExitCode;

use clap::Parser as _;
use tpg_sim_bridge::update::{self, UpdateArgs};
use tpg_tasks::console::report;
use tpg_tasks::exit_status::Status;

fn main() -> ExitCode {
    match update::run(&UpdateArgs::parse()) {
        Ok(()) => Status::Fine.into(),
        Err(failure) => report(&failure),
    }
}
