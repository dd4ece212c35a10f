//! Whether a policy's sensors show what its own model expects.

use serde::Serialize;
use tpg_runtime::health::{Health, THRESHOLD};
use tpg_runtime::{HostAgent, ObservationError, Reset};

use super::{Controller, Reply};

/// An agent whose channels are watched.
#[derive(Debug)]
pub struct Watched<'p> {
    agent: Box<HostAgent<'p>>,
    health: Health<'p, Vec<f32>>,
    channels: Vec<ChannelHealth>,
    began: bool,
}

/// What was seen of one channel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChannelHealth {
    /// Number of the input, from 0.
    pub input: u16,
    /// Its name.
    pub name: String,
    /// The largest share of its changes, over some 32 steps, that the model did not explain, for each episode. `None` if too
    /// few of the episode's steps counted.
    pub worst: Vec<Option<f32>>,
    /// Number of episodes in which that was above the threshold.
    pub suspect: usize,
}

impl ChannelHealth {
    /// The median of the episodes in which enough steps counted.
    #[must_use]
    pub fn median(&self) -> Option<f32> {
        let mut known: Vec<f32> = self.worst.iter().copied().flatten().collect();
        known.sort_by(f32::total_cmp);
        known.get(known.len() / 2).copied()
    }
}

impl<'p> Watched<'p> {
    /// Watches an agent. `None` if its policy has no model to predict by.
    #[must_use]
    pub fn new(agent: Box<HostAgent<'p>>) -> Option<Self> {
        let memory = vec![0.0; Health::<Vec<f32>>::words(agent.policy())];
        let health = Health::new(agent.policy(), memory)?;
        let names: Vec<&str> = agent.policy().inputs().map(|(name, _)| name).collect();
        let channel = |input: u16| ChannelHealth {
            input,
            name: names[usize::from(input)].to_owned(),
            worst: Vec::new(),
            suspect: 0,
        };
        let channels = health.inputs().map(channel).collect();
        Some(Watched {
            agent,
            health,
            channels,
            began: false,
        })
    }

    /// What was seen in all episodes, the last one included.
    #[must_use]
    pub fn finish(mut self) -> Vec<ChannelHealth> {
        self.end_episode();
        self.channels
    }

    fn end_episode(&mut self) {
        if !self.began {
            return;
        }
        for channel in &mut self.channels {
            let worst = self.health.worst(channel.input);
            channel.suspect += usize::from(worst.is_some_and(|worst| worst > THRESHOLD));
            channel.worst.push(worst);
        }
    }
}

impl Controller for Watched<'_> {
    type Error = ObservationError;

    fn reset(&mut self, what: Reset, agent_seed: u64) -> Result<(), ObservationError> {
        self.end_episode();
        self.began = true;
        self.health.begin();
        Controller::reset(&mut *self.agent, what, agent_seed)
    }

    fn decide(&mut self, observation: &[f32]) -> Result<Reply<'_>, ObservationError> {
        let decision = self.agent.decide_traced(observation, &mut self.health)?;
        Ok(Reply {
            action: decision.action,
            instructions: decision.instructions,
        })
    }
}
