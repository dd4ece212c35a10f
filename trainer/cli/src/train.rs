//! `tpg train`

mod outputs;
mod ranks;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::config::configuration;
use super::progress::Progress;
use super::version::COMMIT;
use tpg_tasks::console::{command_line, note};
use tpg_tasks::exit_status::{Failure, Fault as _, Status};
use tpg_tasks::score::{LOOP_INPUTS, LOOP_OUTPUTS};
use tpg_tasks::task::{ActionSpace, is_from_file};
use tpg_trainer::evaluator::Evaluator;
use tpg_trainer::evolve::{Initial, linear_inputs};
use tpg_trainer::monitor::Monitor;
use tpg_trainer::run_folder::{Keep, Origin, RunFolder};
use tpg_trainer::session::{Budget, GenerationReport, Session, train};

use outputs::Outputs;
use ranks::Ranks;

/// Generations of a run that names no budget.
const DEFAULT_GENERATIONS: u64 = 100;

/// Arguments of `tpg train`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    tpg train hopper-sr-sm-b23 --seed 1 --minutes 10 --out runs/hopper\n  \
    tpg train --resume runs/hopper --minutes 20\n  \
    tpg train cartpole-sr-sm --set evolution.population=100 --generations 50 --out runs/small\n  \
    tpg train sr-sm-b23 --task docs/examples/crane/crane.toml --minutes 5 --out runs/crane")]
pub(crate) struct Args {
    /// Preset, see `tpg presets`; with --task also its variant alone, such as sr-sm or sl-b13.
    #[arg(required_unless_present = "resume", conflicts_with = "resume")]
    preset: Option<String>,
    /// Seed of the run, by default 0; one seed fixes the result for any number of threads.
    #[arg(long, value_name = "N", conflicts_with = "resume")]
    seed: Option<u64>,
    /// Threads that score, by default one for each core; not for the ranks of an MPI job, which have one each.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Train until this many generations are complete; 100 where no budget is named.
    #[arg(long, value_name = "N", group = "budget", value_parser = clap::value_parser!(u64).range(1..))]
    generations: Option<u64>,
    /// Train to the end of the generation that reaches this many environment steps.
    #[arg(long, value_name = "N", group = "budget", value_parser = clap::value_parser!(u64).range(1..))]
    steps: Option<u64>,
    /// Train for this many minutes; a generation that is not done by then does not count.
    #[arg(long, value_name = "M", group = "budget", value_parser = positive_minutes)]
    minutes: Option<f64>,
    /// Task in place of the preset's: its name, the path of the TOML file that describes it, or series:FILE.csv:COLUMN.
    #[arg(long, value_name = "TASK", conflicts_with = "resume")]
    task: Option<String>,
    /// Override a key of the configuration, such as evolution.population=200; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE", conflicts_with = "resume")]
    sets: Vec<String>,
    /// TOML file whose keys override the preset's.
    #[arg(long, value_name = "FILE", conflicts_with = "resume")]
    config: Option<PathBuf>,
    /// Folder for champion, log, checkpoint and configuration; must not hold a run yet. Default: runs/PRESET-SEED-N, the first N
    /// that is free.
    #[arg(long, value_name = "DIR", conflicts_with = "resume")]
    out: Option<PathBuf>,
    /// Go on with the run in this folder; budgets count from its very start.
    #[arg(long, value_name = "DIR")]
    resume: Option<PathBuf>,
    /// Go on although the files of the run's task have changed; scores of before and after cannot be compared.
    #[arg(long, requires = "resume")]
    accept_changed_task: bool,
    /// Generations between two rows of log.csv; a row takes about 100 bytes.
    #[arg(long, value_name = "N", default_value_t = 1, conflicts_with = "resume", value_parser = clap::value_parser!(u64).range(1..))]
    log_every: u64,
    /// Latest champions that stay in the folder champions/; 0 for all.
    #[arg(long, value_name = "N", default_value_t = 0, conflicts_with = "resume")]
    keep_champions: usize,
    /// Seconds between two checkpoints, so what a crash costs at most; 0 for one after each generation.
    #[arg(
        long,
        value_name = "SECONDS",
        default_value_t = 20,
        conflicts_with = "resume"
    )]
    checkpoint_every: u64,
    /// Print a JSON object a line to standard output: one when training begins, one for each generation, one at the end.
    #[arg(long)]
    json: bool,
    /// Write an event file for TensorBoard into the run's folder.
    #[arg(long)]
    tensorboard: bool,
}

