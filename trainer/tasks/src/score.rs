//! What `tpg eval` and `tpg hil` have in common: which policy, on which task, for which episodes.

use std::fmt;
use std::path::PathBuf;

use serde::Serialize;
use tpg_runtime::{Header, Policy};

use crate::eval::{Arena, Disturbance, Disturbed, Domain, Episode, Line, Link, episode_seed};
use crate::exit_status::{Failure, Fault as _};
use crate::stats;
use crate::task::{
    self, ActionSpace, Observability, Randomization, Spec, Task, UnknownTask, Wrappers,
    parse_stack, stack_text,
};

/// Most inputs of a policy in the loop, and on a serial line to a board.
pub const LOOP_INPUTS: usize = 512;
/// Most outputs of a policy in the loop.
pub const LOOP_OUTPUTS: usize = 256;

/// Arguments of a scoring command.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct ScoreArgs {
    /// Exported policy, or the folder of a run, whose champion is meant.
    #[cfg_attr(feature = "clap", arg(value_name = "FILE.tpg"))]
    pub file: PathBuf,
    /// Task, path of the TOML file that describes it, or series:FILE.csv:COLUMN; by default the task that the policy was evolved for.
    #[cfg_attr(feature = "clap", arg(long, value_name = "TASK"))]
    pub task: Option<String>,
    /// What the policy sees: none, velocities-removed, blackout:2/3; may be repeated. Default: as evolved.
    #[cfg_attr(feature = "clap", arg(long, value_name = "WRAPPER"))]
    pub observability: Vec<String>,
    /// Disturb the link: delay:2, loss:1/10, noise:0.01, quantise:0.001; for one channel, by number or name: drop:3:1/10,
    /// nan:3:1/10, stuck:3, bias:3:0.1, noise:3:0.01. `action:` before it disturbs actions; "at 2.0s stuck:3 for 0.5s" says
    /// when. May be repeated, applied in order.
    #[cfg_attr(feature = "clap", arg(long, value_name = "WRAPPER"))]
    pub disturb: Vec<Disturbance>,
    /// Whether the robot differs from episode to episode as the table randomize of the task's file says.
    #[cfg_attr(
        feature = "clap",
        arg(
            long,
            value_name = "on|off",
            value_enum,
            hide_possible_values = true,
            default_value = "on"
        )
    )]
    pub randomize: Randomization,
    /// Number of test episodes.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..)))]
    pub episodes: u32,
    /// Seed of the test episodes: episode k is the same for every policy.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", default_value_t = 0))]
    pub seed: u64,
    /// Print one JSON object to standard output.
    #[cfg_attr(feature = "clap", arg(long))]
    pub json: bool,
}

/// A scoring command whose arguments have been checked against policy and task.
#[derive(Debug, Clone)]
pub struct Setup {
    /// Where the policy came from.
    pub file: PathBuf,
    /// The policy's bytes, verified.
    pub blob: Vec<u8>,
    /// Full name of the task.
    pub task: String,
    /// Name of the task, or absolute path of the file that describes it.
    pub task_source: String,
    /// What the policy sees.
    pub observability: Vec<Observability>,
    /// What happens to observations and actions on their way.
    pub disturb: Vec<Disturbance>,
    /// Whether the robot differs from episode to episode.
    pub randomize: Randomization,
    /// Number of episodes.
    pub episodes: u32,
    /// Seed of the episodes.
    pub seed: u64,
    /// Whether to print JSON.
    pub json: bool,
}

impl ScoreArgs {
    /// Reads and verifies the policy, fills in its defaults and checks that it fits the task.
    ///
    /// # Errors
    /// A [`Failure`] with its status: the file, the task's name, a wrapper, or a misfit between them.
    pub fn resolve(self) -> Result<Setup, Failure> {
        let file = match self.file.is_dir() {
            true => self.file.join("champion.tpg"),
            false => self.file.clone(),
        };
        let blob = std::fs::read(&file).or_bad_input(format!("cannot read {}", file.display()))?;
        ScoreArgs { file, ..self }.resolve_bytes(blob)
    }

