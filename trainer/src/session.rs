//! A training run: the only place that wires tasks, scoring and evolution.

mod checkpoint;
mod curriculum;
mod front_end;
mod provenance;
mod race;
mod report;
mod scoring;
#[cfg(test)]
mod tests;
mod tuning;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use tpg_runtime::Policy;
use tpg_runtime::rng::mix64;

use crate::config::{Config, ConfigError, Settings};
use crate::evolve::{Child, Population, TeamId, Variation, rank, select};
use crate::front_end::Learner;
use crate::lower::{LowerError, Mode, lower};
use crate::pool::Pool;
use tpg_tasks::task::Rng;

use provenance::Provenance;
use race::Race;
use scoring::{Candidate, EvalStats};
use tuning::Lineage;

pub use checkpoint::{CheckpointError, Snapshot, load};
pub use report::{GenerationReport, LOG_COLUMNS};

/// Marks the random stream of evolution among those that derive from a run's seed.
const EVOLUTION_STREAM: u64 = 4;

/// When a run is over; each is a total over the run's whole life, resumes included.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Budget {
    /// After this many generations.
    Generations(u64),
    /// At the first end of a generation at or past this many environment steps.
    Steps(u64),
    /// At the first end of a generation at or past this many minutes of training.
    Minutes(f64),
}

impl Budget {
    /// Share of the budget that is used, 1 when it is used up.
    #[must_use]
    pub fn used(&self, session: &Session) -> f64 {
        let share = match *self {
            Budget::Generations(n) => session.generation as f64 / n as f64,
            Budget::Steps(n) => session.steps as f64 / n as f64,
            Budget::Minutes(m) => session.seconds / (60.0 * m),
        };
        // A budget of zero is used up from the start.
        if share.is_nan() { 1.0 } else { share }
    }
}

/// What is known of a scored root.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// The generation in which it was scored.
    pub generation: u64,
    /// Mean return of its training episodes; −∞ if it could not be scored.
    pub score: f64,
    /// The same of the shaped rewards: what ranks it.
    pub fitness: f64,
    /// How often it was scored; both means are over all times.
    pub scorings: u32,
    /// Instructions executed per decision in those episodes.
    pub instructions_mean: f64,
    /// Shared memory as it stood when the scoring began, where memory outlives agents.
    pub memory: Option<Arc<[f32]>>,
    /// Steps of its mean training episode, by which the length of its children's is guessed; 0 after a resume.
    #[serde(skip)]
    pub steps_mean: f64,
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
    generation: u64,
    steps: u64,
    seconds: f64,
    population: Population,
    records: BTreeMap<TeamId, Record>,
    /// The population's memory, for scopes in which it outlives agents; `None` until something is in it.
    memory: Option<Arc<[f32]>>,
    /// Median scores of the teams that the last generation made, and the one before.
    medians: [Option<f64>; 2],
    exported: Option<Exported>,
    overhead: Overhead,
    lineages: Vec<Lineage>,
    race: Race,
    /// Stage of the curriculum in which scores were found.
    stage: u32,
    /// Learns what policies perceive; `None` if they see observations as they are.
    learner: Option<Learner>,
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
}

impl Session {
    /// Begins a run; the first generation is made and scored by the first [`Session::advance`].
    ///
    /// # Errors
    /// [`SessionError::Config`].
    pub fn new(config: Config, seed: u64) -> Result<Self, SessionError> {
        let settings = Settings::new(&config)?;
        Ok(Session {
            learner: front_end::learner(&settings),
            provenance: Provenance::new(&config, &settings.task_identity, seed),
            config,
            settings,
            seed,
            generation: 0,
            steps: 0,
            seconds: 0.0,
            population: Population::default(),
            records: BTreeMap::new(),
            memory: None,
            medians: [None; 2],
            exported: None,
            overhead: Overhead::default(),
            lineages: Vec::new(),
            race: Race::default(),
            stage: 0,
        })
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
        Ok(Session {
            population,
            ..Session::new(config, seed)?
        })
    }

    /// The configuration of the run.
    #[must_use]
    pub const fn config(&self) -> &Config {
        &self.config
    }

    /// The run's seed.
    #[must_use]
    pub const fn seed(&self) -> u64 {
        self.seed
    }

    /// Generations completed.
    #[must_use]
    pub const fn generation(&self) -> u64 {
        self.generation
    }

    /// Environment steps of all training episodes so far.
    #[must_use]
    pub const fn steps(&self) -> u64 {
        self.steps
    }

