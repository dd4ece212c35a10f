//! One agent on the heap, as large as its policy needs.

use std::sync::Arc;

use self_cell::{MutBorrow, self_cell};
use tpg_runtime::rng::Pcg32;
use tpg_runtime::{
    AnyWidth, Capacities, Decision, ObservationError, Policy, Reset, SliceAgent, Slices,
};

/// The file of a policy and the memory of an agent that executes it.
struct Owner {
    blob: Arc<[u8]>,
    state: MutBorrow<State>,
}

struct State {
    words: Vec<f32>,
    bids: Vec<f32>,
    visited: Vec<bool>,
    streams: Vec<Pcg32>,
}

type Running<'a> = SliceAgent<'a, 'a, AnyWidth>;

self_cell!(
    struct Cell {
        owner: Owner,

        #[not_covariant]
        dependent: Running,
    }
);

/// An agent of a policy. The policy's bytes may be shared with others.
pub(crate) struct Agent(Cell);

impl Agent {
    /// Makes an agent, reset with seed 0.
    ///
    /// # Errors
    /// Why the bytes are no sound policy, in words.
    pub(crate) fn new(blob: Arc<[u8]>) -> Result<Self, String> {
        let policy = Policy::load(&blob).map_err(|error| error.to_string())?;
        let needed = Capacities::needed_by(policy.header());
        let state = State {
            words: vec![0.0; needed.words],
            bids: vec![0.0; needed.programs],
            visited: vec![false; needed.teams],
            streams: vec![Pcg32::new(0, 0); needed.streams],
        };
        let owner = Owner {
            blob,
            state: MutBorrow::new(state),
        };
        let cell = Cell::try_new(owner, |owner| {
            let policy = Policy::load(&owner.blob).map_err(|error| error.to_string())?;
            let state = owner.state.borrow_mut();
            let slices = Slices {
                words: &mut state.words,
                bids: &mut state.bids,
                visited: &mut state.visited,
                streams: &mut state.streams,
            };
            SliceAgent::new_in(policy, slices).map_err(|error| error.to_string())
        })?;
        Ok(Agent(cell))
    }

    /// The policy's bytes.
    pub(crate) fn blob(&self) -> &Arc<[u8]> {
        &self.0.borrow_owner().blob
    }

    /// Looks at the policy.
    pub(crate) fn with_policy<T>(&self, look: impl FnOnce(&Policy<'_>) -> T) -> T {
        self.0.with_dependent(|_, agent| look(agent.policy()))
    }

    /// Begins an agent's evaluation or one of its episodes.
    pub(crate) fn reset(&mut self, what: Reset, agent_seed: u64) {
        self.0
            .with_dependent_mut(|_, agent| agent.reset(what, agent_seed));
    }

    /// Decides, and hands the decision on.
    ///
    /// # Errors
    /// The runtime's, where the observation has the wrong length.
    pub(crate) fn decide<T>(
        &mut self,
        observation: &[f32],
        take: impl FnOnce(Decision<'_>) -> T,
    ) -> Result<T, ObservationError> {
        self.0
            .with_dependent_mut(|_, agent| agent.decide(observation).map(take))
    }

    /// The memory that its programs share.
    pub(crate) fn memory(&self) -> Vec<f32> {
        self.0.with_dependent(|_, agent| agent.memory().to_vec())
    }

    /// Another agent in the same state.
    ///
    /// # Errors
    /// None that can happen, since the policy was loaded before.
    pub(crate) fn copy(&self) -> Result<Self, String> {
        let mut copy = Agent::new(self.blob().clone())?;
        self.0.with_dependent(|_, agent| {
            copy.0
                .with_dependent_mut(|_, copy| copy.copy_state(agent))
                .map_err(|error| error.to_string())
        })?;
        Ok(copy)
    }
}
