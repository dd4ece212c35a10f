//! `tpg-plant`: simulates a task for a controller in another process.

// These macros panic where the output is closed.
#![warn(clippy::print_stdout, clippy::print_stderr)]

use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::Parser;
use tpg_runtime::Policy;
use tpg_sim_bridge::message::Role;
use tpg_sim_bridge::{
    BridgeError, ControllerArgs, LinkArgs, Outcome, PaceArgs, Paced, RemoteController, failure,
};
use tpg_tasks::console::report;
use tpg_tasks::eval::{EvaluationError, evaluate};
use tpg_tasks::exit_status::{Failure, Status};
use tpg_tasks::score::ScoreArgs;

/// Simulate a task for a controller in another process.
///
/// Started first or second, it waits for the `tpg-controller` with the same --run, runs the episodes of
/// `tpg eval` and prints what they returned.
#[derive(Debug, Parser)]
#[command(
    name = "tpg-plant",
    version,
    after_help = Status::help("Example:\n  tpg-plant champion.tpg --run bench --episodes 5 --json")
)]
struct Args {
    #[command(flatten)]
    score: ScoreArgs,
    #[command(flatten)]
    pace: PaceArgs,
    #[command(flatten)]
    controller: ControllerArgs,
    #[command(flatten)]
    link: LinkArgs,
}

fn main() -> ExitCode {
    let args = Args::parse();
    let attached = args.link.attached;
    match run(args) {
        Ok(()) => Status::Fine.into(),
        // `tpg-hil`, which started both, reports the interruption.
        Err(failure) if attached && failure.status == Status::Interrupted => failure.status.into(),
        Err(failure) => report(&failure),
    }
}

fn run(args: Args) -> Result<(), Failure> {
    let Args {
        score,
        pace,
        controller,
        link,
    } = args;
    let setup = score.resolve()?;
    let mut arena = setup.arena()?;
    let policy = Policy::load(&setup.blob).map_err(Failure::bad_input)?;
    link.prepare().map_err(failure)?;
    let (blob, deadlines) = (&setup.blob, link.deadlines.deadlines());
    let connected = match &controller.controller {
        Some(place) => RemoteController::connect_serial(&policy, blob, place, deadlines.answer),
        None => RemoteController::connect(&policy, blob, &link.run, deadlines),
    };
    let remote = connected.map_err(failure)?;
    if let Some(pid) = remote.controller_pid() {
        link.announce(Role::Controller, pid);
    }
    let cut_short =
        |error: EvaluationError<BridgeError>| Failure::new(error.source.status(), error);
    let (episodes, latency, losses, timing) = if pace.realtime {
        let paced = Paced::new(remote, pace.max_misses).map_err(failure)?;
        let mut controller = setup.disturbed(&arena, paced)?;
        let start = Instant::now();
        let seconds = pace.seconds.map(Duration::from_secs);
        // Without --seconds it is the number of episodes that counts.
        let count = if seconds.is_some() {
            usize::MAX
        } else {
            setup.episodes as usize
        };
        let seeds = (setup.endless_seeds().take(count))
            .take_while(|_| seconds.is_none_or(|seconds| start.elapsed() < seconds));
        let episodes = evaluate(&mut arena, &mut controller, seeds).map_err(cut_short)?;
        let (latency, losses, timing) = controller.into_inner().finish().map_err(failure)?;
        (episodes, latency, losses, Some(timing))
    } else {
        let mut controller = setup.disturbed(&arena, remote)?;
        let seeds = setup.episode_seeds();
        let episodes = evaluate(&mut arena, &mut controller, seeds).map_err(cut_short)?;
        let (latency, losses) = controller.into_inner().finish().map_err(failure)?;
        (episodes, latency, losses, None)
    };
    let outcome = Outcome {
        report: setup.report(&episodes),
        latency,
        timing,
        losses,
    };
    outcome.print(setup.json)
}
