//! A disturbed link between a plant and any controller, in this process or in another.
//!
//! `tpg eval` and `tpg hil` put the same wrapper around their controllers, so that the same seed gives the same bits.

use tpg_runtime::rng::mix64;
use tpg_runtime::{Action, Reset};

use super::disturbance::{Direction, DisturbError, Disturbance, Effect};
use super::{Controller, Reply};
use crate::task::{ActionSpace, MISSING, Rng, round, words_of};

/// A controller behind a link with disturbances, each applied to what the one before it delivered.
///
/// Observations are disturbed after masks. Each disturbance draws from the stream of `mix64(wrapper seed, position)`,
/// where positions count from 0 over both directions in the order given; adding one at the end leaves the others'
/// numbers alone. An action that noise or quantisation moves out of the policy's range is moved to its bound.
#[derive(Debug, Clone)]
pub struct Disturbed<C> {
    inner: C,
    actions: ActionSpace,
    observation_stages: Vec<Stage>,
    action_stages: Vec<Stage>,
    observation: Vec<f32>,
    action: Vec<f32>,
}

impl<C> Disturbed<C> {
    /// Puts a controller behind disturbances; an empty list changes nothing.
    ///
    /// # Errors
    /// [`DisturbError::Discrete`] for noise or quantisation of the index of an action.
    pub fn new(
        inner: C,
        disturbances: &[Disturbance],
        observation_len: usize,
        actions: ActionSpace,
    ) -> Result<Self, DisturbError> {
        // The index of a discrete action fits a float exactly.
        let (action_len, idle) = match actions {
            ActionSpace::Discrete(_) => (1, 0.0),
            ActionSpace::Continuous { len, low, high } => (len.into(), 0.0f32.clamp(low, high)),
        };
        let (mut observation_stages, mut action_stages) = (Vec::new(), Vec::new());
        for (position, disturbance) in disturbances.iter().enumerate() {
            let effect = disturbance.effect;
            match disturbance.direction {
                Direction::Observation => {
                    let lost = Lost::Missing;
                    observation_stages.push(Stage::new(effect, position, observation_len, lost));
                }
                Direction::Action => {
                    let whole = matches!(effect, Effect::Delay(_) | Effect::Loss { .. });
                    if matches!(actions, ActionSpace::Discrete(_)) && !whole {
                        return Err(DisturbError::Discrete(disturbance.to_string()));
                    }
                    let lost = Lost::Last { idle };
                    action_stages.push(Stage::new(effect, position, action_len, lost));
                }
            }
        }
        Ok(Disturbed {
            inner,
            actions,
            observation_stages,
            action_stages,
            observation: vec![0.0; observation_len],
            action: vec![0.0; action_len],
        })
    }

    /// The controller without its disturbances.
    #[must_use]
    pub fn into_inner(self) -> C {
        self.inner
    }
}

impl<C: Controller> Controller for Disturbed<C> {
    type Error = C::Error;

    fn seed_wrappers(&mut self, wrapper_seed: u64) {
        for stage in self
            .observation_stages
            .iter_mut()
            .chain(&mut self.action_stages)
        {
            stage.reset(wrapper_seed);
        }
        self.inner.seed_wrappers(wrapper_seed);
    }

    fn reset(&mut self, what: Reset, agent_seed: u64) -> Result<(), C::Error> {
        self.inner.reset(what, agent_seed)
    }

    /// Allocates nothing beyond what the controller does.
    fn decide(&mut self, observation: &[f32]) -> Result<Reply<'_>, C::Error> {
        let reply = if self.observation_stages.is_empty() {
            self.inner.decide(observation)?
        } else {
            copy(observation, &mut self.observation);
            for stage in &mut self.observation_stages {
                stage.apply(&mut self.observation);
            }
            self.inner.decide(&self.observation)?
        };
        if self.action_stages.is_empty() {
            return Ok(reply);
        }
        match reply.action {
            Action::Discrete(index) => self.action.fill(f32::from(index)),
            Action::Continuous(values) => copy(values, &mut self.action),
        }
        for stage in &mut self.action_stages {
            stage.apply(&mut self.action);
        }
        let action = match self.actions {
            ActionSpace::Discrete(_) => {
                Action::Discrete(self.action.first().map_or(0, |v| *v as u16))
            }
            ActionSpace::Continuous { low, high, .. } => {
                for value in &mut self.action {
                    *value = value.clamp(low, high);
                }
                Action::Continuous(&self.action)
            }
        };
        Ok(Reply { action, ..reply })
    }
}

fn copy(from: &[f32], to: &mut [f32]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = *from;
    }
}

/// The number as a value of a frame. What is missing stays missing.
fn rounded(x: f64) -> f32 {
    if x.is_nan() { MISSING } else { round(x) }
}

/// What stands for a frame that did not arrive.
#[derive(Debug, Clone, Copy)]
enum Lost {
    Missing,
    /// The last one that did, at first an idle one.
    Last {
        idle: f32,
    },
}

/// The state of one disturbance during an episode.
#[derive(Debug, Clone)]
struct Stage {
    effect: Effect,
    position: u64,
    lost: Lost,
    rng: Rng,
    /// The frame that stands for a lost one.
    last: Vec<f32>,
    /// Frames under way, as a ring.
    under_way: Vec<f32>,
    /// Steps since the episode began.
    steps: usize,
    /// For a loss, the words that stand for it: those below.
    threshold: u128,
}

impl Stage {
    fn new(effect: Effect, position: usize, len: usize, lost: Lost) -> Self {
        let (delay, threshold) = match effect {
            Effect::Delay(steps) => (steps as usize, 0),
            Effect::Loss {
                numerator,
                denominator,
            } => (0, words_of(numerator, denominator)),
            Effect::Noise(_) | Effect::Quantise(_) => (0, 0),
        };
        let mut stage = Stage {
            effect,
            position: position as u64,
            lost,
            rng: Rng::new(0),
            last: vec![0.0; len],
            under_way: vec![0.0; len * delay],
            steps: 0,
            threshold,
        };
        stage.reset(0);
        stage
    }

    fn reset(&mut self, wrapper_seed: u64) {
        self.rng = Rng::new(mix64(&[wrapper_seed, self.position]));
        self.steps = 0;
        self.last.fill(match self.lost {
            Lost::Missing => MISSING,
            Lost::Last { idle } => idle,
        });
    }

    fn apply(&mut self, frame: &mut [f32]) {
        match self.effect {
            Effect::Delay(delay) => self.delay(delay as usize, frame),
            Effect::Loss { .. } => {
                // The word is drawn whether or not a frame is lost.
                if u128::from(self.rng.word()) < self.threshold {
                    copy(&self.last, frame);
                } else if matches!(self.lost, Lost::Last { .. }) {
                    copy(frame, &mut self.last);
                }
            }
            Effect::Noise(sd) => {
                for value in frame {
                    // The number is drawn for a missing element too, which stays missing.
                    *value = rounded(f64::from(*value) + sd * self.rng.normal());
                }
            }
            Effect::Quantise(step) => {
                for value in frame {
                    *value = rounded((f64::from(*value) / step).round() * step);
                }
            }
        }
        self.steps += 1;
    }

    fn delay(&mut self, delay: usize, frame: &mut [f32]) {
        let start = self.steps % delay * frame.len();
        let place = self.under_way.get_mut(start..start + frame.len());
        let Some(place) = place else { return };
        place.swap_with_slice(frame);
        if self.steps < delay {
            copy(&self.last, frame);
        }
    }
}

#[cfg(test)]
#[path = "disturb_tests.rs"]
mod tests;
