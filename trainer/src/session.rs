//! A training run: the only place that wires tasks, scoring and evolution.

mod checkpoint;
mod curriculum;
mod eval_stats;
mod front_end;
mod provenance;
mod race;
mod record;
mod report;
mod scoring;
mod state;
mod stored_population;
#[cfg(test)]
mod tests;
mod tuning;

use std::error::Error;
use std::fmt;
use std::sync::mpsc;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use tpg_runtime::Policy;
use tpg_runtime::rng::mix64;

use crate::config::{Config, ConfigError, Settings};
use crate::evaluator::{Evaluator, EvaluatorError};
use crate::evolve::{Child, Population, TeamId, Variation, select};
use crate::front_end::Learner;
use crate::lower::{LowerError, Mode, lower};
use crate::pool::Pool;
use tpg_tasks::task::{Rng, Spec};

use eval_stats::EvalStats;
use provenance::Provenance;
use record::Candidate;
use state::State;

pub use checkpoint::{
    Checkpoint, CheckpointError, LogMark, Snapshot, TaskFile, load, load_external,
};
pub use record::Record;
pub use report::GenerationReport;

/// Marks the random stream of evolution among those that derive from a run's seed.
const EVOLUTION_STREAM: u64 = 4;

/// When a run is over; each is a total over the run's whole life, resumes included. Files write `{ generations = 40 }`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Budget {
    /// After this many generations.
    Generations(u64),
    /// At the first end of a generation at or past this many environment steps.
    Steps(u64),
    /// After this many minutes of training; a generation that is not done by then does not count.
    Minutes(f64),
}

impl Budget {
    /// Names of the kinds, as files write them.
    pub const KEYS: [&str; 3] = ["generations", "steps", "minutes"];

    /// Whether a run may last at all.
    #[must_use]
    pub fn is_positive(self) -> bool {
        match self {
            Budget::Generations(n) | Budget::Steps(n) => n > 0,
            Budget::Minutes(minutes) => minutes > 0.0 && minutes.is_finite(),
        }
    }

    /// Share of the budget that is used, 1 when it is used up.
    #[must_use]
    pub fn used(&self, session: &Session) -> f64 {
        let share = match *self {
            Budget::Generations(n) => session.generation() as f64 / n as f64,
            Budget::Steps(n) => session.steps() as f64 / n as f64,
            Budget::Minutes(m) => session.seconds() / (60.0 * m),
        };
        // A budget of zero is used up from the start.
        if share.is_nan() { 1.0 } else { share }
    }

    /// How long training may go on from here; `None` if time does not limit it.
    fn time_left(&self, session: &Session) -> Option<Duration> {
        match *self {
            Budget::Minutes(minutes) => {
                let left = (60.0 * minutes - session.seconds()).max(0.0);
                // So long that no timer can hold it is no limit.
                Duration::try_from_secs_f64(left).ok()
            }
            Budget::Generations(_) | Budget::Steps(_) => None,
        }
    }
}

/// As rows of experiments show it: `generations:40`.
impl fmt::Display for Budget {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Budget::Generations(n) => write!(f, "generations:{n}"),
            Budget::Steps(n) => write!(f, "steps:{n}"),
            Budget::Minutes(minutes) => write!(f, "minutes:{minutes}"),
        }
    }
}

/// Time that the parts of a run took outside of scoring, which [`Pool::spent`] tells.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Overhead {
    /// Making new teams.
    pub variation: Duration,
    /// Choosing survivors and collecting what nothing reaches any more.
    pub selection: Duration,
    /// Finding and exporting the champion, and summing up.
    pub report: Duration,
}

impl Overhead {
    /// All of it.
    #[must_use]
    pub fn total(&self) -> Duration {
        self.variation + self.selection + self.report
    }
}

/// The champion's blob, kept for as long as it is the champion.
struct Exported {
    root: TeamId,
    blob: Vec<u8>,
    /// Teams, programs, instructions.
    sizes: (u16, u16, u32),
}

/// A training run between two generations.
pub struct Session {
    config: Config,
    settings: Settings,
    provenance: Provenance,
    seed: u64,
    state: State,
    /// Learns what policies perceive; `None` if they see observations as they are.
    learner: Option<Learner>,
    exported: Option<Exported>,
    overhead: Overhead,
}