    /// Seconds spent in training, over all resumes.
    #[must_use]
    pub const fn seconds(&self) -> f64 {
        self.seconds
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
    /// [`SessionError`] where no individual could be scored.
    pub fn advance(&mut self, pool: &mut Pool) -> Result<GenerationReport, SessionError> {
        let started = Instant::now();
        let mut candidates = self.make_generation();
        self.overhead.variation += started.elapsed();
        let mut stats = EvalStats::default();
        let made = candidates.len();
        candidates.extend(self.advance_curriculum());
        candidates.extend(self.elites());
        candidates.extend(self.tune(pool, &mut stats));
        self.score(pool, &candidates, &mut stats);
        self.learn(pool);
        self.race(pool, &mut stats);
        let scored = Instant::now();
        let fresh: Vec<f64> = candidates[..made]
            .iter()
            .map(|n| self.records[&n.root].score)
            .collect();
        self.medians = [Some(tpg_tasks::stats::median(&fresh)), self.medians[0]];
        let mut scores = self.scores();
        let keep = self.settings.params.population as usize;
        let protected: Vec<TeamId> = self.tuned().chain(self.race.champion).collect();
        select(&mut self.population, &mut scores, keep, &protected);
        let survives = |id: &TeamId| scores.binary_search_by_key(id, |(kept, _)| *kept).is_ok();
        self.records.retain(|id, _| survives(id));
        self.race.returns.retain(|id, _| survives(id));
        self.forget();
        self.overhead.selection += scored.elapsed();
        self.generation += 1;
        self.steps += stats.steps;
        self.seconds += started.elapsed().as_secs_f64();
        let selected = Instant::now();
        let report = self.report(&stats);
        self.overhead.report += selected.elapsed();
        report
    }

    /// Every scored root with its score, oldest first.
    fn scores(&self) -> Vec<(TeamId, f64)> {
        let fitness = |(id, r): (&TeamId, &Record)| (*id, r.fitness);
        self.records.iter().map(fitness).collect()
    }

    /// Every scored root with its fitness, the best first.
    fn ranking(&self) -> Vec<(TeamId, f64)> {
        let mut ranking = self.scores();
        ranking.retain(|(_, fitness)| fitness.is_finite());
        ranking.sort_by(|a, b| rank(*a, *b));
        ranking
    }

    /// The best roots so far, which are scored again.
    fn elites(&self) -> Vec<Candidate> {
        let elites = self.settings.elites as usize;
        if elites == 0 {
            return Vec::new();
        }
        let best = self.ranking().into_iter().take(elites);
        best.map(|(root, _)| self.candidate(root, root)).collect()
    }

    /// A root that is to be scored; its episodes may be expected to last as those of its `kin`.
    fn candidate(&self, root: TeamId, kin: TeamId) -> Candidate {
        Candidate {
            root,
            expected: self.records.get(&kin).map_or(0.0, |r| r.steps_mean),
        }
    }

    /// The new roots of this generation: random ones at first, children later.
    fn make_generation(&mut self) -> Vec<Candidate> {
        let mut rng = Rng::new(mix64(&[self.seed, self.generation, EVOLUTION_STREAM]));
        let (genes, params) = (&self.settings.genes, &self.settings.params);
        if self.generation == 0 {
            if self.population.roots.is_empty() {
                self.population = Population::random(genes, params, &mut rng);
            }
            let roots = self.population.roots.iter();
            return roots.map(|root| self.candidate(*root, *root)).collect();
        }
        let variation = Variation {
            genes,
            params,
            scores: &self.scores(),
        };
        let children = variation.children(&mut self.population, &mut rng);
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
            &self.population,
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
        if let Some(root) = self.race.champion
            && let Some(record) = self.records.get(&root)
        {
            return Some((root, record));
        }
        let records = self.records.iter().map(|(id, r)| (*id, r));
        records.min_by(|a, b| rank((a.0, a.1.fitness), (b.0, b.1.fitness)))
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
                generation: self.generation,
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
                generation: self.generation,
            });
        };
        let scores: Vec<f64> = self
            .records
            .values()
            .map(|r| r.score)
            .filter(|s| s.is_finite())
            .collect();
        let (champion_teams, champion_programs, champion_instructions) = exported.sizes;
        Ok(GenerationReport {
            generation: self.generation,
            steps: self.steps,
            best: record.score,
            fitness: record.fitness,
            select: self.race.mean(champion),
            mean: tpg_tasks::stats::mean(&scores),
            champion: champion.0,
            champion_teams,
            champion_programs,
            champion_instructions,
            instructions_mean: record.instructions_mean,
            teams: self.population.team_count(),
            programs: self.population.program_count(),
            unscorable: stats.unscorable,
            unstable: stats.unstable,
            seconds: self.seconds,
        })
    }
}

/// Runs generations until the budget is used up or `stop` is set; `observe` sees every generation.
///
/// # Errors
/// The session's, or the observer's.
pub fn train<E: From<SessionError>>(
    session: &mut Session,
    pool: &mut Pool,
    budget: Budget,
    stop: &AtomicBool,
    mut observe: impl FnMut(&Session, &GenerationReport) -> Result<(), E>,
) -> Result<(), E> {
    while budget.used(session) < 1.0 && !stop.load(Ordering::Relaxed) {
        let report = session.advance(pool)?;
        observe(session, &report)?;
    }
    Ok(())
}
