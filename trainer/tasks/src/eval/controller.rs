//! Who decides in an episode.

use tpg_runtime::{Action, Agent, ObservationError, Reset, Storage, Width};

/// Turns observations into actions: an agent in this process, or one at the other end of a bridge.
pub trait Controller {
    /// Why it could not.
    type Error;

    /// Begins an episode of the wrappers around a controller, before [`reset`](Self::reset); others have no use for it.
    fn seed_wrappers(&mut self, _wrapper_seed: u64) {}

    /// Begins an agent's evaluation or one of its episodes.
    ///
    /// # Errors
    /// Where the controller cannot be reached.
    fn reset(&mut self, what: Reset, agent_seed: u64) -> Result<(), Self::Error>;

    /// Chooses the action for an observation.
    ///
    /// # Errors
    /// Where the controller cannot be reached, or refuses the observation.
    fn decide(&mut self, observation: &[f32]) -> Result<Reply<'_>, Self::Error>;
}

/// A controller's answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reply<'a> {
    /// What the plant is to do.
    pub action: Action<'a>,
    /// Instructions executed for this decision.
    pub instructions: u32,
}

impl<W: Width, S: Storage> Controller for Agent<'_, W, S> {
    type Error = ObservationError;

    fn reset(&mut self, what: Reset, agent_seed: u64) -> Result<(), ObservationError> {
        Agent::reset(self, what, agent_seed);
        Ok(())
    }

    fn decide(&mut self, observation: &[f32]) -> Result<Reply<'_>, ObservationError> {
        let decision = Agent::decide(self, observation)?;
        Ok(Reply {
            action: decision.action,
            instructions: decision.instructions,
        })
    }
}

impl<C: Controller> Controller for &mut C {
    type Error = C::Error;

    fn seed_wrappers(&mut self, wrapper_seed: u64) {
        (**self).seed_wrappers(wrapper_seed);
    }

    fn reset(&mut self, what: Reset, agent_seed: u64) -> Result<(), C::Error> {
        (**self).reset(what, agent_seed)
    }

    fn decide(&mut self, observation: &[f32]) -> Result<Reply<'_>, C::Error> {
        (**self).decide(observation)
    }
}
