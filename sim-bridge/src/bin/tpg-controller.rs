//! `tpg-controller`: executes a policy for a plant in another process; needs the runtime alone.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context as _;
use clap::Parser;
use tpg_runtime::Policy;
use tpg_sim_bridge::{BridgeError, LinkArgs, Server, interrupt};

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
    match run(&Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("tpg-controller: error: {error:#}");
            let bridge = error.downcast_ref::<BridgeError>();
            ExitCode::from(bridge.map_or(BAD_INPUT, BridgeError::status))
        }
    }
}

fn run(args: &Args) -> anyhow::Result<()> {
    let file = args.file.display();
    let blob = std::fs::read(&args.file).with_context(|| format!("cannot read {file}"))?;
    let policy = Policy::load(&blob).with_context(|| format!("cannot use {file}"))?;
    interrupt::install()?;
    let link = &args.link;
    let mut server = Server::connect(policy, &blob, &link.run, link.timeout.timeout())?;
    if !link.quiet {
        eprintln!(
            "tpg-controller: connected to plant, process {}",
            server.plant_pid()
        );
    }
    server.serve()?;
    Ok(())
}
