//! A policy with its state.

use core::marker::PhantomData;

use crate::decision::{Decision, ObservationError, Reset, Restore, masked};
use crate::exec::Machine;
use crate::math;
use crate::memory::IndexedStream;
use crate::parts::Resource;
use crate::sizing::{Capacities, CapacityError};
use crate::storage::{Slices, State, Storage};
use crate::trace::Observer;
use crate::verify::{MAX_WORDS, Policy};
use crate::width::{AnyWidth, Width};

/// The state of a [`HostAgent`]: a word for every 16-bit offset, so that the compiler drops the checks of the interpreter's
/// accesses.
pub type HostState = State<{ MAX_WORDS as usize + 1 }, 2_048, 512, 1_536>;

/// An agent with room for any policy that the format's offsets can address, for hosts; some 340 KB, so box it.
pub type HostAgent<'p> = Agent<'p, AnyWidth, HostState>;

/// An agent whose state lies in slices, for sizes that are known only when a policy arrives.
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
/// let mut agent: SliceAgent<'_, '_, AnyWidth> = SliceAgent::new_in(Policy::load(CHAMPION)?, slices)?;
/// # let observation = [0.0; 3];
/// let decision = agent.decide(&observation)?;
/// # Ok(())
/// # }
/// ```
pub type SliceAgent<'s, 'p, W> = Agent<'p, W, Slices<'s>>;

/// A policy and its state: registers, shared memory, random streams.
///
/// `S` is where the state lies, a [`Storage`]. It is inside the agent if it is a [`State`]. With `&mut State` it stays where
/// it is, such as in a `static`, and the agent has only some 200 bytes. `W` is the [`Width`] that the interpreter is
/// compiled for.
///
/// [`policy!`](crate::policy!) makes both types for a policy that is known when the program is compiled.
///
/// # Examples
/// ```no_run
/// use tpg_runtime::{Agent, AnyWidth, Policy, Reset, State};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let blob: &[u8] = &[];
/// let mut state: State<4096, 64, 16, 8> = State::new();
/// let mut agent: Agent<'_, AnyWidth, _> = Agent::new_in(Policy::load(blob)?, &mut state)?;
/// agent.reset(Reset::Agent, 42);
/// let decision = agent.decide(&[0.0; 11])?;
/// println!("{:?} after {} instructions", decision.action, decision.instructions);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Agent<'p, W: Width, S: Storage> {
    policy: Policy<'p>,
    storage: S,
    indexed: IndexedStream,
    width: PhantomData<W>,
}

impl<'p, W: Width, S: Storage + Default> Agent<'p, W, S> {
    /// Makes an agent that holds its state, reset with seed 0.
    ///
    /// The state is returned by value. For large states on small stacks, use [`Agent::new_in`].
    ///
    /// # Errors
    /// [`CapacityError`] if the policy needs more than the type's capacities, or another width.
    pub fn new(policy: Policy<'p>) -> Result<Self, CapacityError> {
        Self::new_in(policy, S::default())
    }
}

impl<'p, W: Width, S: Storage> Agent<'p, W, S> {
    /// Makes an agent whose state is in `storage`, reset with seed 0.
    ///
    /// # Errors
    /// [`CapacityError`] if the policy needs more than there is room for, or another width.
    pub fn new_in(policy: Policy<'p>, storage: S) -> Result<Self, CapacityError> {
        let mut agent = Agent {
            policy,
            storage,
            indexed: IndexedStream::default(),
            width: PhantomData,
        };
        agent.load(policy)?;
        Ok(agent)
    }

    /// Replaces the policy and resets everything, with seed 0; the carried memory image is restored.
    ///
    /// # Errors
    /// [`CapacityError`] as for [`Agent::new_in`]; the agent then keeps its old policy and state.
    pub fn load(&mut self, policy: Policy<'p>) -> Result<(), CapacityError> {
        let needed = Capacities::needed_by(policy.header());
        let available = Capacities {
            width: W::ONLY.map_or(needed.width, usize::from),
            ..self.storage.room()
        };
        needed.check(&available)?;
        self.storage.fit(&needed);
        self.policy = policy;
        self.machine().sliced().start();
        Ok(())
    }

    /// What the agent has room for, with the width of its policy.
    #[must_use]
    pub fn capacities(&self) -> Capacities {
        Capacities {
            width: usize::from(self.policy.header.width),
            ..self.storage.room()
        }
    }

