//! An agent on memory that its caller owns, for sizes that are known only when a policy arrives.

use core::marker::PhantomData;

use crate::decision::{Decision, ObservationError, Reset, masked};
use crate::exec::Machine;
use crate::memory::IndexedStream;
use crate::rng::Pcg32;
use crate::sizing::{Capacities, CapacityError};
use crate::verify::Policy;
use crate::width::Width;

/// Memory for the state of an agent; [`Capacities`] says how much of each a policy needs.
#[derive(Debug)]
pub struct Slices<'s> {
    /// Registers, shared memory, observation and outputs.
    pub words: &'s mut [f32],
    /// One for each program.
    pub bids: &'s mut [f32],
    /// One for each team.
    pub visited: &'s mut [bool],
    /// Random streams of team memory.
    pub streams: &'s mut [Pcg32],
}

/// An [`Agent`](crate::Agent) whose state lies in borrowed memory. Its decisions are the same.
///
/// # Examples
/// ```
/// use tpg_runtime::rng::Pcg32;
/// use tpg_runtime::{AnyWidth, Policy, SliceAgent, Slices};
///
/// # static CHAMPION: &[u8] = include_bytes!("../examples/team-memory.tpg");
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let (mut words, mut bids, mut visited) = ([0.0; 512], [0.0; 8], [false; 4]);
/// let mut streams = [(); 8].map(|()| Pcg32::new(0, 0));
/// let slices = Slices { words: &mut words, bids: &mut bids, visited: &mut visited, streams: &mut streams };
/// let mut agent: SliceAgent<'_, '_, AnyWidth> = SliceAgent::new(Policy::load(CHAMPION)?, slices)?;
/// # let observation = [0.0; 3];
/// let decision = agent.decide(&observation)?;
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct SliceAgent<'s, 'p, W: Width> {
    policy: Policy<'p>,
    slices: Slices<'s>,
    indexed: IndexedStream,
    width: PhantomData<W>,
}

impl<'s, 'p, W: Width> SliceAgent<'s, 'p, W> {
    /// Makes an agent for a policy, reset with seed 0. It uses only as much of each slice as the policy needs.
    ///
    /// # Errors
    /// [`CapacityError`] if a slice is too short, or the policy has another width than `W`.
    pub fn new(policy: Policy<'p>, slices: Slices<'s>) -> Result<Self, CapacityError> {
        let needed = Capacities::needed_by(policy.header());
        let available = Capacities {
            width: W::ONLY.map_or(needed.width, usize::from),
            words: slices.words.len(),
            programs: slices.bids.len(),
            teams: slices.visited.len(),
            streams: slices.streams.len(),
        };
        needed.check(&available)?;
        let slices = Slices {
            words: slices.words.get_mut(..needed.words).unwrap_or_default(),
            bids: slices.bids.get_mut(..needed.programs).unwrap_or_default(),
            visited: slices.visited.get_mut(..needed.teams).unwrap_or_default(),
            streams: slices.streams.get_mut(..needed.streams).unwrap_or_default(),
        };
        let mut agent = SliceAgent {
            policy,
            slices,
            indexed: IndexedStream::default(),
            width: PhantomData,
        };
        agent.machine().start();
        Ok(agent)
    }

    /// The policy that the agent executes.
    #[must_use]
    pub const fn policy(&self) -> &Policy<'p> {
        &self.policy
    }

    /// As [`Agent::reset`](crate::Agent::reset).
    pub fn reset(&mut self, what: Reset, agent_seed: u64) {
        self.machine().reset(what, agent_seed);
    }

    /// As [`Agent::decide`](crate::Agent::decide).
    ///
    /// # Errors
    /// [`ObservationError`] if the observation has another length than the policy's; nothing changes then.
    pub fn decide(&mut self, observation: &[f32]) -> Result<Decision<'_>, ObservationError> {
        self.decide_seen(observation.iter().copied())
    }

    /// As [`Agent::decide_masked`](crate::Agent::decide_masked).
    ///
    /// # Errors
    /// [`ObservationError`] if the observation or `missing` has another length than the policy's observation; nothing
    /// changes then.
    pub fn decide_masked(
        &mut self,
        observation: &[f32],
        missing: &[bool],
    ) -> Result<Decision<'_>, ObservationError> {
        self.decide_seen(masked(observation, missing)?)
    }

    /// As [`Agent::decide_blind`](crate::Agent::decide_blind).
    pub fn decide_blind(&mut self) -> Decision<'_> {
        let vectors = W::vectors::<()>(self.policy.header.width);
        self.machine().decide_blind(vectors)
    }

    #[inline(always)]
    fn decide_seen(
        &mut self,
        observation: impl ExactSizeIterator<Item = f32> + Clone,
    ) -> Result<Decision<'_>, ObservationError> {
        let vectors = W::vectors::<()>(self.policy.header.width);
        self.machine().decide(vectors, observation, ())
    }

    /// As [`Agent::memory`](crate::Agent::memory).
    #[must_use]
    pub fn memory(&self) -> &[f32] {
        let memory = self.slices.words.get(self.policy.memory_start..);
        memory.unwrap_or_default()
    }

    /// Takes over the whole state of another agent of the same policy, random streams included: both decide alike from here on.
    ///
    /// # Errors
    /// [`CapacityError`] if the other one's policy needs a state of another size; nothing changes then.
    pub fn copy_state(&mut self, other: &SliceAgent<'_, '_, W>) -> Result<(), CapacityError> {
        let available = Capacities::needed_by(self.policy.header());
        let needed = Capacities::needed_by(other.policy.header());
        needed.check(&available)?;
        available.check(&needed)?;
        self.slices.words.copy_from_slice(other.slices.words);
        self.slices.bids.copy_from_slice(other.slices.bids);
        self.slices.visited.copy_from_slice(other.slices.visited);
        self.slices.streams.clone_from_slice(other.slices.streams);
        self.indexed = other.indexed;
        Ok(())
    }

    #[inline(always)]
    fn machine(&mut self) -> Machine<'_, 'p, [f32]> {
        Machine {
            policy: &self.policy,
            words: self.slices.words,
            bids: self.slices.bids,
            visited: self.slices.visited,
            streams: self.slices.streams,
            indexed: &mut self.indexed,
        }
    }
}
