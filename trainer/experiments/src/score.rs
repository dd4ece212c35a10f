//! Scores a run's champion on fresh episodes, as evolved: every instruction is executed and every access of memory is
//! made, as the thesis counts them. The returns are those of the exported policy, bit for bit.

use std::collections::BTreeMap;

use tpg_runtime::blob::{MemoryModel, RegisterMode};
use tpg_runtime::isa::REGISTERS;
use tpg_runtime::tables::{ProgramId, Section};
use tpg_runtime::trace::{MemoryAddress, Observer};
use tpg_runtime::{
    CapacityError, HostAgent, ObservationError, Policy, Reset, Restore, VerifyError,
};

use super::row::{Ablation, Access, AccessKind, Forgets, MemorySection};
use tpg_tasks::eval::{
    Controller, Domain, Episode, EvaluationError, Forgetful, Reply, episode_seed, evaluate,
};
use tpg_tasks::stats;
use tpg_trainer::config::{ConfigError, Settings};
use tpg_trainer::lower::Mode;
use tpg_trainer::session::{Session, SessionError};

/// What the test of a champion came to.
#[derive(Debug, Clone, PartialEq)]
pub struct Tested {
    /// The episodes, in order.
    pub episodes: Vec<Episode>,
    /// How its programs used memory, in the order of programs, reads first.
    pub accesses: Vec<Access>,
    /// Whether instructions and accesses are those of the champion as evolved; otherwise it is too large for that, and
    /// they are those of the exported policy, which has fewer.
    pub as_evolved: bool,
}

impl Tested {
    /// Decisions of all episodes.
    #[must_use]
    pub fn decisions(&self) -> u64 {
        self.episodes.iter().map(|e| u64::from(e.steps)).sum()
    }

    /// Instructions executed per decision.
    #[must_use]
    pub fn instructions_mean(&self) -> f64 {
        let instructions: u64 = self.episodes.iter().map(|e| e.instructions).sum();
        instructions as f64 / self.decisions().max(1) as f64
    }
}

/// Why a champion could not be tested.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TestError {
    /// There is none, or it cannot be lowered.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The task is not to be had.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// What was lowered does not verify.
    #[error("the champion does not verify")]
    Verify(#[from] VerifyError),
    /// The exported policy is too large for a host's agent.
    #[error(transparent)]
    Capacity(#[from] CapacityError),
    /// The agent refused an observation.
    #[error(transparent)]
    Evaluation(#[from] EvaluationError<ObservationError>),
}

/// Scores a session's champion on the episodes of `tpg eval --seed SEED --episodes EPISODES`.
///
/// # Errors
/// [`TestError`].
pub fn test(session: &Session, seed: u64, episodes: u32) -> Result<Tested, TestError> {
    let counting = session.lower_champion(Mode::Counting);
    match counting.as_deref().map(agent) {
        Ok(Ok(agent)) => run(session, agent, seed, episodes, true),
        // The exported policy is smaller, and it was scored in training.
        _ => {
            let blob = session.export_champion()?;
            run(session, agent(&blob)?, seed, episodes, false)
        }
    }
}

/// What the exported champion scores on the same episodes if it forgets before every decision, for each thing that it could
/// keep. Empty if nothing outlives a decision.
///
/// # Errors
/// [`TestError`].
pub fn forgetting(session: &Session, seed: u64, episodes: u32) -> Result<Vec<Ablation>, TestError> {
    let blob = session.export_champion()?;
    let policy = Policy::load(&blob)?;
    let header = policy.header();
    let registers = header.register_mode == RegisterMode::Stateful;
    let memory = header.memory_model != MemoryModel::None;
    let kinds = [
        (registers, Forgets::Registers, Restore::Registers),
        (memory, Forgets::Memory, Restore::Memory),
        (registers && memory, Forgets::All, Restore::All),
    ];
    let kinds = kinds.into_iter().filter(|(there, ..)| *there);
    let ablation = |(_, forgets, restore)| {
        let mut arena = Settings::new(session.config())?.arena()?;
        let mut forgetful = Forgetful::new(agent(&blob)?, restore);
        let episodes = evaluate(&mut arena, &mut forgetful, seeds(seed, episodes))?;
        let test_returns: Vec<f64> = episodes.iter().map(|e| e.total).collect();
        Ok(Ablation {
            forgets,
            test_mean: stats::mean(&test_returns),
            test_returns,
        })
    };
    kinds.map(ablation).collect()
}

fn seeds(seed: u64, episodes: u32) -> impl Iterator<Item = u64> {
    (0..u64::from(episodes)).map(move |k| episode_seed(Domain::Test, seed, 0, k))
}

fn agent(blob: &[u8]) -> Result<Box<HostAgent<'_>>, TestError> {
    Ok(Box::new(HostAgent::new(Policy::load(blob)?)?))
}

fn run(
    session: &Session,
    agent: Box<HostAgent<'_>>,
    seed: u64,
    episodes: u32,
    as_evolved: bool,
) -> Result<Tested, TestError> {
    let mut arena = Settings::new(session.config())?.arena()?;
    let mut counting = Counting {
        agent,
        counter: Counter::default(),
    };
    let episodes = evaluate(&mut arena, &mut counting, seeds(seed, episodes))?;
    let mut tested = Tested {
        episodes,
        accesses: Vec::new(),
        as_evolved,
    };
    let decisions = tested.decisions();
    let counts = counting.counter.counts.into_iter();
    tested.accesses = counts
        .map(|((program, access, section, slot), count)| Access {
            program,
            access,
            section,
            slot,
            count,
            decisions,
        })
        .collect();
    Ok(tested)
}

/// Counts memory accesses of whichever program runs.
#[derive(Debug, Default)]
struct Counter {
    running: u16,
    counts: BTreeMap<(u16, AccessKind, MemorySection, u16), u64>,
}

impl Counter {
    fn count(&mut self, access: AccessKind, place: MemoryAddress) {
        let (section, slot) = match place {
            MemoryAddress::Slot(Section::Scalar, slot) => (MemorySection::Scalar, slot),
            MemoryAddress::Slot(Section::Vector, slot) => (MemorySection::Vector, slot),
            MemoryAddress::Slot(Section::Matrix, slot) => (MemorySection::Matrix, slot),
            MemoryAddress::Cell(cell) => (MemorySection::Indexed, cell / REGISTERS as u16),
            _ => return,
        };
        let key = (self.running, access, section, slot);
        *self.counts.entry(key).or_default() += 1;
    }
}

impl Observer for Counter {
    fn run(&mut self, ProgramId(program): ProgramId, _instructions: u16) {
        self.running = program;
    }

    fn read(&mut self, place: MemoryAddress) {
        self.count(AccessKind::Read, place);
    }

    fn write(&mut self, place: MemoryAddress) {
        self.count(AccessKind::Write, place);
    }
}

/// An agent whose accesses are counted.
struct Counting<'p> {
    agent: Box<HostAgent<'p>>,
    counter: Counter,
}

impl Controller for Counting<'_> {
    type Error = ObservationError;

    fn reset(&mut self, what: Reset, agent_seed: u64) -> Result<(), ObservationError> {
        self.agent.reset(what, agent_seed);
        Ok(())
    }

    fn decide(&mut self, observation: &[f32]) -> Result<Reply<'_>, ObservationError> {
        let decision = self.agent.decide_traced(observation, &mut self.counter)?;
        Ok(Reply {
            action: decision.action,
            instructions: decision.instructions,
        })
    }
}