fn positive_minutes(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(minutes) if minutes > 0.0 && minutes.is_finite() => Ok(minutes),
        _ => Err("must be a positive number of minutes".into()),
    }
}

impl Args {
    fn budget(&self) -> Option<Budget> {
        self.generations
            .map(Budget::Generations)
            .or(self.steps.map(Budget::Steps))
            .or(self.minutes.map(Budget::Minutes))
    }

    /// The session to begin or to go on with, its folder, and its budget.
    fn open(&self, threads: usize) -> Result<(Session, RunFolder, Budget), Failure> {
        if let Some(folder) = &self.resume {
            let (folder, session, recorded) =
                RunFolder::open(folder, self.accept_changed_task).map_err(Failure::of)?;
            let budget = self.budget().unwrap_or(recorded);
            return Ok((session, folder, budget));
        }
        let Some(name) = &self.preset else {
            return Err(Failure::usage(anyhow::anyhow!("a preset is needed")));
        };
        let (file, task) = (self.config.as_deref(), self.task.as_deref());
        let config = configuration(name, file, &self.sets, task)?;
        let seed = self.seed.unwrap_or(0);
        let session = Session::new(config, seed).or_usage("bad configuration")?;
        warn_of_the_loop(&session);
        warn_of_unseen_inputs(&session);
        let budget = self
            .budget()
            .unwrap_or(Budget::Generations(DEFAULT_GENERATIONS));
        let origin = Origin {
            preset: name.clone(),
            budget,
            command: command(),
            keep: Keep {
                log_every: self.log_every,
                champions: self.keep_champions,
                checkpoint_every: self.checkpoint_every,
            },
            threads,
            commit: COMMIT.map(str::to_owned),
        };
        let out = self.out.clone().unwrap_or_else(|| free_folder(name, seed));
        let folder = RunFolder::create(&out, &session, origin).map_err(Failure::of)?;
        if self.out.is_none() {
            note(format_args!("{}: the folder of this run", out.display()));
        }
        Ok((session, folder, budget))
    }
}

/// The words of this command. The program goes by its name: its path says something of a machine, nothing of the run.
fn command() -> Vec<String> {
    let mut words = std::env::args_os();
    let program = words.next().map(PathBuf::from);
    let program = program.as_deref().and_then(Path::file_name);
    let program = program.map(std::ffi::OsStr::to_owned);
    let words = program.into_iter().chain(words);
    words
        .map(|word| word.to_string_lossy().into_owned())
        .collect()
}

/// A folder below `runs` that does not exist.
fn free_folder(preset: &str, seed: u64) -> PathBuf {
    let mut folders = (1u64..).map(|n| Path::new("runs").join(format!("{preset}-{seed}-{n}")));
    let free = folders.find(|folder| !folder.exists());
    free.unwrap_or_default()
}

pub(crate) fn run(args: Args) -> Result<Status, Failure> {
    ranks::run(args.threads, |stop, ranks| train_here(&args, stop, ranks))
}

/// Trains with the threads of this process, or with the ranks of its job.
fn train_here(
    args: &Args,
    stop: Arc<AtomicBool>,
    ranks: Option<&mut Ranks>,
) -> Result<Status, Failure> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = match &ranks {
        Some(ranks) => ranks.size(),
        None => args.threads.map_or(cores, usize::from),
    };
    let (mut session, mut folder, budget) = args.open(threads)?;
    let monitor = Arc::new(Monitor::new(stop));
    let mut evaluator: Box<dyn Evaluator + '_> = match ranks {
        Some(ranks) => ranks.evaluator(&session, &monitor)?,
        None => {
            let pool = session.pool(threads).or_usage("bad configuration")?;
            Box::new(pool.with_monitor(monitor.clone()))
        }
    };
    let mut outputs = Outputs::begin(args.json, args.tensorboard, &session, &folder, threads)?;
    let mut progress = Progress::new(budget, &session, monitor.clone());
    let mut stability = Stability::default();
    let result = train(&mut session, &mut *evaluator, budget, |session, report| {
        progress.show(report);
        stability.count(report, monitor.instability());
        folder.record(session, report).map_err(Failure::of)?;
        outputs.generation(report)
    });
    progress.finish();
    result?;
    folder.finish(&session).map_err(Failure::of)?;
    outputs.end(&session, &folder, monitor.interrupted())?;
    summary(&session, &folder);
    if monitor.interrupted() {
        let folder = folder.path().display().to_string();
        let resume = command_line(["tpg", "train", "--resume", &folder]);
        note(format_args!("interrupted; go on with: {resume}"));
        return Ok(Status::Interrupted);
    }
    Ok(stability.status(monitor.instability()))
}