    /// The policy that the agent executes.
    #[must_use]
    pub const fn policy(&self) -> &Policy<'p> {
        &self.policy
    }

    /// Begins an agent's evaluation or one of its episodes (thesis Algorithm 1).
    ///
    /// `agent_seed` determines the random streams; where nothing is reset it is not used.
    pub fn reset(&mut self, what: Reset, agent_seed: u64) {
        self.machine().sliced().reset(what, agent_seed, true);
    }

    /// Sets registers, shared memory or both to their initial values, as in an ablation. Random streams and the front end
    /// go on as they are.
    pub fn restore(&mut self, what: Restore) {
        self.machine().sliced().restore(what);
    }

    /// Chooses the action for an observation; runs at most [`Policy::bounds`] instructions.
    ///
    /// An element that is not finite, such as NaN, is missing. The policy's front end fills it in; without a front end it
    /// counts as 0, and so it does in policies of format versions 1 and 2.
    ///
    /// # Errors
    /// [`ObservationError`] if the observation has another length than the policy's; nothing changes then.
    pub fn decide(&mut self, observation: &[f32]) -> Result<Decision<'_>, ObservationError> {
        self.decide_observed(observation.iter().copied(), ())
    }

    /// Chooses the action for an observation whose elements are missing where `missing` is true.
    ///
    /// It is [`Agent::decide`] with NaN for those elements.
    ///
    /// # Errors
    /// [`ObservationError`] if the observation or `missing` has another length than the policy's observation; nothing
    /// changes then.
    pub fn decide_masked(
        &mut self,
        observation: &[f32],
        missing: &[bool],
    ) -> Result<Decision<'_>, ObservationError> {
        self.decide_observed(masked(observation, missing)?, ())
    }

    /// Chooses the action for an observation of which all is missing.
    ///
    /// It is [`Agent::decide`] with NaN for every element.
    pub fn decide_blind(&mut self) -> Decision<'_> {
        let elements = usize::from(self.policy.header.observation_len);
        self.decide_exact(core::iter::repeat_n(f32::NAN, elements), ())
    }

    /// Chooses the action for as many elements as the policy observes.
    #[inline(always)]
    pub(crate) fn decide_exact<O: Observer>(
        &mut self,
        observation: impl ExactSizeIterator<Item = f32> + Clone,
        observer: O,
    ) -> Decision<'_> {
        let vectors = W::vectors(self.policy.header.width);
        self.machine().decide_exact(vectors, observation, observer)
    }

    /// As [`Agent::decide`], with the same result, and tells an observer how it came about.
    ///
    /// # Errors
    /// As for [`Agent::decide`].
    #[cfg(feature = "trace")]
    pub fn decide_traced(
        &mut self,
        observation: &[f32],
        observer: &mut dyn Observer,
    ) -> Result<Decision<'_>, ObservationError> {
        self.decide_observed(observation.iter().copied(), observer)
    }

    #[inline(always)]
    fn decide_observed<O: Observer>(
        &mut self,
        observation: impl ExactSizeIterator<Item = f32> + Clone,
        observer: O,
    ) -> Result<Decision<'_>, ObservationError> {
        let vectors = W::vectors(self.policy.header.width);
        self.machine().decide(vectors, observation, observer)
    }

    #[inline(always)]
    fn machine(&mut self) -> Machine<'_, 'p, f32, S::Words> {
        let parts = self.storage.parts(&self.policy.header);
        Machine {
            policy: &self.policy,
            words: parts.words,
            bids: parts.bids,
            visited: parts.visited,
            streams: parts.streams,
            indexed: core::slice::from_mut(&mut self.indexed),
        }
    }

    /// Memory that programs share: the teams' slots, then the kept cells, in state order.
    #[must_use]
    pub fn memory(&self) -> &[f32] {
        self.words()
            .get(self.policy.memory_start..)
            .unwrap_or_default()
    }

    /// The whole state, for comparisons: observation window, outputs, registers, memory.
    #[must_use]
    pub fn words(&self) -> &[f32] {
        let len = self.policy.header.words as usize;
        self.storage.words().get(..len).unwrap_or_default()
    }

    /// Overwrites the shared memory, for scopes in which it outlives the agent.
    ///
    /// # Errors
    /// [`CapacityError`] if `memory` has another length than [`Agent::memory`]; nothing changes then.
    pub fn set_memory(&mut self, memory: &[f32]) -> Result<(), CapacityError> {
        let (start, end) = (self.policy.memory_start, self.policy.header.words as usize);
        let words = self.machine().sliced().words;
        let place = words.get_mut(start..end).unwrap_or_default();
        if place.len() != memory.len() {
            return Err(CapacityError {
                resource: Resource::MemoryWords,
                needed: place.len(),
                available: memory.len(),
            });
        }
        for (word, x) in place.iter_mut().zip(memory) {
            *word = math::finite(*x);
        }
        Ok(())
    }
}

impl<W: Width> SliceAgent<'_, '_, W> {
    /// Takes over the whole state of another agent of the same policy, random streams included: both decide alike from here on.
    ///
    /// # Errors
    /// [`CapacityError`] if the other one's policy needs a state of another size; nothing changes then.
    pub fn copy_state(&mut self, other: &SliceAgent<'_, '_, W>) -> Result<(), CapacityError> {
        let available = Capacities::needed_by(self.policy.header());
        let needed = Capacities::needed_by(other.policy.header());
        needed.check(&available)?;
        available.check(&needed)?;
        copy(self.storage.words, other.storage.words, needed.words);
        copy(self.storage.bids, other.storage.bids, needed.programs);
        copy(self.storage.visited, other.storage.visited, needed.teams);
        copy(self.storage.streams, other.storage.streams, needed.streams);
        self.indexed = other.indexed;
        Ok(())
    }
}

/// Copies the first `len` elements.
fn copy<T: Clone>(to: &mut [T], from: &[T], len: usize) {
    for (to, from) in to.iter_mut().zip(from).take(len) {
        to.clone_from(from);
    }
}
