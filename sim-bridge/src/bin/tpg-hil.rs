//! `tpg-hil`: scores a policy in another process than the simulator; `tpg hil` starts it.

use std::ffi::OsString;
use std::process::ExitCode;

use clap::Parser as _;
use tpg_sim_bridge::hil::{self, HilArgs};

fn main() -> ExitCode {
    let forwarded: Vec<OsString> = std::env::args_os().skip(1).collect();
    match hil::run(HilArgs::parse(), &forwarded) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}
