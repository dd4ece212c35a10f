//! `tpg hil`, `tpg bench` and `tpg update`: programs of the bridge, started as subcommands, so that `tpg` need not depend on it.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::Command;

use tpg_tasks::exit_status::{Failure, Status};

/// Arguments of an external subcommand, handed on as they are.
#[derive(Debug, clap::Args)]
#[command(disable_help_flag = true)]
pub(crate) struct Args {
    /// Its arguments; `--help` lists them.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<OsString>,
}

/// Runs a program of the bridge from beside this executable, else from the search path.
pub(crate) fn run(name: &str, args: &Args) -> Result<Status, Failure> {
    let error = replace(Command::new(beside(name)).args(&args.arguments));
    Err(Failure::usage(anyhow::Error::from(error).context(format!(
        "cannot start {name}, which is neither beside this executable nor on the search path; \
         build it with `cargo build --release -p tpg-sim-bridge`"
    ))))
}

/// A program that lies beside this executable, or else its bare name, for the search path.
pub(crate) fn beside(name: &str) -> PathBuf {
    let own = std::env::current_exe().map(|own| own.with_file_name(name));
    let own = own.ok().filter(|path| path.is_file());
    own.unwrap_or_else(|| PathBuf::from(name))
}

/// Becomes the command; returns only if it cannot be started.
///
/// The program takes the place of this process, so that it alone gets Ctrl-C and has cleared up before the shell goes on.
#[cfg(unix)]
fn replace(command: &mut Command) -> std::io::Error {
    use std::os::unix::process::CommandExt as _;
    command.exec()
}

/// Runs the command and ends with its status; returns only if it cannot be started.
#[cfg(not(unix))]
fn replace(command: &mut Command) -> std::io::Error {
    match command.status() {
        Ok(status) => std::process::exit(status.code().unwrap_or(Status::OurFault.code().into())),
        Err(error) => error,
    }
}
