//! `tpg hil`: an external subcommand, so that the trainer need not depend on the bridge.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::Command;

use super::{Failure, Status};

const PROGRAM: &str = "tpg-hil";

/// Arguments of `tpg hil`, handed on as they are.
#[derive(Debug, clap::Args)]
#[command(disable_help_flag = true)]
pub(super) struct Args {
    /// The arguments of `tpg eval`, and more; `tpg hil --help` lists them.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<OsString>,
}

/// Runs `tpg-hil` from beside this executable, else from the search path.
pub(super) fn run(args: &Args) -> Result<Status, Failure> {
    let beside = std::env::current_exe()?.with_file_name(PROGRAM);
    let program = if beside.is_file() {
        beside
    } else {
        PathBuf::from(PROGRAM)
    };
    let status = Command::new(&program)
        .args(&args.arguments)
        .status()
        .map_err(|e| {
            Failure::usage(anyhow::Error::from(e).context(format!(
                "cannot start {PROGRAM}, which is neither beside this executable nor on the \
                 search path; build it with `cargo build --release -p tpg-sim-bridge`"
            )))
        })?;
    // A process that a signal ended has no status of its own.
    let code = status.code().and_then(|code| u8::try_from(code).ok());
    std::process::exit(i32::from(code.unwrap_or(Status::OurFault as u8)));
}
