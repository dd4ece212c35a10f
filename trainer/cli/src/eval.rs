//! `tpg eval`

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use tpg_runtime::{HostAgent, Policy};

use tpg_tasks::console::{note, print, print_json};
use tpg_tasks::eval::{
    Arena, ConstantController, Episode, EvaluationError, RandomController, evaluate,
};
use tpg_tasks::exit_status::{Failure, Fault as _, Status};
use tpg_tasks::score::{ScoreArgs, Setup};
use tpg_tasks::stats;
use tpg_tasks::task::stack_text;
use tpg_tasks::trace::{Header, RecordError, TracingController};

/// Arguments of `tpg eval`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    score: ScoreArgs,
    /// Score the zero and the random policy on the same episodes too.
    #[arg(long)]
    baselines: bool,
    /// Record every decision to a file, for `tpg replay`.
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
}

pub(crate) fn run(args: Args) -> Result<Status, Failure> {
    let setup = args.score.resolve()?;
    let policy = Policy::load(&setup.blob)?;
    let mut agent = Box::new(
        HostAgent::new(policy).or_bad_input(format!("cannot run {}", setup.file.display()))?,
    );
    let mut arena = setup.arena()?;
    let episodes = match &args.trace {
        Some(file) => record(&setup, &mut arena, agent, file)?,
        None => {
            let mut controller = setup.disturbed(&arena, &mut *agent)?;
            evaluate(&mut arena, &mut controller, setup.episode_seeds())?
        }
    };
    let report = setup.report(&episodes);
    let unstable = report.unstable;
    let baselines = if args.baselines {
        baselines(&setup)?
    } else {
        Vec::new()
    };
    if setup.json {
        let mut value = serde_json::to_value(&report)?;
        for (name, returns) in &baselines {
            value[format!("{name}_mean")] = stats::mean(returns).into();
            value[format!("{name}_mean_ci95")] = stats::bootstrap_mean_95(returns).to_vec().into();
        }
        print_json(&value)?;
    } else {
        print(report)?;
        for (name, returns) in &baselines {
            let [low, high] = stats::bootstrap_mean_95(returns);
            let name = format!("{name} policy");
            let mean = stats::mean(returns);
            print(format_args!("{name:<14} {mean:.2} [{low:.2}, {high:.2}]"))?;
        }
        if !baselines.is_empty() {
            print("intervals      95 %, bootstrap; all on the same episodes")?;
        }
    }
    if unstable < episodes.len() {
        return Ok(Status::Fine);
    }
    let reason = arena.task().instability();
    note(format_args!(
        "warning: all episodes became unstable, so these returns say nothing of the policy{}; check the model, its time \
         step, and the range of its controls",
        reason.map_or_else(String::new, |reason| format!(" (last: {reason})"))
    ));
    Ok(Status::Peer)
}

/// Scores the policy and records its decisions.
fn record(
    setup: &Setup,
    arena: &mut Arena,
    agent: Box<HostAgent<'_>>,
    path: &Path,
) -> Result<Vec<Episode>, Failure> {
    let header = Header::new(
        &setup.blob,
        &setup.task,
        stack_text(&setup.observability),
        setup.seed,
        setup.episodes,
    );
    let file = File::create(path).or_unwritable(path)?;
    let recording = TracingController::new(agent, header, BufWriter::new(file));
    let mut recording = recording.or_unwritable(path)?;
    let mut controller = setup.disturbed(arena, &mut recording)?;
    let episodes = match evaluate(arena, &mut controller, setup.episode_seeds()) {
        Err(EvaluationError {
            source: RecordError::Write(error),
            ..
        }) => return Err(error).or_unwritable(path),
        episodes => episodes?,
    };
    recording.finish().or_unwritable(path)?;
    Ok(episodes)
}

/// Returns of the baseline policies on the same episodes.
fn baselines(setup: &Setup) -> Result<Vec<(&'static str, Vec<f64>)>, Failure> {
    let mut arena = setup.arena()?;
    let actions = arena.task().spec().actions;
    let returns = |episodes: Vec<Episode>| episodes.iter().map(|e| e.total).collect();
    let mut zero = setup.disturbed(&arena, ConstantController::zero(actions))?;
    let zero = evaluate(&mut arena, &mut zero, setup.episode_seeds())?;
    let mut random = setup.disturbed(&arena, RandomController::new(actions))?;
    let random = evaluate(&mut arena, &mut random, setup.episode_seeds())?;
    Ok(vec![("zero", returns(zero)), ("random", returns(random))])
}
