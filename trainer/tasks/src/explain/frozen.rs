//! How a policy does without one of its inputs.

use tpg_runtime::Reset;

use crate::eval::{Controller, Reply};

/// A controller that sees one input at a constant value. Where the input is missing it stays so.
#[derive(Debug)]
pub struct Frozen<C> {
    controller: C,
    input: usize,
    value: f32,
    seen: Vec<f32>,
}

impl<C> Frozen<C> {
    /// Freezes an input, counted from 0.
    #[must_use]
    pub const fn new(controller: C, input: usize, value: f32) -> Self {
        Frozen {
            controller,
            input,
            value,
            seen: Vec::new(),
        }
    }
}

impl<C: Controller> Controller for Frozen<C> {
    type Error = C::Error;

    fn seed_wrappers(&mut self, wrapper_seed: u64) {
        self.controller.seed_wrappers(wrapper_seed);
    }

    fn reset(&mut self, what: Reset, agent_seed: u64) -> Result<(), C::Error> {
        self.controller.reset(what, agent_seed)
    }

    fn decide(&mut self, observation: &[f32]) -> Result<Reply<'_>, C::Error> {
        self.seen.clear();
        self.seen.extend_from_slice(observation);
        if let Some(seen) = self.seen.get_mut(self.input).filter(|x| x.is_finite()) {
            *seen = self.value;
        }
        self.controller.decide(&self.seen)
    }
}
