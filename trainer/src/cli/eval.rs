//! `tpg eval`

use std::io::Write as _;

use tpg_runtime::{HostAgent, Policy};

use super::{Failure, Fault as _, ScoreArgs, Setup, Status, print_json};
use crate::eval::{ConstantController, RandomController, evaluate};
use crate::stats;

/// Arguments of `tpg eval`.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    score: ScoreArgs,
    /// Score the zero and the random policy on the same episodes too.
    #[arg(long)]
    baselines: bool,
}

pub(super) fn run(args: Args) -> Result<Status, Failure> {
    let setup = args.score.resolve()?;
    let policy = Policy::load(&setup.blob)?;
    let mut agent = Box::new(
        HostAgent::new(policy).or_bad_input(format!("cannot run {}", setup.file.display()))?,
    );
    let mut arena = setup.arena()?;
    let mut controller = setup.disturbed(&arena, &mut *agent)?;
    let episodes = evaluate(&mut arena, &mut controller, setup.episode_seeds())?;
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

/// Mean returns of policies that know nothing, on the same episodes.
fn baselines(setup: &Setup) -> Result<Vec<(&'static str, f64)>, Failure> {
    let mut arena = setup.arena()?;
    let actions = arena.task().spec().actions;
    let mean = |episodes: Vec<crate::eval::Episode>| {
        let totals: Vec<f64> = episodes.iter().map(|e| e.total).collect();
        stats::mean(&totals)
    };
    let mut constant = setup.disturbed(&arena, ConstantController::zero(actions))?;
    let zero = evaluate(&mut arena, &mut constant, setup.episode_seeds())?;
    let mut random = setup.disturbed(&arena, RandomController::new(actions))?;
    let random = evaluate(&mut arena, &mut random, setup.episode_seeds())?;
    Ok(vec![("zero", mean(zero)), ("random", mean(random))])
}
