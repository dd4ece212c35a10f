//! Scoring the roots of a generation.

use tpg_runtime::blob::ResetScope;

use super::Session;
use super::eval_stats::EvalStats;
use super::record::Candidate;
use crate::evaluator::{Alone, Batch, Evaluator, EvaluatorError, Split};
use crate::lower::Mode;
use tpg_tasks::eval::{Domain, episode_seed};

impl Session {
    /// Whether teams are scored one after another, because each finds the memory that the one before left.
    #[must_use]
    pub const fn scores_in_turn(&self) -> bool {
        matches!(
            self.settings.policy_spec.reset_scope,
            ResetScope::PerGeneration | ResetScope::Original
        )
    }

    /// Scores new roots on the very bytes that would be exported, and records them.
    pub(super) fn score(
        &mut self,
        evaluator: &mut dyn Evaluator,
        candidates: &[Candidate],
        stats: &mut EvalStats,
    ) -> Result<(), EvaluatorError> {
        let episodes = u64::from(self.settings.episodes);
        let seeds: Vec<u64> = (0..episodes)
            .map(|k| episode_seed(Domain::Train, self.seed, self.state.generation, k))
            .collect();
        match self.settings.policy_spec.reset_scope {
            ResetScope::PerGeneration => {
                self.state.memory = None;
                self.score_in_turn(evaluator, candidates, &seeds, stats)
            }
            ResetScope::Original => {
                let fallen =
                    matches!(self.state.medians, [Some(last), Some(before)] if last < before);
                if self.settings.wipe_on_fall && fallen {
                    self.state.memory = None;
                }
                self.score_in_turn(evaluator, candidates, &seeds, stats)
            }
            _ => self.score_apart(evaluator, candidates, &seeds, stats),
        }
    }

    /// How far the evaluation of an agent that shares nothing with others can be split.
    pub(super) fn split(&self) -> Split {
        match self.settings.policy_spec.reset_scope.at_episode() {
            (true, true) => Split::Episodes,
            _ => Split::Agents,
        }
    }

    /// Scores roots that share nothing, on all workers.
    fn score_apart(
        &mut self,
        evaluator: &mut dyn Evaluator,
        candidates: &[Candidate],
        seeds: &[u64],
        stats: &mut EvalStats,
    ) -> Result<(), EvaluatorError> {
        let expected: Vec<f64> = candidates.iter().map(|n| n.expected).collect();
        let make = |k: usize| {
            let root = candidates[k].root;
            // One that is scored again is what it was: its front end is of the generation that made it.
            let record = self.state.records.get(&root);
            let generation = record.map_or(self.state.generation, |r| r.generation);
            self.export(root, generation, None, Mode::Compact).ok()
        };
        let results = evaluator.score(&Batch {
            expected: &expected,
            make: &make,
            episodes: seeds.len(),
            episode_seeds: seeds,
            split: self.split(),
            conditions: self.training_conditions(),
            record: self.learner.is_some(),
        })?;
        for (candidate, episodes) in candidates.iter().zip(results) {
            let record = stats.add(episodes.as_deref(), self.state.generation, None);
            let record = match self.state.records.remove(&candidate.root) {
                Some(before) => before.and(&record),
                None => record,
            };
            self.state.records.insert(candidate.root, record);
        }
        Ok(())
    }

    /// Scores roots one after another, oldest first: each finds the memory that the one before left.
    ///
    /// The thesis's pool interleaved its processes at random; a fixed order makes runs repeatable.
    fn score_in_turn(
        &mut self,
        evaluator: &mut dyn Evaluator,
        candidates: &[Candidate],
        seeds: &[u64],
        stats: &mut EvalStats,
    ) -> Result<(), EvaluatorError> {
        for Candidate { root, .. } in candidates {
            let found = self.state.memory.clone();
            let blob = self
                .export(
                    *root,
                    self.state.generation,
                    found.as_deref(),
                    Mode::Compact,
                )
                .ok();
            let result = match &blob {
                Some(blob) => evaluator.score_alone(&Alone {
                    blob,
                    episode_seeds: seeds,
                    conditions: self.training_conditions(),
                    record: self.learner.is_some(),
                })?,
                None => None,
            };
            let (episodes, memory) = result.unzip();
            if let Some(memory) = memory {
                self.state.memory = Some(memory.into());
            }
            let record = stats.add(episodes.as_deref(), self.state.generation, found);
            self.state.records.insert(*root, record);
        }
        Ok(())
    }
}
