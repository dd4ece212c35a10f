//! `tpg-controller`: executes a policy for a plant in another process; needs the runtime alone.

// These macros panic where the output is closed.
#![warn(clippy::print_stdout, clippy::print_stderr)]

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context as _;
use clap::Parser;
use tpg_runtime::Policy;
use tpg_sim_bridge::message::Role;
use tpg_sim_bridge::{
    BridgeError, ListenPlace, Place, ProcessArgs, RunName, Server, Status, listen, note,
};

/// Execute a policy for a plant in another process.
///
/// Started first or second, it waits for the `tpg-plant` with the same --run and ends with it. With --listen it answers any
/// program that speaks the protocol of docs/wire.md, until it is interrupted.
#[derive(Debug, Parser)]
#[command(
    name = "tpg-controller",
    version,
    after_help = Status::help(
        "Examples:\n  \
         tpg-controller champion.tpg --run bench\n  \
         tpg-controller champion.tpg --listen udp:127.0.0.1:7000"
    )
)]
struct Args {
    /// Exported policy.
    #[arg(value_name = "FILE.tpg")]
    file: PathBuf,
    /// Name of the run; plant and controller find each other by it.
    #[arg(long, value_name = "NAME", required_unless_present = "listen")]
    run: Option<RunName>,
    /// Answer any plant here instead: unix:PATH of a socket to make, or udp:HOST:PORT.
    #[arg(long, value_name = "unix:PATH|udp:HOST:PORT", conflicts_with = "run")]
    listen: Option<ListenPlace>,
    #[command(flatten)]
    process: ProcessArgs,
}

fn main() -> ExitCode {
    let args = Args::parse();
    let Err(error) = run(&args) else {
        return Status::Fine.into();
    };
    let bridge = error.downcast_ref::<BridgeError>();
    // `tpg-hil`, which started both, reports the interruption.
    if !(args.process.attached && matches!(bridge, Some(BridgeError::Interrupted))) {
        note(format_args!("error: {error:#}"));
    }
    // Whatever the bridge does not report comes from the policy's file.
    bridge.map_or(Status::BadInput, BridgeError::status).into()
}

fn run(args: &Args) -> anyhow::Result<()> {
    let file = args.file.display();
    let blob = std::fs::read(&args.file).with_context(|| format!("cannot read {file}"))?;
    let policy = Policy::load(&blob).with_context(|| format!("cannot use {file}"))?;
    let process = &args.process;
    process.prepare(Place::Last)?;
    if let Some(place) = &args.listen {
        listen(policy, &blob, place, |place| {
            note(format_args!("listening at {place}"));
        })?;
    }
    if let Some(run) = &args.run {
        let mut server = Server::connect(policy, &blob, run, process.deadlines.deadlines())?;
        process.announce(Role::Plant, server.plant_pid());
        server.serve()?;
    }
    Ok(())
}
