//! What is known of roots, before and after they are scored.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::evolve::TeamId;

/// A root that is to be scored.
pub(super) struct Candidate {
    pub(super) root: TeamId,
    /// Steps that an episode of it may be expected to take: its parent's mean.
    pub(super) expected: f64,
}

/// What is known of a scored root.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// The generation in which it was scored.
    pub generation: u64,
    /// Mean return of its training episodes; −∞ if it could not be scored.
    pub score: f64,
    /// The same of the shaped rewards: what ranks it.
    pub fitness: f64,
    /// How often it was scored; both means are over all times.
    pub scorings: u32,
    /// Instructions executed per decision in those episodes.
    pub instructions_mean: f64,
    /// Shared memory as it stood when the scoring began, where memory outlives agents.
    pub memory: Option<Arc<[f32]>>,
    /// Steps of its mean training episode, by which the length of its children's is guessed; 0 after a resume.
    #[serde(skip)]
    pub steps_mean: f64,
}

impl Record {
    /// The means over the episodes of both.
    pub(super) fn and(&self, other: &Record) -> Record {
        let (a, b) = (f64::from(self.scorings), f64::from(other.scorings));
        let mean = |x: f64, y: f64| (a * x + b * y) / (a + b);
        Record {
            generation: self.generation,
            score: mean(self.score, other.score),
            fitness: mean(self.fitness, other.fitness),
            scorings: self.scorings + other.scorings,
            instructions_mean: mean(self.instructions_mean, other.instructions_mean),
            memory: self.memory.clone(),
            steps_mean: mean(self.steps_mean, other.steps_mean),
        }
    }
}
