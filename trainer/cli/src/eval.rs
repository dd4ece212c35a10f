//! `tpg eval`

mod animation;

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

use tpg_runtime::{HostAgent, Policy, Restore};

use tpg_tasks::console::{note, print, print_json};
use tpg_tasks::eval::{
    Arena, CountingWinners, Episode, EvaluationError, Forgetful, MostUsed, evaluate,
};
use tpg_tasks::exit_status::{Failure, Fault as _, Status};
use tpg_tasks::score::{ScoreArgs, Setup};
use tpg_tasks::stats;
use tpg_tasks::task::stack_text;
use tpg_tasks::trace::{Header, RecordError, TracingController};
use tpg_tasks::view::view;
use tpg_tools::cut::cut;

use crate::health::Health;
use animation::{Animation, Size};

/// Arguments of `tpg eval`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    tpg eval champion.tpg --episodes 100 --baselines\n  \
    tpg eval champion.tpg --episodes 100 --ablate memory\n  \
    tpg eval champion.tpg --health --disturb \"at 2s stuck:3 for 5s\"\n  \
    tpg eval champion.tpg --episodes 1000 --most-used-program cut.tpg\n  \
    tpg eval champion.tpg --episodes 5 --view champion.html")]
pub(crate) struct Args {
    #[command(flatten)]
    score: ScoreArgs,
    /// Score the zero and the random policy on the same episodes too; of a series also persistence and a linear autoregression.
    #[arg(long)]
    baselines: bool,
    /// Score the policy once more on the same episodes, with this reset to its evolved constants before every decision.
    #[arg(
        long,
        value_name = "registers|memory|all",
        value_enum,
        hide_possible_values = true
    )]
    ablate: Option<Ablation>,
    /// Score once more with nothing but the program that acts most often, and write that policy to a file.
    #[arg(long, value_name = "FILE")]
    most_used_program: Option<PathBuf>,
    /// Compare what the sensors show with what the policy's own model expects, and name suspect channels.
    #[arg(long)]
    health: bool,
    /// Record every decision to a file, for `tpg replay`.
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
    /// Write a page to look at: the first episodes drawn in three dimensions, with what the policy saw, did and earned.
    #[arg(long, value_name = "OUT.html")]
    view: Option<PathBuf>,
    /// Write an animation, drawn by MuJoCo's own renderer: the first episode, up to 30 s of it. Needs a build with the
    /// feature render.
    #[arg(long, value_name = "OUT.gif")]
    animate: Option<PathBuf>,
    /// Width and height of the animation, in pixels.
    #[arg(
        long,
        value_name = "WIDTHxHEIGHT",
        default_value = "320x240",
        requires = "animate"
    )]
    animate_size: Size,
}

/// What a policy forgets before every decision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Ablation {
    Registers,
    Memory,
    All,
}

impl Ablation {
    const fn restore(self) -> Restore {
        match self {
            Ablation::Registers => Restore::Registers,
            Ablation::Memory => Restore::Memory,
            Ablation::All => Restore::All,
        }
    }

    const fn name(self) -> &'static str {
        match self {
            Ablation::Registers => "registers",
            Ablation::Memory => "memory",
            Ablation::All => "all",
        }
    }

    /// What the row of the result is called.
    const fn row(self) -> &'static str {
        match self {
            Ablation::Registers => "no registers",
            Ablation::Memory => "no memory",
            Ablation::All => "forgetful",
        }
    }
}

