//! `tpg-controller`: executes a policy for a plant in another process; needs the runtime alone.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context as _;
use clap::Parser;
use tpg_runtime::Policy;
use tpg_sim_bridge::message::Role;
use tpg_sim_bridge::{BridgeError, LinkArgs, Server};

/// Execute a policy for a plant in another process.
///
/// Started first or second, it waits for the `tpg-plant` with the same --run and ends with it.
#[derive(Debug, Parser)]
#[command(
    name = "tpg-controller",
    version,
    after_help = "Exit status: 0 done, 1 our fault, 2 usage, 3 bad policy, 4 plant missing, dead or foreign, 130 interrupted.\n\n\
                  Example:\n  tpg-controller champion.tpg --run bench"
)]
struct Args {
    /// Exported policy.
    #[arg(value_name = "FILE.tpg")]
    file: PathBuf,
    #[command(flatten)]
    link: LinkArgs,
}

/// Exit status for a file that cannot be used.
const BAD_INPUT: u8 = 3;

fn main() -> ExitCode {
    let args = Args::parse();
    let Err(error) = run(&args) else {
        return ExitCode::SUCCESS;
    };
    let bridge = error.downcast_ref::<BridgeError>();
    // Whoever started both says that the loop was interrupted.
    if !(args.link.attached && matches!(bridge, Some(BridgeError::Interrupted))) {
        eprintln!("error: {error:#}");
    }
    ExitCode::from(bridge.map_or(BAD_INPUT, BridgeError::status))
}

fn run(args: &Args) -> anyhow::Result<()> {
    let file = args.file.display();
    let blob = std::fs::read(&args.file).with_context(|| format!("cannot read {file}"))?;
    let policy = Policy::load(&blob).with_context(|| format!("cannot use {file}"))?;
    let link = &args.link;
    link.prepare()?;
    let mut server = Server::connect(policy, &blob, &link.run, link.timeout.timeout())?;
    link.announce(Role::Plant, server.plant_pid());
    server.serve()?;
    Ok(())
}