    /// The same for the bytes of a policy that was read before; `file` is its name in messages.
    ///
    /// # Errors
    /// A [`Failure`] as for [`resolve`](Self::resolve).
    pub fn resolve_bytes(self, blob: Vec<u8>) -> Result<Setup, Failure> {
        let file = self.file;
        let policy = Policy::load(&blob).or_bad_input(format!("cannot use {}", file.display()))?;
        let observability = if self.observability.is_empty() {
            parse_stack(policy.tables().observability).or_bad_input(format!(
                "{} names its observability wrongly",
                file.display()
            ))?
        } else {
            parse_stack(&self.observability.join("+")).or_usage("bad --observability")?
        };
        let evolved_for = policy.tables().task;
        if self.task.is_none() && task::is_from_file(evolved_for) {
            return Err(Failure::usage(anyhow::anyhow!(
                "{} was evolved for the task {evolved_for:?}: say where its file is by --task series:path/to/FILE.csv:COLUMN",
                file.display()
            )));
        }
        let task_source = task::locate(self.task.as_deref().unwrap_or(evolved_for));
        let task = match task::create_with(&task_source, self.randomize) {
            Err(UnknownTask::NoSuchName { name, .. }) if self.task.is_none() => {
                return Err(Failure::usage(anyhow::anyhow!(
                    "{} was evolved for the task {name:?}, which is not built in: give the file that describes it by \
                     --task path/to/task.toml",
                    file.display()
                )));
            }
            created => bad_task(created)?,
        };
        let wrappers =
            Wrappers::new(&observability, task.spec()).or_usage("bad --observability")?;
        check_fit(policy.header(), task.spec(), wrappers.inputs().len())?;
        Disturbed::new((), &self.disturb, &link(task.spec(), &wrappers))
            .or_usage("bad --disturb")?;
        let task = task.spec().name.clone();
        Ok(Setup {
            file,
            task,
            task_source,
            observability,
            disturb: self.disturb,
            randomize: self.randomize,
            episodes: self.episodes,
            seed: self.seed,
            json: self.json,
            blob,
        })
    }
}

/// Gives the error of a task that cannot be made its exit status.
fn bad_task<T>(created: Result<T, UnknownTask>) -> Result<T, Failure> {
    created.map_err(|error| match error {
        UnknownTask::BadFile { .. } => Failure::bad_input(error),
        _ => Failure::usage(error),
    })
}

/// Refuses a policy whose inputs or actions are not the task's.
fn check_fit(header: &Header, spec: &Spec, seen: usize) -> Result<(), Failure> {
    let misfit = |policy: String, task: String| {
        Err(Failure::usage(anyhow::anyhow!(
            "policy does not fit task {}: the policy {policy}, the task {task}; \
             choose --task and --observability as it was evolved",
            spec.name
        )))
    };
    let inputs = usize::from(header.observation_len);
    if inputs != seen {
        return misfit(format!("has {inputs} inputs"), format!("offers {seen}"));
    }
    let (policy, task) = (header_actions(header), spec.actions);
    if policy != task {
        return misfit(format!("chooses {policy}"), format!("takes {task}"));
    }
    Ok(())
}

/// The actions that a policy chooses from.
#[must_use]
pub fn header_actions(header: &Header) -> ActionSpace {
    match header.outputs() {
        0 => ActionSpace::Discrete(header.actions),
        _ => ActionSpace::Continuous {
            len: header.actions,
            low: header.action_low,
            high: header.action_high,
        },
    }
}

impl Setup {
    /// The task behind its wrappers.
    ///
    /// # Errors
    /// A [`Failure`] if the task cannot be made again.
    pub fn arena(&self) -> Result<Arena, Failure> {
        let (task, wrappers) = self.task_and_wrappers()?;
        Ok(Arena::new(task, wrappers))
    }

    /// The parts of [`arena`](Self::arena).
    pub(crate) fn task_and_wrappers(&self) -> Result<(Box<dyn Task>, Wrappers), Failure> {
        let task = bad_task(task::create_with(&self.task_source, self.randomize))?;
        let wrappers =
            Wrappers::new(&self.observability, task.spec()).or_usage("bad --observability")?;
        Ok((task, wrappers))
    }

    /// The task behind its wrappers and the disturbances, for controllers that stand behind none.
    ///
    /// # Errors
    /// A [`Failure`] if the task cannot be made again.
    pub fn disturbed_arena(&self) -> Result<Arena, Failure> {
        let arena = self.arena()?;
        let link = link(arena.task().spec(), arena.wrappers());
        let line = Line::new(&self.disturb, &link).or_usage("bad --disturb")?;
        Ok(arena.with_line(line))
    }

