//! What scoring a generation came to.

use std::sync::Arc;

use tpg_tasks::eval::Episode;
use tpg_tasks::stats::mean;

use super::record::Record;

/// What scoring a generation came to.
#[derive(Debug, Default)]
pub(super) struct EvalStats {
    pub(super) steps: u64,
    pub(super) unscorable: u64,
    pub(super) unstable: u64,
    pub(super) episodes: u64,
}

impl EvalStats {
    /// Counts a team's episodes; none means that it was too large to be scored.
    pub(super) fn add(
        &mut self,
        episodes: Option<&[Episode]>,
        generation: u64,
        memory: Option<Arc<[f32]>>,
    ) -> Record {
        let episodes = episodes.unwrap_or_default();
        let steps: u64 = episodes.iter().map(|e| u64::from(e.steps)).sum();
        let instructions: u64 = episodes.iter().map(|e| e.instructions).sum();
        let mean_of = |value: fn(&Episode) -> f64| {
            let values: Vec<f64> = episodes.iter().map(value).collect();
            mean(&values)
        };
        let score = mean_of(|e| e.total);
        self.steps += steps;
        self.episodes += episodes.len() as u64;
        self.unstable += episodes.iter().filter(|e| e.unstable).count() as u64;
        self.unscorable += u64::from(!score.is_finite());
        Record {
            generation,
            score: if score.is_finite() {
                score
            } else {
                f64::NEG_INFINITY
            },
            fitness: if score.is_finite() {
                mean_of(|e| e.shaped)
            } else {
                f64::NEG_INFINITY
            },
            scorings: 1,
            instructions_mean: instructions as f64 / steps.max(1) as f64,
            memory,
            steps_mean: steps as f64 / episodes.len().max(1) as f64,
        }
    }

    /// Counts episodes that score nobody in particular, and returns their mean.
    pub(super) fn count(&mut self, episodes: &[Episode], value: fn(&Episode) -> f64) -> f64 {
        self.steps += episodes.iter().map(|e| u64::from(e.steps)).sum::<u64>();
        self.episodes += episodes.len() as u64;
        self.unstable += episodes.iter().filter(|e| e.unstable).count() as u64;
        let values: Vec<f64> = episodes.iter().map(value).collect();
        mean(&values)
    }
}
