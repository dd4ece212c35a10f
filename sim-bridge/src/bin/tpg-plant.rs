//! `tpg-plant`: simulates a task for a controller in another process.

use std::process::ExitCode;

use clap::Parser;
use tpg_runtime::Policy;
use tpg_sim_bridge::{LinkArgs, Outcome, RemoteController, failure, interrupt, status};
use tpg_trainer::cli::{Failure, ScoreArgs};
use tpg_trainer::eval::evaluate;

/// Simulate a task for a controller in another process.
///
/// Started first or second, it waits for the `tpg-controller` with the same --run, runs the episodes of
/// `tpg eval` and prints what they returned.
#[derive(Debug, Parser)]
#[command(
    name = "tpg-plant",
    version,
    after_help = "Exit status: 0 done, 1 our fault, 2 usage, 3 bad policy, 4 controller missing, dead or foreign, 130 interrupted.\n\n\
                  Example:\n  tpg-plant champion.tpg --run bench --episodes 5 --json"
)]
struct Args {
    #[command(flatten)]
    score: ScoreArgs,
    #[command(flatten)]
    link: LinkArgs,
}

fn main() -> ExitCode {
    match run(Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}

fn run(args: Args) -> Result<(), Failure> {
    let setup = args.score.resolve()?;
    let mut arena = setup.arena()?;
    let policy = Policy::load(&setup.blob).map_err(Failure::bad_input)?;
    interrupt::install().map_err(failure)?;
    let link = args.link;
    let connected =
        RemoteController::connect(&policy, &setup.blob, &link.run, link.timeout.timeout());
    let mut controller = connected.map_err(failure)?;
    if !link.quiet {
        eprintln!(
            "tpg-plant: connected to controller, process {}",
            controller.controller_pid()
        );
    }
    let episodes = evaluate(&mut arena, &mut controller, setup.episode_seeds())
        .map_err(|error| Failure::new(status(&error.source), error))?;
    let latency = controller.finish().map_err(failure)?;
    let outcome = Outcome {
        report: setup.report(&episodes),
        latency,
    };
    outcome.print(setup.json)
}
