//! `tpg update`: a new policy for a board, over its serial line.

use std::path::PathBuf;

use clap::Parser;
use tpg_runtime::Policy;
use tpg_tasks::console::{print, print_json};
use tpg_tasks::exit_status::{Failure, Fault as _, Status};

use crate::args::TimeoutArgs;
use crate::interrupt;
use crate::outcome::failure;
use crate::serial::{SerialPath, update};

/// Give a board a new policy without flashing it anew.
///
/// The board stores it beside the one in use, checks it and changes over; it keeps the old one until the new one has
/// decided, and goes back to it if the power is cut before. Wherever that happens, a working policy remains.
#[derive(Debug, Parser)]
#[command(
    name = "tpg-update",
    bin_name = "tpg update",
    version,
    after_help = Status::help("Example:\n  tpg update champion.tpg --controller serial:/dev/ttyACM0")
)]
pub struct UpdateArgs {
    /// Exported policy.
    #[arg(value_name = "FILE.tpg")]
    file: PathBuf,
    /// The board: serial:PATH of its tty (serial:PATH@RATE, by default 115200 bits per second), or of a Unix socket.
    #[arg(long, value_name = "serial:PATH")]
    controller: SerialPath,
    /// How long to wait.
    #[command(flatten)]
    timeout: TimeoutArgs,
    /// Print one JSON object to standard output.
    #[arg(long)]
    json: bool,
}

/// Runs the update.
///
/// # Errors
/// A [`Failure`] with the status to end with.
pub fn run(args: &UpdateArgs) -> Result<(), Failure> {
    let file = args.file.display();
    let blob = std::fs::read(&args.file).or_bad_input(format!("cannot read {file}"))?;
    let policy = Policy::load(&blob).or_bad_input(format!("cannot use {file}"))?;
    interrupt::install().map_err(failure)?;
    let timeout = args.timeout.timeout();
    let updated = update(&policy, &blob, &args.controller, timeout).map_err(failure)?;
    if args.json {
        return print_json(&serde_json::json!({
            "before": { "slot": updated.before.slot, "bytes": updated.before.policy_bytes },
            "after": { "slot": updated.after.slot, "bytes": updated.after.policy_bytes },
        }));
    }
    print(updated)
}