pub(crate) fn run(args: Args) -> Result<Status, Failure> {
    let setup = args.score.resolve()?;
    let mut agent = host_agent(&setup.blob, &setup.file)?;
    let mut arena = setup.arena()?;
    let animation = args.animate.as_deref();
    let animation = animation.map(|path| Animation::open(path, &setup, args.animate_size));
    let animation = animation.transpose()?;
    let page = args.view.as_deref().map(Page::create).transpose()?;
    let episodes = match &args.trace {
        Some(file) => record(&setup, &mut arena, agent, file)?,
        None => {
            let mut controller = setup.disturbed(&arena, &mut *agent)?;
            evaluate(&mut arena, &mut controller, setup.episode_seeds())?
        }
    };
    let report = setup.report(&episodes);
    let unstable = report.unstable;
    if let Some(page) = page {
        page.write(&setup)?;
    }
    if let Some(animation) = animation {
        animation.write(&setup)?;
    }
    let ablated = args.ablate.map(|what| ablated(&setup, what)).transpose()?;
    let ablated = ablated.map(|returns| Comparison::new(&report.returns, returns));
    let cut = args.most_used_program.as_deref();
    let cut = cut.map(|file| cut_to_most_used(&setup, file)).transpose()?;
    let cut = cut.map(|(used, returns)| (used, Comparison::new(&report.returns, returns)));
    let health = (args.health)
        .then(|| Health::of(&setup, host_agent(&setup.blob, &setup.file)?))
        .transpose()?;
    let baselines = if args.baselines {
        crate::baselines::baselines(&setup)?
    } else {
        Vec::new()
    };
    if setup.json {
        let mut value = serde_json::to_value(&report)?;
        for (name, returns) in &baselines {
            value[format!("{name}_mean")] = stats::mean(returns).into();
            value[format!("{name}_mean_ci95")] = stats::bootstrap_mean_95(returns).to_vec().into();
        }
        if let (Some(what), Some(comparison)) = (args.ablate, &ablated) {
            value["ablation"] = comparison.json();
            value["ablation"]["what"] = what.name().into();
        }
        if let Some((used, comparison)) = &cut {
            value["most_used_program"] = comparison.json();
            value["most_used_program"]["share"] = used.share.into();
        }
        if let Some(health) = &health {
            value["health"] = health.json();
        }
        print_json(&value)?;
    } else {
        print(report)?;
        if let (Some(what), Some(comparison)) = (args.ablate, &ablated) {
            print(comparison.text(what.row()))?;
        }
        if let Some((used, comparison)) = &cut {
            print(comparison.text("most used"))?;
            let percent = 100.0 * used.share;
            print(format_args!(
                "               acts in {percent:.1} % of the decisions"
            ))?;
        }
        if let Some(health) = &health {
            print(health.text())?;
        }
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

/// The file of a page, opened before episodes run, so that they do not run in vain.
struct Page<'a> {
    path: &'a Path,
    file: File,
}

impl<'a> Page<'a> {
    fn create(path: &'a Path) -> Result<Self, Failure> {
        let file = File::create(path).or_unwritable(path)?;
        Ok(Page { path, file })
    }

    /// Draws the first episodes and says where.
    fn write(mut self, setup: &Setup) -> Result<(), Failure> {
        let view = view(setup)?;
        (self.file.write_all(view.html.as_bytes())).or_unwritable(self.path)?;
        let (shown, path) = (view.episodes, self.path.display());
        note(format_args!(
            "view: {path} shows {shown} of {} episodes; open it in a browser",
            setup.episodes
        ));
        Ok(())
    }
}

/// A changed policy beside the policy itself, on the same episodes.
struct Comparison {
    returns: Vec<f64>,
    /// What each episode loses by the change.
    drops: Vec<f64>,
}

impl Comparison {
    fn new(whole: &[f64], returns: Vec<f64>) -> Self {
        let drops = whole.iter().zip(&returns).map(|(a, b)| a - b).collect();
        Comparison { returns, drops }
    }

    fn json(&self) -> serde_json::Value {
        serde_json::json!({
            "returns": self.returns,
            "mean": stats::mean(&self.returns),
            "mean_ci95": stats::bootstrap_mean_95(&self.returns),
            "drop": stats::mean(&self.drops),
            "drop_ci95": stats::bootstrap_mean_95(&self.drops),
        })
    }

    fn text(&self, name: &str) -> String {
        let [low, high] = stats::bootstrap_mean_95(&self.returns);
        let [least, most] = stats::bootstrap_mean_95(&self.drops);
        format!(
            "{name:<14} {:.2} [{low:.2}, {high:.2}], a drop of {:.2} [{least:.2}, {most:.2}]",
            stats::mean(&self.returns),
            stats::mean(&self.drops)
        )
    }
}

fn host_agent<'p>(blob: &'p [u8], file: &Path) -> Result<Box<HostAgent<'p>>, Failure> {
    let policy = Policy::load(blob)?;
    let agent = HostAgent::new(policy).or_bad_input(format!("cannot run {}", file.display()))?;
    Ok(Box::new(agent))
}

/// Returns of the policy that forgets, on the same episodes.
fn ablated(setup: &Setup, what: Ablation) -> Result<Vec<f64>, Failure> {
    let mut arena = setup.arena()?;
    let agent = host_agent(&setup.blob, &setup.file)?;
    let mut controller = setup.disturbed(&arena, Forgetful::new(agent, what.restore()))?;
    let episodes = evaluate(&mut arena, &mut controller, setup.episode_seeds())?;
    Ok(episodes.iter().map(|e| e.total).collect())
}

/// Writes the policy with nothing but its most used program, and returns what that scores on the same episodes.
fn cut_to_most_used(setup: &Setup, file: &Path) -> Result<(MostUsed, Vec<f64>), Failure> {
    let mut arena = setup.arena()?;
    let agent = host_agent(&setup.blob, &setup.file)?;
    let mut counting = setup.disturbed(&arena, CountingWinners::new(agent))?;
    evaluate(&mut arena, &mut counting, setup.episode_seeds())?;
    let used = counting.into_inner().most_used();
    let used = used.ok_or_else(|| anyhow::anyhow!("no program has acted"))?;
    let policy = Policy::load(&setup.blob)?;
    let blob = cut(&policy, used.team, &used.programs)?;
    std::fs::write(file, &blob).or_unwritable(file)?;
    let mut agent = host_agent(&blob, file)?;
    let mut controller = setup.disturbed(&arena, &mut *agent)?;
    let episodes = evaluate(&mut arena, &mut controller, setup.episode_seeds())?;
    Ok((used, episodes.iter().map(|e| e.total).collect()))
}
