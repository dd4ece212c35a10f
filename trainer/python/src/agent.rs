//! One agent on the heap, as large as its policy needs.

use std::sync::Arc;

use self_cell::{MutBorrow, self_cell};
use tpg_runtime::rng::Pcg32;
use tpg_runtime::{
    AnyWidth, Capacities, Decision, ObservationError, Policy, Reset, SliceAgent, Slices,
};

self_cell!(
    /// A sound policy with its bytes. Agents share it, since checking it takes longer than many decisions.
    pub(crate) struct Loaded {
        owner: Arc<[u8]>,

        #[covariant]
        dependent: Policy,
    }
);

impl Loaded {
    /// Checks the bytes of a policy.
    ///
    /// # Errors
    /// Why they are no sound policy, in words.
    pub(crate) fn check(blob: Arc<[u8]>) -> Result<Arc<Self>, String> {
        let loaded = Loaded::try_new(blob, |blob| Policy::load(blob));
        Ok(Arc::new(loaded.map_err(|error| error.to_string())?))
    }

    /// The policy.
    pub(crate) fn policy(&self) -> &Policy<'_> {
        self.borrow_dependent()
    }

    /// Its bytes.
    pub(crate) fn blob(&self) -> &Arc<[u8]> {
        self.borrow_owner()
    }
}

/// A policy and the memory of an agent that executes it.
struct Owner {
    loaded: Arc<Loaded>,
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

/// An agent of a policy that others may share.
pub(crate) struct Agent(Cell);

impl Agent {
    /// Makes an agent, reset with seed 0.
    ///
    /// # Errors
    /// None that can happen, since the agent is as large as the policy needs.
    pub(crate) fn new(loaded: Arc<Loaded>) -> Result<Self, String> {
        let needed = Capacities::needed_by(loaded.policy().header());
        let state = State {
            words: vec![0.0; needed.words],
            bids: vec![0.0; needed.programs],
            visited: vec![false; needed.teams],
            streams: vec![Pcg32::new(0, 0); needed.streams],
        };
        let owner = Owner {
            loaded,
            state: MutBorrow::new(state),
        };
        let cell = Cell::try_new(owner, |owner| {
            let state = owner.state.borrow_mut();
            let slices = Slices {
                words: &mut state.words,
                bids: &mut state.bids,
                visited: &mut state.visited,
                streams: &mut state.streams,
            };
            let policy = *owner.loaded.policy();
            SliceAgent::new_in(policy, slices).map_err(|error| error.to_string())
        })?;
        Ok(Agent(cell))
    }

    /// The policy with its bytes.
    pub(crate) fn loaded(&self) -> &Arc<Loaded> {
        &self.0.borrow_owner().loaded
    }

    /// The policy.
    pub(crate) fn policy(&self) -> &Policy<'_> {
        self.loaded().policy()
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
    /// None that can happen, as for [`Agent::new`].
    pub(crate) fn copy(&self) -> Result<Self, String> {
        let mut copy = Agent::new(self.loaded().clone())?;
        self.0.with_dependent(|_, agent| {
            copy.0
                .with_dependent_mut(|_, copy| copy.copy_state(agent))
                .map_err(|error| error.to_string())
        })?;
        Ok(copy)
    }
}
