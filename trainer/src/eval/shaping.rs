//! A fitness for training that differs from the task's reward.

use serde::{Deserialize, Serialize};

use crate::task::Step;

/// Factors of reward terms in the fitness that steers training; 1 leaves a term as it is. What is reported is never
/// shaped.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Shaping {
    /// Of what a step earns for not having failed.
    pub alive: f64,
    /// Of what it pays for control.
    pub control: f64,
    /// Environment steps of training after which the fitness is the score; 0: never.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub until: u64,
}

fn is_zero(steps: &u64) -> bool {
    *steps == 0
}

impl Default for Shaping {
    fn default() -> Self {
        Shaping {
            alive: 1.0,
            control: 1.0,
            until: 0,
        }
    }
}

impl Shaping {
    /// Whether nothing is shaped, which configurations leave out.
    #[must_use]
    pub fn is_default(&self) -> bool {
        *self == Shaping::default()
    }

    /// What holds after so many environment steps of training.
    #[must_use]
    pub fn after(self, steps: u64) -> Shaping {
        if self.until > 0 && steps >= self.until {
            Shaping::default()
        } else {
            self
        }
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
        let shaped = |alive, control| {
            let until = 0;
            let shaping = Shaping {
                alive,
                control,
                until,
            };
            shaping.apply(&step)
        };
        for ((alive, control), reward) in [
            ((1.0, 1.0), 2.75),
            ((0.0, 1.0), 1.75),
            ((0.0, 0.0), 2.0),
            ((1.0, 3.0), 2.25),
        ] {
            assert!((shaped(alive, control) - reward).abs() < 1e-12);
        }
    }

    #[test]
    fn it_ends_after_its_steps_or_never() {
        let shaping = |until| Shaping {
            alive: 0.0,
            control: 1.0,
            until,
        };
        assert_eq!(shaping(0).after(u64::MAX), shaping(0));
        assert_eq!(shaping(100).after(99), shaping(100));
        assert!(shaping(100).after(100).is_default());
    }
}