    /// A controller behind the disturbances, for an arena of this setup.
    ///
    /// # Errors
    /// A [`Failure`] if a disturbance does not fit the task's actions.
    pub fn disturbed<C>(&self, arena: &Arena, controller: C) -> Result<Disturbed<C>, Failure> {
        let link = link(arena.task().spec(), arena.wrappers());
        Disturbed::new(controller, &self.disturb, &link).or_usage("bad --disturb")
    }

    /// The seeds of the episodes, in order.
    pub fn episode_seeds(&self) -> impl Iterator<Item = u64> + use<> {
        self.endless_seeds().take(self.episodes as usize)
    }

    /// The seeds of the episodes and of those that would follow them, without end.
    pub fn endless_seeds(&self) -> impl Iterator<Item = u64> + use<> {
        let seed = self.seed;
        (0..).map(move |k| episode_seed(Domain::Test, seed, 0, k))
    }

    /// The result of the episodes, for printing.
    #[must_use]
    pub fn report(&self, episodes: &[Episode]) -> Report {
        let returns: Vec<f64> = episodes.iter().map(|e| e.total).collect();
        let steps: u64 = episodes.iter().map(|e| u64::from(e.steps)).sum();
        let instructions: u64 = episodes.iter().map(|e| e.instructions).sum();
        Report {
            task: self.task.clone(),
            observability: stack_text(&self.observability),
            disturbances: self.disturb.iter().map(ToString::to_string).collect(),
            randomize: self.randomize == Randomization::On,
            seed: self.seed,
            mean: stats::mean(&returns),
            mean_ci95: stats::bootstrap_mean_95(&returns),
            sd: stats::standard_deviation(&returns),
            lengths: episodes.iter().map(|e| e.steps).collect(),
            instructions_mean: instructions as f64 / steps as f64,
            unstable: episodes.iter().filter(|e| e.unstable).count(),
            returns,
        }
    }
}

/// What the link to a policy carries.
fn link<'a>(spec: &'a Spec, wrappers: &'a Wrappers) -> Link<'a> {
    Link {
        inputs: wrappers.inputs(),
        outputs: &spec.outputs,
        actions: spec.actions,
        period_us: spec.period_us,
    }
}

/// The result of a scoring command; its fields are the keys of `--json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Full name of the task.
    pub task: String,
    /// What the policy saw.
    pub observability: String,
    /// What happened to observations and actions on their way, in order.
    pub disturbances: Vec<String>,
    /// Whether the robot differed from episode to episode where the task says so.
    pub randomize: bool,
    /// Seed of the episodes.
    pub seed: u64,
    /// Return of each episode.
    pub returns: Vec<f64>,
    /// Control steps of each episode.
    pub lengths: Vec<u32>,
    /// Mean return.
    pub mean: f64,
    /// 95 % bootstrap interval of the mean return.
    pub mean_ci95: [f64; 2],
    /// Sample standard deviation of the returns; 0 for a single episode.
    pub sd: f64,
    /// Instructions executed per decision.
    pub instructions_mean: f64,
    /// Episodes that an unstable simulation ended.
    pub unstable: usize,
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let n = self.returns.len();
        let steps: u64 = self.lengths.iter().map(|l| u64::from(*l)).sum();
        writeln!(f, "task           {}", self.task)?;
        writeln!(f, "observability  {}", self.observability)?;
        if !self.disturbances.is_empty() {
            writeln!(f, "disturbances   {}", self.disturbances.join(", "))?;
        }
        if !self.randomize {
            writeln!(f, "randomize      off")?;
        }
        writeln!(f, "episodes       {n}, seed {}", self.seed)?;
        let [low, high] = self.mean_ci95;
        writeln!(
            f,
            "mean return    {:.2} [{low:.2}, {high:.2}], sd {:.2}",
            self.mean, self.sd
        )?;
        writeln!(f, "mean length    {:.1} steps", steps as f64 / n as f64)?;
        write!(
            f,
            "instructions   {:.1} per decision",
            self.instructions_mean
        )?;
        if self.unstable > 0 {
            write!(f, "\nunstable       {} episodes", self.unstable)?;
        }
        Ok(())
    }
}