/// Why a run could not go on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SessionError {
    /// The configuration makes no sense.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The champion cannot be exported.
    #[error("the champion cannot be exported")]
    Export(#[from] LowerError),
    /// No individual of a generation could be scored.
    #[error(
        "no team of generation {generation} could be scored; smaller programs or teams may help"
    )]
    NothingScored {
        /// The generation.
        generation: u64,
    },
    /// The generation was stopped before its end; it can be made again.
    #[error("stopped in the middle of a generation")]
    Stopped,
    /// Episodes could not be run; the generation can be made again.
    #[error("the policies of a generation could not be scored")]
    Evaluation(#[source] Box<dyn Error + Send + Sync>),
}

impl From<EvaluatorError> for SessionError {
    fn from(error: EvaluatorError) -> Self {
        match error {
            EvaluatorError::Stopped => SessionError::Stopped,
            EvaluatorError::Failed(error) => SessionError::Evaluation(error),
        }
    }
}

impl Session {
    /// Begins a run; the first generation is made and scored by the first [`Session::advance`].
    ///
    /// # Errors
    /// [`SessionError::Config`].
    pub fn new(config: Config, seed: u64) -> Result<Self, SessionError> {
        let settings = Settings::new(&config)?;
        Ok(Session::of(config, settings, seed))
    }

    /// Begins a run on a task whose episodes somebody else runs, such as an environment in Python.
    ///
    /// # Errors
    /// [`SessionError::Config`].
    pub fn external(mut config: Config, seed: u64, spec: &Spec) -> Result<Self, SessionError> {
        config.task.clone_from(&spec.name);
        let settings = Settings::external(&config, spec)?;
        Ok(Session::of(config, settings, seed))
    }

    fn of(config: Config, settings: Settings, seed: u64) -> Self {
        Session {
            learner: front_end::learner(&settings),
            provenance: Provenance::new(&config, &settings.task_identity, seed),
            config,
            settings,
            seed,
            state: State::default(),
            exported: None,
            overhead: Overhead::default(),
        }
    }

    /// Begins a run whose first generation is not random but this one, such as a fixture to measure with.
    ///
    /// # Errors
    /// [`SessionError::Config`].
    pub fn with_population(
        config: Config,
        seed: u64,
        population: Population,
    ) -> Result<Self, SessionError> {
        let mut session = Session::new(config, seed)?;
        session.state.population = population;
        Ok(session)
    }

    /// The configuration of the run.
    #[must_use]
    pub const fn config(&self) -> &Config {
        &self.config
    }

    /// The configuration's meaning.
    #[must_use]
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The run's seed.
    #[must_use]
    pub const fn seed(&self) -> u64 {
        self.seed
    }

    /// Generations completed.
    #[must_use]
    pub const fn generation(&self) -> u64 {
        self.state.generation
    }

    /// Environment steps of all training episodes so far.
    #[must_use]
    pub const fn steps(&self) -> u64 {
        self.state.steps
    }

    /// Seconds spent in training, over all resumes.
    #[must_use]
    pub const fn seconds(&self) -> f64 {
        self.state.seconds
    }

    /// What this process has spent on the run outside of scoring.
    #[must_use]
    pub const fn overhead(&self) -> &Overhead {
        &self.overhead
    }

    /// Arenas for a number of threads.
    ///
    /// # Errors
    /// [`SessionError::Config`] if the task is not to be had.
    pub fn pool(&self, threads: usize) -> Result<Pool, SessionError> {
        let arenas = (0..threads.max(1)).map(|_| self.settings.arena());
        Ok(Pool::new(arenas.collect::<Result<_, _>>()?))
    }

    /// Makes, scores and selects one generation.
    ///
    /// # Errors
    /// [`SessionError::NothingScored`] where no individual could be scored. [`SessionError::Stopped`] soon after the
    /// evaluator's monitor was stopped, and [`SessionError::Evaluation`] where it failed: the session is then as it was
    /// before, and the same generation can be made again.
    pub fn advance(
        &mut self,
        evaluator: &mut dyn Evaluator,
    ) -> Result<GenerationReport, SessionError> {
        let before = self.state.clone();
        let started = Instant::now();
        let (fresh, stats) = match self.score_generation(evaluator) {
            Ok(scored) => scored,
            Err(error) => {
                self.state = before;
                evaluator.take_recordings();
                return Err(error.into());
            }
        };
        drop(before);
        self.learn(evaluator);
        let scored = Instant::now();
        self.select(&fresh);
        self.overhead.selection += scored.elapsed();
        self.state.generation += 1;
        self.state.steps += stats.steps;
        self.state.seconds += started.elapsed().as_secs_f64();
        let selected = Instant::now();
        let report = self.report(&stats);
        self.overhead.report += selected.elapsed();
        report
    }