/// Says before training what the champion of this task cannot do afterwards.
fn warn_of_the_loop(session: &Session) {
    let shape = session.settings().policy_spec.shape;
    let inputs = usize::from(shape.inputs);
    let outputs = match shape.actions {
        ActionSpace::Discrete(_) => 0,
        ActionSpace::Continuous { len, .. } => usize::from(len),
    };
    if inputs > LOOP_INPUTS || outputs > LOOP_OUTPUTS {
        note(format_args!(
            "warning: the task has {inputs} inputs and {outputs} outputs; the loop (tpg hil) and boards on a serial line take at \
             most {LOOP_INPUTS} and {LOOP_OUTPUTS}, so they cannot run its champion"
        ));
    }
}

/// Says how much of a very long observation the linear policy of the first generation lacks.
fn warn_of_unseen_inputs(session: &Session) {
    let (shape, initial) = (
        session.settings().policy_spec.shape,
        session.settings().params.initial,
    );
    let (inputs, seen) = (shape.observed(), linear_inputs(&shape, initial));
    if initial != Initial::Random && seen < inputs {
        note(format_args!(
            "warning: a linear policy has registers for the first {seen} of {inputs} inputs, earlier observations included; put those that matter first"
        ));
    }
}

/// Says where the champion is, and how to score it.
fn summary(session: &Session, folder: &RunFolder) {
    let Some((_, record)) = session.champion() else {
        return note(format_args!(
            "{}: no generation was completed, so there is no champion yet",
            folder.path().display()
        ));
    };
    let champion = folder.champion();
    note(format_args!(
        "{} after {} generations, {} steps: training score {:.2}; \
         the mean over fresh episodes is lower: {}",
        champion.display(),
        session.generation(),
        session.steps(),
        record.score,
        eval_command(&champion, &session.config().task),
    ));
}

/// The first reason, in brackets.
fn because(reason: Option<&str>) -> String {
    reason.map_or_else(String::new, |reason| format!(" (first: {reason})"))
}

/// Counts the episodes that an unstable simulation ended.
#[derive(Debug, Default)]
struct Stability {
    unstable: u64,
    episodes: u64,
}

impl Stability {
    /// Many are a warning.
    const MANY: f64 = 0.1;

    fn count(&mut self, report: &GenerationReport, reason: Option<&str>) {
        self.unstable += report.unstable;
        self.episodes += report.episodes;
        if report.unstable as f64 > Self::MANY * report.episodes as f64 {
            note(format_args!(
                "warning: {} of {} episodes of generation {} became unstable and were ended{}",
                report.unstable,
                report.episodes,
                report.generation,
                because(reason)
            ));
        }
    }

    /// Says how many there were in all; a run in which all were so has failed.
    fn status(&self, reason: Option<&str>) -> Status {
        if self.unstable == 0 {
            return Status::Fine;
        }
        note(format_args!(
            "warning: {} of {} episodes became unstable{}; check the model, its time step, and the range of its controls",
            self.unstable,
            self.episodes,
            because(reason)
        ));
        match self.unstable == self.episodes {
            true => Status::Peer,
            false => Status::Fine,
        }
    }
}

/// The command that scores a champion; one of a task from a file is scored only with that file at hand.
fn eval_command(champion: &Path, task: &str) -> String {
    let champion = champion.display().to_string();
    let mut words = vec!["tpg", "eval", &champion];
    if is_from_file(task) {
        words.extend(["--task", task]);
    }
    command_line(words)
}
