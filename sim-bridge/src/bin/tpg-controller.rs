//! `tpg-controller`: executes a policy for a plant in another process; needs the runtime alone.

// These macros panic where the output is closed.
#![warn(clippy::print_stdout, clippy::print_stderr)]

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context as _;
use clap::Parser;
use tpg_runtime::Policy;
use tpg_sim_bridge::message::Role;
use tpg_sim_bridge::{BridgeError, LinkArgs, Server, Status, note};

/// Execute a policy for a plant in another process.
///
/// Started first or second, it waits for the `tpg-plant` with the same --run and ends with it.
#[derive(Debug, Parser)]
#[command(
    name = "tpg-controller",
    version,
    after_help = Status::help("Example:\n  tpg-controller champion.tpg --run bench")
)]
struct Args {
    /// Exported policy.
    #[arg(value_name = "FILE.tpg")]
    file: PathBuf,
    #[command(flatten)]
    link: LinkArgs,
}

fn main() -> ExitCode {
    let args = Args::parse();
    let Err(error) = run(&args) else {
        return Status::Fine.into();
    };
    let bridge = error.downcast_ref::<BridgeError>();
    // `tpg-hil`, which started both, reports the interruption.
    if !(args.link.attached && matches!(bridge, Some(BridgeError::Interrupted))) {
        note(format_args!("error: {error:#}"));
    }
    // Whatever the bridge does not report comes from the policy's file.
    bridge.map_or(Status::BadInput, BridgeError::status).into()
}

fn run(args: &Args) -> anyhow::Result<()> {
    let file = args.file.display();
    let blob = std::fs::read(&args.file).with_context(|| format!("cannot read {file}"))?;
    let policy = Policy::load(&blob).with_context(|| format!("cannot use {file}"))?;
    let link = &args.link;
    link.prepare()?;
    let mut server = Server::connect(policy, &blob, &link.run, link.deadlines.deadlines())?;
    link.announce(Role::Plant, server.plant_pid());
    server.serve()?;
    Ok(())
}
