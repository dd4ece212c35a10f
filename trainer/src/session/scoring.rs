//! Scoring the roots of a generation.

use tpg_runtime::blob::ResetScope;

use super::Session;
use super::eval_stats::EvalStats;
use super::record::Candidate;
use crate::evaluator::{Alone, Batch, Evaluator, EvaluatorError, Split};
use crate::evolve::TeamId;
use crate::lower::Mode;
use tpg_tasks::eval::{Domain, Episode, episode_seed};
use tpg_tasks::stats::{mean, standard_deviation};

/// Standard errors by which a new root must lie behind the last survivor to play no more.
const BEHIND: f64 = 2.0;

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
        let first = match self.settings.drop_after as usize {
            0 => seeds.len(),
            first => first.min(seeds.len()),
        };
        let (first, rest) = seeds.split_at(first);
        let all: Vec<&Candidate> = candidates.iter().collect();
        let mut results = self.play(evaluator, &all, first)?;
        if !rest.is_empty() {
            let staying = self.staying(candidates, &results);
            let some: Vec<&Candidate> = staying.iter().map(|k| &candidates[*k]).collect();
            let more = self.play(evaluator, &some, rest)?;
            for (k, more) in staying.into_iter().zip(more) {
                if let (Some(episodes), Some(more)) = (&mut results[k], more) {
                    episodes.extend(more);
                }
            }
        }
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

    /// The episodes of these roots, on these seeds.
    fn play(
        &self,
        evaluator: &mut dyn Evaluator,
        candidates: &[&Candidate],
        seeds: &[u64],
    ) -> Result<Vec<Option<Vec<Episode>>>, EvaluatorError> {
        let expected: Vec<f64> = candidates.iter().map(|n| n.expected).collect();
        let make = |k: usize| {
            let root = candidates[k].root;
            // One that is scored again is what it was: its front end is of the generation that made it.
            let record = self.state.records.get(&root);
            let generation = record.map_or(self.state.generation, |r| r.generation);
            self.export(root, generation, None, Mode::Compact).ok()
        };
        evaluator.score(&Batch {
            expected: &expected,
            make: &make,
            episodes: seeds.len(),
            episode_seeds: seeds,
            split: self.split(),
            conditions: self.training_conditions(),
            record: self.learner.is_some(),
        })
    }

    /// Which of the candidates play on after their first episodes, ascending.
    ///
    /// A new root plays on unless it lies two standard errors of its own mean behind the last of those that would survive now.
    /// Roots that are scored again play on, and so do those that selection keeps in any case.
    fn staying(&self, candidates: &[Candidate], played: &[Option<Vec<Episode>>]) -> Vec<usize> {
        let protected: Vec<TeamId> = self.tuned().chain(self.state.race.champion).collect();
        let shaped = |episodes: &[Episode]| -> Vec<f64> {
            episodes.iter().map(|episode| episode.shaped).collect()
        };
        let is_new = |candidate: &Candidate| !self.state.records.contains_key(&candidate.root);
        let new = candidates.iter().zip(played).filter(|(c, _)| is_new(c));
        let means = new.filter_map(|(_, e)| e.as_deref().map(|e| mean(&shaped(e))));
        let mut all: Vec<f64> = self
            .state
            .fitness()
            .into_iter()
            .map(|(_, f)| f)
            .chain(means)
            .collect();
        all.retain(|fitness| fitness.is_finite());
        all.sort_by(|a, b| b.total_cmp(a));
        let last = self.settings.params.population as usize;
        let last = all.get(last.saturating_sub(1)).copied();
        let can_survive = |episodes: &[Episode]| {
            let returns = shaped(episodes);
            let error = standard_deviation(&returns) / (returns.len() as f64).sqrt();
            let best = mean(&returns) + BEHIND * error;
            last.is_none_or(|last| best >= last)
        };
        let plays_on =
            |(_, (candidate, episodes)): &(usize, (&Candidate, &Option<Vec<Episode>>))| {
                !is_new(candidate)
                    || protected.contains(&candidate.root)
                    || episodes.as_deref().is_some_and(can_survive)
            };
        let numbered = candidates.iter().zip(played).enumerate();
        numbered.filter(plays_on).map(|(k, _)| k).collect()
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
