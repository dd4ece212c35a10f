//! Records what policies see in episodes, for learning.

use serde::{Deserialize, Serialize};
use tpg_runtime::{Action, Reset, math};

use super::Moments;
use tpg_tasks::eval::{Controller, Reply};
use tpg_tasks::task::ActionSpace;

/// The visible observations of one episode: their moments, and the pairs of consecutive ones.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Recording {
    /// Of all visible observations.
    pub moments: Moments,
    /// For each pair, one after another: an observation, the action that followed, the next observation. Both are visible.
    pub pairs: Box<[f32]>,
}

/// Records episodes. Its buffers are as long as an episode can need, so that no step allocates.
#[derive(Debug, Clone)]
pub struct Recorder {
    actions: ActionSpace,
    moments: Moments,
    /// The last observation with the action that followed, if it was visible.
    last: Vec<f32>,
    pairs: Vec<f32>,
}

/// Number of variables by which a model knows an action: 1 for discrete actions, else one for each output.
#[must_use]
pub fn action_variables(actions: ActionSpace) -> usize {
    match actions {
        ActionSpace::Discrete(_) => 1,
        ActionSpace::Continuous { len, .. } => usize::from(len),
    }
}

impl Recorder {
    /// A recorder for episodes of at most this many steps.
    #[must_use]
    pub fn new(inputs: usize, actions: ActionSpace, max_steps: u32) -> Self {
        let half = inputs + action_variables(actions);
        Recorder {
            actions,
            moments: Moments::new(inputs),
            last: Vec::with_capacity(half),
            pairs: Vec::with_capacity((half + inputs) * max_steps as usize),
        }
    }

    /// Begins an episode.
    pub fn begin(&mut self) {
        self.moments.clear();
        self.last.clear();
        self.pairs.clear();
    }

    /// Records an observation and the action that the policy chose. Observations of which a part is missing are left out.
    pub fn see(&mut self, seen: &[f32], action: Action<'_>) {
        if !seen.iter().all(|x| x.is_finite()) {
            self.last.clear();
            return;
        }
        self.moments.add(seen);
        let needed = self.last.len() + seen.len();
        if !self.last.is_empty() && self.pairs.capacity() - self.pairs.len() >= needed {
            self.pairs.extend_from_slice(&self.last);
            self.pairs.extend_from_slice(seen);
        }
        self.last.clear();
        self.last.extend_from_slice(seen);
        match (action, self.actions) {
            (Action::Continuous(values), _) => self.last.extend_from_slice(values),
            (Action::Discrete(k), ActionSpace::Discrete(count)) => {
                self.last.push(math::centred(k, count));
            }
            // A policy's action is of its task's kind.
            (Action::Discrete(_), ActionSpace::Continuous { .. }) => self.last.clear(),
        }
    }

    /// The recording of the episode so far.
    #[must_use]
    pub fn finish(&self) -> Recording {
        Recording {
            moments: self.moments.clone(),
            pairs: self.pairs.as_slice().into(),
        }
    }
}

/// A controller whose episodes are recorded.
#[derive(Debug)]
pub struct Recorded<'r, C> {
    /// The controller.
    pub inner: C,
    /// Its recorder.
    pub recorder: &'r mut Recorder,
}

impl<C: Controller> Controller for Recorded<'_, C> {
    type Error = C::Error;

    fn seed_wrappers(&mut self, wrapper_seed: u64) {
        self.inner.seed_wrappers(wrapper_seed);
    }

    fn reset(&mut self, what: Reset, agent_seed: u64) -> Result<(), C::Error> {
        self.recorder.begin();
        self.inner.reset(what, agent_seed)
    }

    fn decide(&mut self, observation: &[f32]) -> Result<Reply<'_>, C::Error> {
        let reply = self.inner.decide(observation)?;
        self.recorder.see(observation, reply.action);
        Ok(reply)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_are_consecutive_and_visible() {
        let actions = ActionSpace::Discrete(3);
        let mut recorder = Recorder::new(2, actions, 10);
        for _ in 0..2 {
            recorder.begin();
            for (seen, action) in [
                ([1.0, 2.0], 0),
                ([3.0, 4.0], 2),
                ([f32::NAN, 7.0], 1),
                ([5.0, 6.0], 1),
                ([0.0, 7.0], 1),
            ] {
                recorder.see(&seen, Action::Discrete(action));
            }
        }
        let recording = recorder.finish();
        let pairs = [[1.0, 2.0, -1.0, 3.0, 4.0], [5.0, 6.0, 0.0, 0.0, 7.0]];
        assert_eq!(*recording.pairs, *pairs.as_flattened());
        let mut visible = Moments::new(2);
        for seen in [[1.0, 2.0], [3.0, 4.0], [5.0, 6.0], [0.0, 7.0]] {
            visible.add(&seen);
        }
        assert_eq!(recording.moments, visible);
    }
}
