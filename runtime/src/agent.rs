//! The owner of an agent's state, with capacities fixed at compile time.

use core::marker::PhantomData;

use heapless::Vec;

use crate::decision::{Decision, ObservationError, Reset, Restore, masked};
use crate::exec::Machine;
use crate::math;
use crate::memory::IndexedStream;
use crate::rng::Pcg32;
use crate::sizing::{Capacities, CapacityError};
#[cfg(feature = "trace")]
use crate::trace::Observer;
use crate::verify::{MAX_WORDS, Policy};
use crate::width::{AnyWidth, Watching, Width};

/// An agent with room for any policy that the format's offsets can address, for hosts; some 340 KB, so box it.
///
/// It has a word for every 16-bit offset, so that the compiler drops the checks of the interpreter's accesses.
pub type HostAgent<'p> = Agent<'p, AnyWidth, { MAX_WORDS as usize + 1 }, 2_048, 512, 1_536>;

/// A policy and its state: registers, shared memory, random streams.
///
/// `WORDS`, `PROGRAMS`, `TEAMS` and `STREAMS` are capacities; [`Header`](crate::blob::Header) says what a
/// blob needs. RAM: 4·`WORDS` + 4·`PROGRAMS` + `TEAMS` + 16·`STREAMS` bytes and some 200 more.
///
/// # Examples
/// ```no_run
/// use tpg_runtime::{Agent, AnyWidth, Policy, Reset};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let blob: &[u8] = &[];
/// let policy = Policy::load(blob)?;
/// let mut agent: Agent<'_, AnyWidth, 4096, 64, 16, 8> = Agent::new(policy)?;
/// agent.reset(Reset::Agent, 42);
/// let decision = agent.decide(&[0.0; 11])?;
/// println!("{:?} after {} instructions", decision.action, decision.instructions);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Agent<
    'p,
    W: Width,
    const WORDS: usize,
    const PROGRAMS: usize,
    const TEAMS: usize,
    const STREAMS: usize,
> {
    policy: Policy<'p>,
    words: [f32; WORDS],
    bids: Vec<f32, PROGRAMS>,
    visited: Vec<bool, TEAMS>,
    streams: Vec<Pcg32, STREAMS>,
    indexed: IndexedStream,
    width: PhantomData<W>,
}

impl<
    'p,
    W: Width,
    const WORDS: usize,
    const PROGRAMS: usize,
    const TEAMS: usize,
    const STREAMS: usize,
> Agent<'p, W, WORDS, PROGRAMS, TEAMS, STREAMS>
{
    /// Makes an agent for a policy, reset with seed 0.
    ///
    /// # Errors
    /// [`CapacityError`] if the policy needs more than the type's capacities, or another width.
    pub fn new(policy: Policy<'p>) -> Result<Self, CapacityError> {
        let mut agent = Agent {
            policy,
            words: [0.0; WORDS],
            bids: Vec::new(),
            visited: Vec::new(),
            streams: Vec::new(),
            indexed: IndexedStream::default(),
            width: PhantomData,
        };
        agent.load(policy)?;
        Ok(agent)
    }

    /// Replaces the policy and resets everything, with seed 0; the carried memory image is restored.
    ///
    /// # Errors
    /// [`CapacityError`] as for [`Agent::new`]; the agent then keeps its old policy and state.
    pub fn load(&mut self, policy: Policy<'p>) -> Result<(), CapacityError> {
        let needed = Capacities::needed_by(policy.header());
        let available = Capacities {
            width: W::ONLY.map_or(needed.width, usize::from),
            words: WORDS,
            programs: PROGRAMS,
            teams: TEAMS,
            streams: STREAMS,
        };
        needed.check(&available)?;
        // None of these can fail: the lengths were just compared with the capacities.
        let _ = self.bids.resize(needed.programs, f32::NAN);
        let _ = self.visited.resize(needed.teams, false);
        let _ = self.streams.resize(needed.streams, Pcg32::new(0, 0));
        self.policy = policy;
        self.machine().sliced().start();
        Ok(())
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
        self.machine().sliced().reset(what, agent_seed);
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
        let vectors = W::vectors::<()>(self.policy.header.width);
        self.machine().decide_blind(vectors)
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
    fn decide_observed<O: Watching>(
        &mut self,
        observation: impl ExactSizeIterator<Item = f32> + Clone,
        observer: O,
    ) -> Result<Decision<'_>, ObservationError> {
        let vectors = W::vectors::<O>(self.policy.header.width);
        self.machine().decide(vectors, observation, observer)
    }

    #[inline(always)]
    fn machine(&mut self) -> Machine<'_, 'p, [f32; WORDS]> {
        Machine {
            policy: &self.policy,
            words: &mut self.words,
            bids: self.bids.as_mut_slice(),
            visited: self.visited.as_mut_slice(),
            streams: self.streams.as_mut_slice(),
            indexed: &mut self.indexed,
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
        self.words.get(..len).unwrap_or_default()
    }

    /// Overwrites the shared memory, for scopes in which it outlives the agent.
    ///
    /// # Errors
    /// [`CapacityError`] if `memory` has another length than [`Agent::memory`]; nothing changes then.
    pub fn set_memory(&mut self, memory: &[f32]) -> Result<(), CapacityError> {
        let (start, end) = (self.policy.memory_start, self.policy.header.words as usize);
        let place = self.words.get_mut(start..end).unwrap_or_default();
        if place.len() != memory.len() {
            return Err(CapacityError {
                resource: "memory words",
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

/// The type of the agent that has exactly the capacities that a policy needs.
///
/// The argument is the policy's bytes, a constant or a static; what [`Capacities::of`] refuses does not compile.
///
/// # Examples
/// ```
/// use tpg_runtime::{Policy, agent_type};
///
/// # static CHAMPION: &[u8] = include_bytes!("../examples/team-memory.tpg");
/// type Champion = agent_type!(CHAMPION);
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut agent = Champion::new(Policy::load(CHAMPION)?)?;
/// # let observation = [0.0; 3];
/// let decision = agent.decide(&observation)?;
/// # Ok(())
/// # }
/// ```
#[macro_export]
macro_rules! agent_type {
    ($bytes:expr) => {
        $crate::Agent<
            'static,
            $crate::Fixed<{ $crate::Capacities::of($bytes).width }>,
            { $crate::Capacities::of($bytes).words },
            { $crate::Capacities::of($bytes).programs },
            { $crate::Capacities::of($bytes).teams },
            { $crate::Capacities::of($bytes).streams },
        >
    };
}
