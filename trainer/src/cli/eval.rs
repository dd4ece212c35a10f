//! `tpg eval`

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

use tpg_runtime::{HostAgent, Policy};

use super::{Failure, Fault as _, ScoreArgs, Setup, Status, print_json};
use crate::eval::{Arena, ConstantController, Episode, RandomController, evaluate};
use crate::stats;
use crate::task::stack_text;
use crate::trace::{Header, Recording};

/// Arguments of `tpg eval`.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    score: ScoreArgs,
    /// Score the zero and the random policy on the same episodes too.
    #[arg(long)]
    baselines: bool,
    /// Record every decision to a file, for `tpg replay`.
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
}

pub(super) fn run(args: Args) -> Result<Status, Failure> {
    let setup = args.score.resolve()?;
    let policy = Policy::load(&setup.blob)?;
    let mut agent = Box::new(
        HostAgent::new(policy).or_bad_input(format!("cannot run {}", setup.file.display()))?,
    );
    let mut arena = setup.arena()?;
    let episodes = match &args.trace {
        Some(file) => record(&setup, &mut arena, agent, file)?,
        None => evaluate(&mut arena, &mut *agent, setup.episode_seeds())?,
    };
    let report = setup.report(&episodes);
    let baselines = if args.baselines {
        baselines(&setup)?
    } else {
        Vec::new()
    };
    if setup.json {
        let mut value = serde_json::to_value(&report)?;
        for (name, mean) in &baselines {
            value[format!("{name}_mean")] = (*mean).into();
        }
        print_json(&value)?;
    } else {
        let mut out = std::io::stdout().lock();
        writeln!(out, "{report}")?;
        for (name, mean) in &baselines {
            writeln!(
                out,
                "{:<14} {mean:.2} on the same episodes",
                format!("{name} policy")
            )?;
        }
    }
    Ok(Status::Fine)
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
    let file = File::create(path).or_usage(format!("cannot create {}", path.display()))?;
    let mut recording = Recording::new(agent, header, BufWriter::new(file))?;
    let episodes = evaluate(arena, &mut recording, setup.episode_seeds())?;
    recording.finish()?;
    Ok(episodes)
}

/// Mean returns of policies that know nothing, on the same episodes.
fn baselines(setup: &Setup) -> Result<Vec<(&'static str, f64)>, Failure> {
    let mut arena = setup.arena()?;
    let actions = arena.task().spec().actions;
    let mean = |episodes: Vec<Episode>| {
        let totals: Vec<f64> = episodes.iter().map(|e| e.total).collect();
        stats::mean(&totals)
    };
    let zero = evaluate(
        &mut arena,
        &mut ConstantController::zero(actions),
        setup.episode_seeds(),
    )?;
    let random = evaluate(
        &mut arena,
        &mut RandomController::new(actions),
        setup.episode_seeds(),
    )?;
    Ok(vec![("zero", mean(zero)), ("random", mean(random))])
}
