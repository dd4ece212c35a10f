//! `tpg-plant`: simulates a task for a controller in another process.

use std::process::ExitCode;

use clap::Parser;
use tpg_runtime::Policy;
use tpg_sim_bridge::message::Role;
use tpg_sim_bridge::{LinkArgs, Outcome, RemoteController, failure, status};
use tpg_trainer::cli::{Failure, ScoreArgs, Status};
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
    let args = Args::parse();
    match run(args.score, &args.link) {
        Ok(()) => ExitCode::SUCCESS,
        // Whoever started both says that the loop was interrupted.
        Err(failure) if args.link.attached && failure.status == Status::Interrupted => {
            failure.status.into()
        }
        Err(failure) => failure.report(),
    }
}

fn run(score: ScoreArgs, link: &LinkArgs) -> Result<(), Failure> {
    let setup = score.resolve()?;
    let mut arena = setup.arena()?;
    let policy = Policy::load(&setup.blob).map_err(Failure::bad_input)?;
    link.prepare().map_err(failure)?;
    let connected =
        RemoteController::connect(&policy, &setup.blob, &link.run, link.timeout.timeout());
    let remote = connected.map_err(failure)?;
    link.announce(Role::Controller, remote.controller_pid());
    let mut controller = setup.disturbed(&arena, remote)?;
    let episodes = evaluate(&mut arena, &mut controller, setup.episode_seeds())
        .map_err(|error| Failure::new(status(&error.source), error))?;
    let latency = controller.into_inner().finish().map_err(failure)?;
    let outcome = Outcome {
        report: setup.report(&episodes),
        latency,
    };
    outcome.print(setup.json)
}
