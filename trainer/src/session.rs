//! A training run: the only place that wires tasks, scoring and evolution.

mod checkpoint;
mod provenance;
mod report;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use serde::{Deserialize, Serialize};
use tpg_runtime::Policy;
use tpg_runtime::blob::ResetScope;
use tpg_runtime::rng::mix64;

use crate::config::{Blueprint, Config, ConfigError};
use crate::eval::{Domain, Episode, Pool, Split, episode_seed};
use crate::evolve::{Population, TeamId, Variation, rank, select};
use crate::lower::{LowerError, Mode, lower};
use crate::task::Rng;

pub use checkpoint::{CheckpointError, load, save};
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
    /// Instructions executed per decision in those episodes.
    pub instructions_mean: f64,
    /// Shared memory as it stood when the scoring began, where memory outlives agents.
    pub memory: Option<Arc<[f32]>>,
}

/// A training run between two generations.
pub struct Session {
    config: Config,
    blueprint: Blueprint,
    seed: u64,
    generation: u64,
    steps: u64,
    seconds: f64,
    population: Population,
    records: BTreeMap<TeamId, Record>,
    /// The population's memory, for scopes in which it outlives agents; `None` until something is in it.
    memory: Option<Arc<[f32]>>,
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
        let blueprint = Blueprint::new(&config)?;
        Ok(Session {
            config,
            blueprint,
            seed,
            generation: 0,
            steps: 0,
            seconds: 0.0,
            population: Population::default(),
            records: BTreeMap::new(),
            memory: None,
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

    /// Arenas for a number of threads.
    ///
    /// # Errors
    /// [`SessionError::Config`] if the task is not to be had.
    pub fn pool(&self, threads: usize) -> Result<Pool, SessionError> {
        let arenas = (0..threads.max(1)).map(|_| self.blueprint.arena());
        Ok(Pool::new(arenas.collect::<Result<_, _>>()?))
    }

    /// Makes, scores and selects one generation.
    ///
    /// # Errors
    /// [`SessionError`] where no individual could be scored.
    pub fn advance(&mut self, pool: &mut Pool) -> Result<GenerationReport, SessionError> {
        let started = std::time::Instant::now();
        let newcomers = self.make_generation();
        let tally = self.score(pool, &newcomers);
        let mut scores: Vec<(TeamId, f64)> =
            self.records.iter().map(|(id, r)| (*id, r.score)).collect();
        let keep = self.blueprint.params.population as usize;
        select(&mut self.population, &mut scores, keep);
        let kept: BTreeMap<TeamId, f64> = scores.into_iter().collect();
        self.records.retain(|id, _| kept.contains_key(id));
        self.generation += 1;
        self.steps += tally.steps;
        self.seconds += started.elapsed().as_secs_f64();
        self.report(&tally)
    }

    /// The new roots of this generation: random ones at first, children later.
    fn make_generation(&mut self) -> Vec<TeamId> {
        let mut rng = Rng::new(mix64(&[self.seed, self.generation, EVOLUTION_STREAM]));
        let (genes, params) = (&self.blueprint.genes, &self.blueprint.params);
        if self.generation == 0 {
            self.population = Population::random(genes, params, &mut rng);
            return self.population.roots.clone();
        }
        let scores: Vec<(TeamId, f64)> =
            self.records.iter().map(|(id, r)| (*id, r.score)).collect();
        let variation = Variation {
            genes,
            params,
            scores: &scores,
        };
        variation.children(&mut self.population, &mut rng)
    }

    /// Scores new roots on the very bytes that would be exported, and records them.
    fn score(&mut self, pool: &mut Pool, newcomers: &[TeamId]) -> Tally {
        let episodes = u64::from(self.blueprint.episodes);
        let seeds: Vec<u64> = (0..episodes)
            .map(|k| episode_seed(Domain::Train, self.seed, self.generation, k))
            .collect();
        match self.blueprint.contract.reset_scope {
            ResetScope::PerEpisode | ResetScope::EveryDecision => {
                self.score_apart(pool, newcomers, &seeds, Split::Episodes)
            }
            ResetScope::PerAgent => self.score_apart(pool, newcomers, &seeds, Split::Agents),
            ResetScope::PerGeneration => {
                self.memory = None;
                self.score_in_turn(pool, newcomers, &seeds)
            }
            ResetScope::Original => self.score_in_turn(pool, newcomers, &seeds),
        }
    }

    /// Scores roots that share nothing, on all threads.
    fn score_apart(
        &mut self,
        pool: &mut Pool,
        newcomers: &[TeamId],
        seeds: &[u64],
        split: Split,
    ) -> Tally {
        let blobs: Vec<Option<Vec<u8>>> = newcomers
            .iter()
            .map(|root| {
                self.export(*root, self.generation, None, Mode::Compact)
                    .ok()
            })
            .collect();
        let policies: Vec<Option<Policy<'_>>> = blobs
            .iter()
            .map(|blob| Policy::load(blob.as_deref()?).ok())
            .collect();
        let scorable: Vec<Policy<'_>> = policies.iter().flatten().copied().collect();
        let mut results = pool.score(&scorable, seeds, split).into_iter();
        let mut tally = Tally::default();
        for (root, policy) in newcomers.iter().zip(&policies) {
            let result = policy.and_then(|_| results.next()?.ok());
            let record = tally.add(result.as_deref(), self.generation, None);
            self.records.insert(*root, record);
        }
        tally
    }

    /// Scores roots one after another, oldest first: each finds the memory that the one before left.
    ///
    /// The thesis's pool interleaved its processes at random; a fixed order makes runs repeatable.
    fn score_in_turn(&mut self, pool: &mut Pool, newcomers: &[TeamId], seeds: &[u64]) -> Tally {
        let mut tally = Tally::default();
        for root in newcomers {
            let found = self.memory.clone();
            let blob = self
                .export(*root, self.generation, found.as_deref(), Mode::Compact)
                .ok();
            let policy = blob.as_deref().and_then(|blob| Policy::load(blob).ok());
            let result = policy.and_then(|policy| pool.score_alone(policy, seeds).ok());
            let (episodes, memory) = result.unzip();
            if let Some(memory) = memory {
                self.memory = Some(memory.into());
            }
            let record = tally.add(episodes.as_deref(), self.generation, found);
            self.records.insert(*root, record);
        }
        tally
    }

    /// The blob of a root, as it was scored in `generation` with the memory that it found.
    fn export(
        &self,
        root: TeamId,
        generation: u64,
        memory: Option<&[f32]>,
        mode: Mode,
    ) -> Result<Vec<u8>, LowerError> {
        let blueprint = &self.blueprint;
        let identity = &blueprint.task_identity;
        let provenance = provenance::hash(&self.config, identity, self.seed, generation);
        let contract = &blueprint.contract;
        lower(&self.population, root, contract, provenance, memory, mode)
    }

    /// The best root, ties to the older, with its record.
    #[must_use]
    pub fn champion(&self) -> Option<(TeamId, &Record)> {
        let records = self.records.iter().map(|(id, r)| (*id, r));
        records.min_by(|a, b| rank((a.0, a.1.score), (b.0, b.1.score)))
    }

    /// The champion's blob, the very bytes that were scored.
    ///
    /// # Errors
    /// [`SessionError::NothingScored`] before the first generation or if nothing could be scored.
    pub fn export_champion(&self) -> Result<Vec<u8>, SessionError> {
        self.lower_champion(Mode::Compact)
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

    fn report(&self, tally: &Tally) -> Result<GenerationReport, SessionError> {
        let blob = self.export_champion()?;
        let Some((champion, record)) = self.champion() else {
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
        let (champion_teams, champion_programs, champion_instructions) = match Policy::load(&blob) {
            Ok(policy) => (
                policy.header().teams,
                policy.header().programs,
                policy.bounds().instructions,
            ),
            Err(_) => (0, 0, 0),
        };
        Ok(GenerationReport {
            generation: self.generation,
            steps: self.steps,
            best: record.score,
            mean: crate::stats::mean(&scores),
            champion: champion.0,
            champion_teams,
            champion_programs,
            champion_instructions,
            instructions_mean: record.instructions_mean,
            teams: self.population.team_count(),
            programs: self.population.program_count(),
            unscorable: tally.unscorable,
            unstable: tally.unstable,
            seconds: self.seconds,
        })
    }
}

/// What scoring a generation came to.
#[derive(Debug, Default)]
struct Tally {
    steps: u64,
    unscorable: u64,
    unstable: u64,
}

impl Tally {
    /// Counts a team's episodes; none means that it was too large to be scored.
    fn add(
        &mut self,
        episodes: Option<&[Episode]>,
        generation: u64,
        memory: Option<Arc<[f32]>>,
    ) -> Record {
        let episodes = episodes.unwrap_or_default();
        let steps: u64 = episodes.iter().map(|e| u64::from(e.steps)).sum();
        let instructions: u64 = episodes.iter().map(|e| e.instructions).sum();
        let totals: Vec<f64> = episodes.iter().map(|e| e.total).collect();
        let mean = crate::stats::mean(&totals);
        self.steps += steps;
        self.unstable += episodes.iter().filter(|e| e.unstable).count() as u64;
        self.unscorable += u64::from(!mean.is_finite());
        Record {
            generation,
            score: if mean.is_finite() {
                mean
            } else {
                f64::NEG_INFINITY
            },
            instructions_mean: instructions as f64 / steps.max(1) as f64,
            memory,
        }
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
