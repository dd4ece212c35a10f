//! `tpg-hil`: scores a policy in another process than the simulator; `tpg hil` starts it.

// These macros panic where the output is closed.
#![warn(clippy::print_stdout, clippy::print_stderr)]

use std::ffi::OsString;
use std::process::ExitCode;

use clap::Parser as _;
use tpg_sim_bridge::hil::{self, HilArgs};
use tpg_tasks::console::report;

fn main() -> ExitCode {
    let forwarded: Vec<OsString> = std::env::args_os().skip(1).collect();
    match hil::run(&HilArgs::parse(), &forwarded) {
        Ok(status) => status.into(),
        Err(failure) => report(&failure),
    }
}