    /// Makes and scores the candidates of a generation; the new ones among them, and what scoring came to.
    fn score_generation(
        &mut self,
        evaluator: &mut dyn Evaluator,
    ) -> Result<(Vec<TeamId>, EvalStats), EvaluatorError> {
        let started = Instant::now();
        let mut candidates = self.make_generation();
        self.overhead.variation += started.elapsed();
        let fresh: Vec<TeamId> = candidates.iter().map(|candidate| candidate.root).collect();
        let mut stats = EvalStats::default();
        candidates.extend(self.advance_curriculum());
        candidates.extend(self.elites());
        let episodes = candidates.len() as u64 * u64::from(self.settings.episodes);
        evaluator.monitor().begin(episodes + self.planned_trials());
        candidates.extend(self.tune(evaluator, &mut stats)?);
        self.score(evaluator, &candidates, &mut stats)?;
        self.race(evaluator, &mut stats)?;
        Ok((fresh, stats))
    }

    /// Keeps the best roots, and forgets everything of the others.
    fn select(&mut self, fresh: &[TeamId]) {
        let fresh = fresh.iter().map(|root| self.state.records[root].score);
        let median = tpg_tasks::stats::median(&fresh.collect::<Vec<f64>>());
        let protected: Vec<TeamId> = self.tuned().chain(self.state.race.champion).collect();
        let state = &mut self.state;
        state.medians = [Some(median), state.medians[0]];
        let mut scores = state.fitness();
        let keep = self.settings.params.population as usize;
        let ties = self.settings.params.ties;
        select(&mut state.population, &mut scores, keep, ties, &protected);
        let survives = |id: &TeamId| scores.binary_search_by_key(id, |(kept, _)| *kept).is_ok();
        state.records.retain(|id, _| survives(id));
        state.race.returns.retain(|id, _| survives(id));
        self.forget();
    }

    /// The best roots so far, which are scored again.
    fn elites(&self) -> Vec<Candidate> {
        let elites = self.settings.elites as usize;
        if elites == 0 {
            return Vec::new();
        }
        let best = self.state.ranking().into_iter().take(elites);
        best.map(|(root, _)| self.candidate(root, root)).collect()
    }

    /// A root that is to be scored; its episodes may be expected to last as those of its `kin`.
    fn candidate(&self, root: TeamId, kin: TeamId) -> Candidate {
        Candidate {
            root,
            expected: self.state.records.get(&kin).map_or(0.0, |r| r.steps_mean),
        }
    }

    /// The new roots of this generation: random ones at first, children later.
    fn make_generation(&mut self) -> Vec<Candidate> {
        let mut rng = Rng::new(mix64(&[self.seed, self.state.generation, EVOLUTION_STREAM]));
        let (genes, params) = (&self.settings.genes, &self.settings.params);
        if self.state.generation == 0 {
            if self.state.population.roots.is_empty() {
                self.state.population = Population::random(genes, params, &mut rng);
            }
            let roots = self.state.population.roots.iter();
            return roots.map(|root| self.candidate(*root, *root)).collect();
        }
        let variation = Variation {
            genes,
            params,
            scores: &self.state.fitness(),
        };
        let children = variation.children(&mut self.state.population, &mut rng);
        let candidate = |child: &Child| self.candidate(child.team, child.parent);
        children.iter().map(candidate).collect()
    }

    /// The blob of a root, as it was scored in `generation` with the memory that it found.
    fn export(
        &self,
        root: TeamId,
        generation: u64,
        memory: Option<&[f32]>,
        mode: Mode,
    ) -> Result<Vec<u8>, LowerError> {
        let policy_spec = self.policy_spec(generation);
        let provenance = self.provenance.of(generation);
        lower(
            &self.state.population,
            root,
            &policy_spec,
            provenance,
            memory,
            mode,
        )
    }

