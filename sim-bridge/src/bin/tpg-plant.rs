//! `tpg-plant`: simulates a task for a controller in another process.

// These macros panic where the output is closed.
#![warn(clippy::print_stdout, clippy::print_stderr)]

use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::Parser;
use tpg_runtime::Policy;
use tpg_sim_bridge::junit::{self, Suite};
use tpg_sim_bridge::message::Role;
use tpg_sim_bridge::record::{Recorded, Recorder, Subject};
use tpg_sim_bridge::{
    BenchArgs, BridgeError, ControllerArgs, LinkArgs, Outcome, PaceArgs, Paced, Place,
    RemoteController, failure, note,
};
use tpg_tasks::console::report;
use tpg_tasks::eval::{Arena, EvaluationError, evaluate};
use tpg_tasks::exit_status::{Failure, Fault as _, Status};
use tpg_tasks::score::{ScoreArgs, Setup};
use tpg_tasks::task::{Channel, stack_text};

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
    bench: BenchArgs,
    #[command(flatten)]
    link: LinkArgs,
}

fn main() -> ExitCode {
    let args = Args::parse();
    let (attached, junit) = (args.link.process.attached, args.bench.junit.clone());
    let suite = args.score.file.display().to_string();
    match run(args) {
        Ok(status) => status.into(),
        // `tpg-hil`, which started both, reports the interruption, and how the loop broke off.
        Err(failure) if attached && failure.status == Status::Interrupted => failure.status.into(),
        Err(failure) if attached => report(&failure),
        Err(failure) => {
            let written = junit.map_or(Ok(()), |path| junit::write_broken(&path, suite, &failure));
            let _ = written.map_err(|failure| report(&failure));
            report(&failure)
        }
    }
}

fn run(args: Args) -> Result<Status, Failure> {
    let Args {
        score,
        pace,
        controller,
        bench,
        link,
    } = args;
    bench.check(&pace, &controller)?;
    let setup = score.resolve()?;
    let mut arena = setup.arena()?;
    let policy = Policy::load(&setup.blob).map_err(Failure::bad_input)?;
    let recorder = bench.record.as_ref().map(|place| {
        let subject = subject(&setup, &arena, &pace);
        Recorder::create(place, subject).map_err(failure)
    });
    let recorder = recorder.transpose()?;
    link.process.prepare(Place::First).map_err(failure)?;
    let (blob, deadlines) = (&setup.blob, link.process.deadlines.deadlines());
    let connected = match &controller.controller {
        Some(place) if controller.any_controller => {
            RemoteController::connect_any(&policy, place, deadlines.answer)
        }
        Some(place) => RemoteController::connect_serial(&policy, blob, place, deadlines.answer),
        None => RemoteController::connect(&policy, blob, &link.run, deadlines),
    };
    let remote = connected.map_err(failure)?;
    if let Some(pid) = remote.controller_pid() {
        link.process.announce(Role::Controller, pid);
    }
    let start = Instant::now();
    let cut_short =
        |error: EvaluationError<BridgeError>| Failure::new(error.source.status(), error);
    let (episodes, latency, losses, timing, percentiles) = if pace.realtime {
        let paced = Paced::new(remote, pace.max_misses).map_err(failure)?;
        let mut controller = setup.disturbed(&arena, Recorded::new(paced, recorder))?;
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
        let paced = controller.into_inner().finish().map_err(failure)?;
        let percentiles = paced.percentiles();
        let (latency, losses, timing) = paced.finish().map_err(failure)?;
        (episodes, latency, losses, Some(timing), percentiles)
    } else {
        let mut controller = setup.disturbed(&arena, Recorded::new(remote, recorder))?;
        let seeds = setup.episode_seeds();
        let episodes = evaluate(&mut arena, &mut controller, seeds).map_err(cut_short)?;
        let remote = controller.into_inner().finish().map_err(failure)?;
        let percentiles = remote.percentiles();
        let (latency, losses) = remote.finish().map_err(failure)?;
        (episodes, latency, losses, None, percentiles)
    };
    let mut outcome = Outcome {
        report: setup.report(&episodes),
        latency,
        timing,
        losses,
        requirements: Vec::new(),
    };
    outcome.check(&bench.require);
    if let Some(path) = &bench.latency_histogram {
        std::fs::write(path, percentiles).or_unwritable(path)?;
    }
    if let Some(path) = &bench.junit {
        let suite = Suite {
            name: setup.file.display().to_string(),
            seconds: start.elapsed().as_secs_f64(),
            cases: outcome.cases(),
        };
        junit::write(path, &[suite])?;
    }
    outcome.print(setup.json)?;
    Ok(outcome.unmet().map_or(Status::Fine, |unmet| {
        note(format_args!("error: {unmet}"));
        Status::Unmet
    }))
}

/// What a recording of this loop is about.
fn subject(setup: &Setup, arena: &Arena, pace: &PaceArgs) -> Subject {
    let spec = arena.task().spec();
    let named = |channels: &[Channel]| {
        let pair = |channel: &Channel| (channel.name.clone(), channel.unit.clone());
        channels.iter().map(pair).collect()
    };
    let disturbances: Vec<String> = setup.disturb.iter().map(ToString::to_string).collect();
    let notes = [
        ("task", setup.task.clone()),
        ("policy", setup.file.display().to_string()),
        ("observability", stack_text(&setup.observability)),
        ("disturbances", disturbances.join(", ")),
        ("seed", setup.seed.to_string()),
        ("period_us", spec.period_us.to_string()),
        (
            "pace",
            if pace.realtime {
                "real time"
            } else {
                "lock-step"
            }
            .to_owned(),
        ),
    ];
    Subject {
        inputs: named(arena.wrappers().inputs()),
        outputs: named(&spec.outputs),
        period_us: spec.period_us,
        max_steps: spec.max_steps,
        notes: notes.map(|(name, text)| (name.to_owned(), text)).into(),
    }
}
