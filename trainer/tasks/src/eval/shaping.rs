//! Reward shaping: a training fitness that differs from the task's reward.

use serde::{Deserialize, Serialize};

use crate::task::Step;

/// Weights of reward terms in the training fitness; 1 leaves a term as it is. Reported returns are never shaped.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Shaping {
    /// Weight of the reward for not having failed.
    pub alive: f64,
    /// Weight of the cost of control.
    pub control: f64,
}

impl Default for Shaping {
    fn default() -> Self {
        Shaping {
            alive: 1.0,
            control: 1.0,
        }
    }
}

impl Shaping {
    /// Whether nothing is shaped; configurations then leave the section out.
    #[must_use]
    pub fn is_default(&self) -> bool {
        *self == Shaping::default()
    }

    /// The shaped reward of a step: the reward itself, bit for bit, where nothing is shaped.
    #[must_use]
    pub fn apply(&self, step: &Step) -> f64 {
        if self.is_default() {
            return step.reward;
        }
        let (alive, control) = (step.terms.alive, step.terms.control);
        step.reward + (self.alive - 1.0) * alive - (self.control - 1.0) * control
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::Terms;

    #[test]
    fn terms_are_left_out_or_weighted() {
        let step = Step {
            reward: 2.75,
            terms: Terms {
                alive: 1.0,
                control: 0.25,
            },
            terminated: false,
            unstable: false,
        };
        let shaped = |alive, control| Shaping { alive, control }.apply(&step);
        for ((alive, control), reward) in [
            ((1.0, 1.0), 2.75),
            ((0.0, 1.0), 1.75),
            ((0.0, 0.0), 2.0),
            ((1.0, 3.0), 2.25),
        ] {
            assert!((shaped(alive, control) - reward).abs() < 1e-12);
        }
    }
}
