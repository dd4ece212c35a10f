//! `tpg-update`: gives a board a new policy; `tpg update` starts it.

use std::process::ExitCode;

use clap::Parser as _;
use tpg_sim_bridge::update::{self, UpdateArgs};

fn main() -> ExitCode {
    match update::run(&UpdateArgs::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}
