//! `tpg update`: a new policy for a board, over its serial line, and the way back.

use std::path::{Path, PathBuf};

use clap::Parser;
use serde_json::json;
use tpg_runtime::Policy;
use tpg_runtime::wire::Identity;
use tpg_tasks::console::{print, print_json};
use tpg_tasks::exit_status::{Failure, Fault as _, Status};

use crate::args::TimeoutArgs;
use crate::interrupt;
use crate::note;
use crate::outcome::failure;
use crate::serial::{Listed, SerialPath, Updated, Updater};

/// Give a board a new policy without flashing it anew, or take one back.
///
/// A policy for another robot is refused before anything is written. The board stores the policy beside the confirmed one, checks it and changes over. Once the new policy has controlled
/// the plant well, the firmware confirms it. If the board starts again before that, it reverts the policy. Wherever the
/// power is cut, a working policy remains.
#[derive(Debug, Parser)]
#[command(
    name = "tpg-update",
    bin_name = "tpg update",
    version,
    after_help = Status::help(
        "Examples:\n  tpg update champion.tpg --controller serial:/dev/ttyACM0\n  \
         tpg update --list --controller serial:/dev/ttyACM0"
    )
)]
pub struct UpdateArgs {
    /// Exported policy.
    #[arg(value_name = "FILE.tpg", required_unless_present = "Instead")]
    file: Option<PathBuf>,
    /// Send the policy although it is for another robot than the board's confirmed one, and say what differs.
    #[arg(long, conflicts_with = "Instead")]
    force: bool,
    /// What to do in place of an update.
    #[command(flatten)]
    instead: Instead,
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

#[derive(Debug, clap::Args)]
#[group(multiple = false, conflicts_with = "file")]
struct Instead {
    /// List the policies that the board stores.
    #[arg(long)]
    list: bool,
    /// Give up the policy in use: the confirmed one of the other slot takes its place, or the one that the firmware was
    /// built with.
    #[arg(long)]
    revert: bool,
    /// Erase all stored policies: the one that the firmware was built with is used.
    #[arg(long)]
    erase: bool,
}

/// Runs the update.
///
/// # Errors
/// A [`Failure`] with the status to end with.
pub fn run(args: &UpdateArgs) -> Result<(), Failure> {
    let updated = match &args.file {
        Some(file) => send(args, file)?,
        None if args.instead.list => {
            let listed = connect(args)?.list().map_err(failure)?;
            return show(args, &slots(&listed), &listed);
        }
        None if args.instead.revert => connect(args)?.revert().map_err(failure)?,
        None => connect(args)?.erase().map_err(failure)?,
    };
    show(args, &change(&updated), &updated)
}

fn send(args: &UpdateArgs, path: &Path) -> Result<Updated, Failure> {
    let file = path.display();
    let blob = std::fs::read(path).or_bad_input(format!("cannot read {file}"))?;
    let policy = Policy::load(&blob).or_bad_input(format!("cannot use {file}"))?;
    let mut updater = connect(args)?;
    if args.force {
        for difference in updater.compare(&policy, &blob).map_err(failure)? {
            note(format_args!("forced: {difference}"));
        }
    }
    if updater.begins_to_need_nan(&policy).map_err(failure)? {
        note(
            "the new policy takes NaN for a missing element and zero for a value; the board's policy took zeros for missing: \
             the firmware must send NaN",
        );
    }
    updater.update(&policy, &blob, args.force).map_err(failure)
}

fn connect(args: &UpdateArgs) -> Result<Updater, Failure> {
    interrupt::install().map_err(failure)?;
    Updater::connect(&args.controller, args.timeout.timeout()).map_err(failure)
}

fn show(
    args: &UpdateArgs,
    json: &serde_json::Value,
    text: &impl std::fmt::Display,
) -> Result<(), Failure> {
    if args.json {
        print_json(json)
    } else {
        print(text)
    }
}

fn change(updated: &Updated) -> serde_json::Value {
    let side =
        |identity: &Identity| json!({ "slot": identity.slot, "bytes": identity.policy_bytes });
    json!({
        "before": side(&updated.before),
        "after": side(&updated.after),
        "confirmed": updated.confirmed,
        "signed": updated.signed.name(),
    })
}

fn slots(listed: &Listed) -> serde_json::Value {
    let slots = listed.0.iter().map(|slot| {
        json!({
            "slot": slot.number,
            "state": slot.state.name(),
            "in_use": slot.in_use,
            "bytes": slot.bytes,
            "checksum": format!("{:08x}", slot.crc),
            "format": slot.format,
            "contract": format!("{:016x}", slot.contract),
            "release": slot.release,
            "signed": slot.signed.name(),
        })
    });
    json!({ "slots": slots.collect::<Vec<_>>() })
}
