//! Baseline policies that do not look at the observation.

use std::convert::Infallible;

use tpg_runtime::{Action, Reset};

use super::{Controller, Reply};
use crate::task::{ActionSpace, Rng};

/// Always the same action: no torque, or the first of several actions.
#[derive(Debug, Clone)]
pub struct ConstantController {
    actions: ActionSpace,
    values: Vec<f32>,
}

impl ConstantController {
    /// The action that does least: zero within the range of each output, or index 0.
    #[must_use]
    pub fn zero(actions: ActionSpace) -> Self {
        let values = match actions {
            ActionSpace::Discrete(_) => Vec::new(),
            ActionSpace::Continuous { len, low, high } => vec![0.0f32.clamp(low, high); len.into()],
        };
        ConstantController { actions, values }
    }
}

impl Controller for ConstantController {
    type Error = Infallible;

    fn reset(&mut self, _: Reset, _: u64) -> Result<(), Infallible> {
        Ok(())
    }

    fn decide(&mut self, _: &[f32]) -> Result<Reply<'_>, Infallible> {
        Ok(Reply {
            action: match self.actions {
                ActionSpace::Discrete(_) => Action::Discrete(0),
                ActionSpace::Continuous { .. } => Action::Continuous(&self.values),
            },
            instructions: 0,
        })
    }
}

/// Every action equally likely, drawn from the agent's stream of each episode.
#[derive(Debug, Clone)]
pub struct RandomController {
    actions: ActionSpace,
    values: Vec<f32>,
    rng: Rng,
}

impl RandomController {
    /// Draws from the whole action space.
    #[must_use]
    pub fn new(actions: ActionSpace) -> Self {
        let zero = ConstantController::zero(actions);
        RandomController {
            actions,
            values: zero.values,
            rng: Rng::new(0),
        }
    }
}

impl Controller for RandomController {
    type Error = Infallible;

    fn reset(&mut self, _: Reset, agent_seed: u64) -> Result<(), Infallible> {
        self.rng = Rng::new(agent_seed);
        Ok(())
    }

    fn decide(&mut self, _: &[f32]) -> Result<Reply<'_>, Infallible> {
        let action = match self.actions {
            ActionSpace::Discrete(actions) => {
                Action::Discrete(self.rng.below(u64::from(actions)) as u16)
            }
            ActionSpace::Continuous { low, high, .. } => {
                for value in &mut self.values {
                    *value = self.rng.uniform(low.into(), high.into()) as f32;
                }
                Action::Continuous(&self.values)
            }
        };
        Ok(Reply {
            action,
            instructions: 0,
        })
    }
}
