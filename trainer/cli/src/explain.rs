//! `tpg explain`

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use serde_json::{Value, json};
use tpg_runtime::{HostAgent, Policy};

use tpg_tasks::console::{note, print, print_json};
use tpg_tasks::eval::evaluate;
use tpg_tasks::exit_status::{Failure, Fault as _, Status};
use tpg_tasks::explain::{Explained, Explanation, Frozen};
use tpg_tasks::score::{Report, ScoreArgs, Setup};
use tpg_tasks::stats;

/// Arguments of `tpg explain`.
#[derive(Debug, clap::Args)]
#[command(
    mut_arg("episodes", |episodes| episodes.default_value("100")),
    after_help = "Examples:\n  \
    tpg explain champion.tpg\n  \
    tpg explain runs/hopper --episodes 20 --json"
)]
pub(crate) struct Args {
    #[command(flatten)]
    score: ScoreArgs,
    /// Threads that score, by default one for each core; the result is the same for any number.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

/// What a policy scores without one of its inputs.
struct WithoutInput {
    returns: Vec<f64>,
    /// What each episode loses.
    drops: Vec<f64>,
}

pub(crate) fn run(args: Args) -> Result<Status, Failure> {
    let setup = args.score.resolve()?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = args.threads.map_or(cores, usize::from);
    let mut arena = setup.arena()?;
    let mut controller = setup.disturbed(&arena, Explained::new(agent(&setup)?))?;
    let episodes = evaluate(&mut arena, &mut controller, setup.episode_seeds())?;
    let report = setup.report(&episodes);
    let explanation = controller.into_inner().finish();
    let without = without_each(&setup, &explanation, &report, threads)?;
    if setup.json {
        print_json(&as_json(&report, &explanation, &without))?;
    } else {
        print(text(&report, &explanation, &without))?;
    }
    Ok(Status::Fine)
}

fn agent(setup: &Setup) -> Result<Box<HostAgent<'_>>, Failure> {
    let policy = Policy::load(&setup.blob)?;
    let agent = HostAgent::new(policy);
    let agent = agent.or_bad_input(format!("cannot run {}", setup.file.display()))?;
    Ok(Box::new(agent))
}

/// The policy on the same episodes with each input in turn frozen at its mean. Threads take an input at a time.
fn without_each(
    setup: &Setup,
    explanation: &Explanation,
    report: &Report,
    threads: usize,
) -> Result<Vec<WithoutInput>, Failure> {
    let inputs = &explanation.inputs;
    let next = AtomicUsize::new(0);
    let results = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..threads.min(inputs.len()) {
            scope.spawn(|| {
                loop {
                    let input = next.fetch_add(1, Ordering::Relaxed);
                    let Some(seen) = inputs.get(input) else { break };
                    let result = frozen(setup, input, seen.mean as f32);
                    let mut results = results.lock().unwrap_or_else(PoisonError::into_inner);
                    results.push((input, result));
                    note(format_args!(
                        "{} of {} inputs: {}",
                        results.len(),
                        inputs.len(),
                        seen.name
                    ));
                }
            });
        }
    });
    let mut results = results.into_inner().unwrap_or_else(PoisonError::into_inner);
    results.sort_by_key(|(input, _)| *input);
    let without = results.into_iter().map(|(_, returns)| {
        let returns = returns?;
        let drops = report.returns.iter().zip(&returns).map(|(a, b)| a - b);
        Ok(WithoutInput {
            drops: drops.collect(),
            returns,
        })
    });
    without.collect()
}

fn frozen(setup: &Setup, input: usize, value: f32) -> Result<Vec<f64>, Failure> {
    let mut arena = setup.arena()?;
    let mut agent = agent(setup)?;
    let frozen = Frozen::new(&mut *agent, input, value);
    let mut controller = setup.disturbed(&arena, frozen)?;
    let episodes = evaluate(&mut arena, &mut controller, setup.episode_seeds())?;
    Ok(episodes.iter().map(|episode| episode.total).collect())
}

fn as_json(report: &Report, explanation: &Explanation, without: &[WithoutInput]) -> Value {
    let inputs = explanation
        .inputs
        .iter()
        .zip(without)
        .map(|(seen, without)| {
            json!({
                "name": seen.name,
                "mean": seen.mean,
                "sd": seen.sd,
                "frozen_mean": stats::mean(&without.returns),
                "drop": stats::mean(&without.drops),
                "drop_ci95": stats::bootstrap_mean_95(&without.drops),
            })
        });
    json!({
        "task": report.task,
        "observability": report.observability,
        "seed": report.seed,
        "episodes": report.returns.len(),
        "mean": report.mean,
        "mean_ci95": report.mean_ci95,
        "decisions": explanation.decisions,
        "inputs": inputs.collect::<Vec<_>>(),
        "programs": explanation.programs,
        "memory": explanation.memory,
    })
}

fn text(report: &Report, explanation: &Explanation, without: &[WithoutInput]) -> String {
    let mut text = format!("{report}\n\n{}", inputs_text(explanation, without));
    text += "\n\nprograms: which act, how long in a row, and which inputs are unusual then (in standard deviations)";
    for acts in &explanation.programs {
        let output = acts
            .output
            .map_or_else(String::new, |output| format!(", output {output}"));
        let name = format!("team {}, program {}{output}", acts.team, acts.program);
        let when = acts
            .when
            .iter()
            .map(|when| format!("{} {:+.1}", when.input, when.shift));
        let when: Vec<String> = when.collect();
        text += &format!(
            "\n  {name:<30} {:>5.1} %  {:>7.1} steps  {}",
            100.0 * acts.share,
            acts.spell,
            when.join(", ")
        );
        text.truncate(text.trim_end().len());
    }
    text += "\n\nmemory: reads and writes for each decision, and the programs that do it";
    if explanation.memory.is_empty() {
        text += "\n  none is read or written";
    }
    for memory in &explanation.memory {
        let list = |programs: &[u16]| {
            let numbers: Vec<String> = programs.iter().map(u16::to_string).collect();
            match numbers.is_empty() {
                true => String::new(),
                false => format!(" by {}", numbers.join(", ")),
            }
        };
        text += &format!(
            "\n  team {} {:<12} {:.2} reads{}; {:.2} writes{}",
            memory.team,
            memory.place,
            memory.reads,
            list(&memory.readers),
            memory.writes,
            list(&memory.writers)
        );
    }
    text
}

/// A line for each input, those that matter most first.
fn inputs_text(explanation: &Explanation, without: &[WithoutInput]) -> String {
    let mut inputs: Vec<_> = explanation.inputs.iter().zip(without).collect();
    let drop = |without: &WithoutInput| stats::mean(&without.drops);
    inputs.sort_by(|(_, a), (_, b)| drop(b).total_cmp(&drop(a)));
    let longest = inputs
        .iter()
        .map(|(seen, _)| seen.name.chars().count())
        .max();
    let longest = longest.unwrap_or(0);
    let mut text = "inputs: what the mean return loses with each frozen at its mean, with a 95 % interval over the episodes".to_owned();
    for (seen, without) in inputs {
        let [low, high] = stats::bootstrap_mean_95(&without.drops);
        let matters = if low > 0.0 { "  matters" } else { "" };
        text += &format!(
            "\n  {:<longest$}  {:>9.2} [{low:.2}, {high:.2}]{matters}",
            seen.name,
            drop(without)
        );
    }
    text
}