    /// The winner of the last race, else the best root in training, ties to the older, with its record.
    #[must_use]
    pub fn champion(&self) -> Option<(TeamId, &Record)> {
        self.state.champion()
    }

    /// The champion's blob, the very bytes that were scored.
    ///
    /// # Errors
    /// [`SessionError::NothingScored`] before the first generation or if nothing could be scored.
    pub fn export_champion(&self) -> Result<Vec<u8>, SessionError> {
        match (&self.exported, self.champion()) {
            (Some(exported), Some((root, _))) if exported.root == root => Ok(exported.blob.clone()),
            _ => self.lower_champion(Mode::Compact),
        }
    }

    /// The champion's blob in either mode of lowering; both decide alike.
    ///
    /// # Errors
    /// As [`Session::export_champion`], and [`SessionError::Export`] if the whole graph exceeds the format.
    pub fn lower_champion(&self, mode: Mode) -> Result<Vec<u8>, SessionError> {
        match self.champion() {
            Some((root, record)) if record.score.is_finite() => {
                Ok(self.export(root, record.generation, record.memory.as_deref(), mode)?)
            }
            _ => Err(SessionError::NothingScored {
                generation: self.state.generation,
            }),
        }
    }

    fn report(&mut self, stats: &EvalStats) -> Result<GenerationReport, SessionError> {
        let root = self.champion().map(|(root, _)| root);
        if let Some(root) = root.filter(|r| self.exported.as_ref().is_none_or(|e| e.root != *r)) {
            let blob = self.lower_champion(Mode::Compact)?;
            let sizes = Policy::load(&blob).map_or((0, 0, 0), |policy| {
                let header = policy.header();
                (header.teams, header.programs, policy.bounds().instructions)
            });
            self.exported = Some(Exported { root, blob, sizes });
        }
        let (Some((champion, record)), Some(exported)) = (self.champion(), &self.exported) else {
            return Err(SessionError::NothingScored {
                generation: self.state.generation,
            });
        };
        let scores: Vec<f64> = self
            .state
            .records
            .values()
            .map(|r| r.score)
            .filter(|s| s.is_finite())
            .collect();
        let (champion_teams, champion_programs, champion_instructions) = exported.sizes;
        Ok(GenerationReport {
            generation: self.state.generation,
            steps: self.state.steps,
            best: record.score,
            fitness: record.fitness,
            select: self.state.race.mean(champion),
            mean: tpg_tasks::stats::mean(&scores),
            champion: champion.0,
            champion_teams,
            champion_programs,
            champion_instructions,
            instructions_mean: record.instructions_mean,
            teams: self.state.population.team_count(),
            programs: self.state.population.program_count(),
            unscorable: stats.unscorable,
            unstable: stats.unstable,
            episodes: stats.episodes,
            seconds: self.state.seconds,
        })
    }
}

/// Runs generations until the budget is used up or the evaluator's monitor stops it; `observe` sees every generation.
///
/// A limit of minutes, like the monitor, ends a generation in its middle, which then counts for nothing.
///
/// # Errors
/// The session's, or the observer's.
pub fn train<E: From<SessionError>>(
    session: &mut Session,
    evaluator: &mut dyn Evaluator,
    budget: Budget,
    mut observe: impl FnMut(&Session, &GenerationReport) -> Result<(), E>,
) -> Result<(), E> {
    let monitor = evaluator.monitor().clone();
    let left = budget.time_left(session);
    let (ended, over) = mpsc::channel::<()>();
    std::thread::scope(|scope| {
        if let Some(left) = left {
            let monitor = &monitor;
            scope.spawn(move || {
                if over.recv_timeout(left) == Err(mpsc::RecvTimeoutError::Timeout) {
                    monitor.expire();
                }
            });
        }
        // Dropped at the end, which wakes the thread.
        let _ended = ended;
        while budget.used(session) < 1.0 && !monitor.stopped() {
            match session.advance(evaluator) {
                Ok(report) => observe(session, &report)?,
                Err(SessionError::Stopped) => break,
                Err(error) => return Err(error.into()),
            }
        }
        Ok(())
    })
}
