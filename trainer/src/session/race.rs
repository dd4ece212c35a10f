//! Choosing the champion on episodes that train nobody.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::Session;
use super::eval_stats::EvalStats;
use crate::evaluator::{Batch, Evaluator, EvaluatorError};
use crate::evolve::TeamId;
use crate::lower::Mode;
use tpg_tasks::eval::{Conditions, Domain, episode_seed};
use tpg_tasks::stats::{mean, standard_deviation};

/// Standard errors by which one must lie behind the leader to leave a race.
const BEATEN: f64 = 2.0;

/// Races so far: who won the last one, and what everyone who may race again returned.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Race {
    pub(super) champion: Option<TeamId>,
    /// Returns on the first episodes of the run's list, in order; all races use the same list.
    pub(super) returns: BTreeMap<TeamId, Vec<f64>>,
}

impl Race {
    /// Mean return of one that has run.
    pub(super) fn mean(&self, root: TeamId) -> Option<f64> {
        self.returns.get(&root).map(|returns| mean(returns))
    }

    /// Episodes of the list that it has run.
    fn has_run(&self, root: TeamId) -> usize {
        self.returns.get(&root).map_or(0, Vec::len)
    }

    /// Keeps those that can still win after so many of all `last` episodes, the leader first.
    ///
    /// Who lies behind is judged by the differences on the same episodes. One that ran them all in an earlier race stays to the
    /// end: it costs nothing, and its few first episodes tell less than what is known of it.
    fn eliminate(&self, runners: &mut Vec<TeamId>, episodes: usize, last: usize) {
        let returns = |root: TeamId| self.returns.get(&root).and_then(|r| r.get(..episodes));
        runners.retain(|root| returns(*root).is_some());
        let key = |root: &TeamId| returns(*root).map_or(f64::NEG_INFINITY, mean);
        // A stable sort: of equals the one that was named first stays in front.
        runners.sort_by(|a, b| key(b).total_cmp(&key(a)));
        let Some(leader) = runners.first().and_then(|root| returns(*root)) else {
            return;
        };
        let can_win = |root: &TeamId| {
            if episodes < last && self.has_run(*root) >= last {
                return true;
            }
            let gaps: Vec<f64> = leader
                .iter()
                .zip(returns(*root).unwrap_or_default())
                .map(|(leader, runner)| leader - runner)
                .collect();
            let error = standard_deviation(&gaps) / (episodes as f64).sqrt();
            mean(&gaps) <= BEATEN * error
        };
        let first = runners.first().copied();
        runners.retain(|root| Some(*root) == first || can_win(root));
    }
}

impl Session {
    /// Where a race is due, lets the best agents run for champion against the last one.
    pub(super) fn race(
        &mut self,
        evaluator: &mut dyn Evaluator,
        stats: &mut EvalStats,
    ) -> Result<(), EvaluatorError> {
        let params = self.settings.selection;
        let due = (self.state.generation + 1).is_multiple_of(u64::from(params.every.max(1)));
        if params.candidates == 0 || !(due || self.state.race.champion.is_none()) {
            return Ok(());
        }
        let mut runners: Vec<TeamId> = self.state.race.champion.into_iter().collect();
        let best = self.state.ranking().into_iter().map(|(root, _)| root);
        for root in self.tuned().chain(best.take(params.candidates as usize)) {
            if self.state.records.contains_key(&root) && !runners.contains(&root) {
                runners.push(root);
            }
        }
        let (last, batch) = (params.episodes as usize, params.batch as usize);
        let mut run = 0;
        while run < last {
            let next = (run + batch).min(last);
            self.run_on(evaluator, &runners, run..next, stats)?;
            self.state.race.eliminate(&mut runners, next, last);
            run = next;
        }
        self.state.race.champion = runners.first().copied().or(self.state.race.champion);
        Ok(())
    }

    /// Runs these episodes of the list with those that have not yet run them.
    fn run_on(
        &mut self,
        evaluator: &mut dyn Evaluator,
        runners: &[TeamId],
        numbers: std::ops::Range<usize>,
        stats: &mut EvalStats,
    ) -> Result<(), EvaluatorError> {
        let fresh: Vec<TeamId> = runners
            .iter()
            .copied()
            .filter(|root| self.state.race.has_run(*root) == numbers.start)
            .collect();
        let seeds: Vec<u64> = numbers
            .map(|k| episode_seed(Domain::Select, self.seed, 0, k as u64))
            .collect();
        let make = |k: usize| {
            let root = fresh[k];
            let generation = self.state.records[&root].generation;
            self.export(root, generation, None, Mode::Compact).ok()
        };
        let expected: Vec<f64> = fresh
            .iter()
            .map(|r| self.state.records[r].steps_mean)
            .collect();
        evaluator.monitor().plan((fresh.len() * seeds.len()) as u64);
        let results = evaluator.score(&Batch {
            expected: &expected,
            make: &make,
            episodes: seeds.len(),
            episode_seeds: &seeds,
            split: self.split(),
            // Champions are chosen at the task itself, whatever training is spared.
            conditions: Conditions::default(),
            record: false,
        })?;
        for (root, episodes) in fresh.into_iter().zip(results) {
            let Some(episodes) = episodes else { continue };
            stats.count(&episodes, |e| e.total);
            let returns = self.state.race.returns.entry(root).or_default();
            returns.extend(episodes.iter().map(|e| e.total));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_lies_clearly_behind_leaves_and_who_may_win_stays() {
        let returns = [
            (1, vec![10.0, 12.0, 11.0, 13.0]),
            // Below the first in every episode by the same amount.
            (2, vec![9.0, 11.0, 10.0, 12.0]),
            // Behind on average, but within its errors.
            (3, vec![16.0, 6.0, 17.0, 5.0]),
            // Has not run yet.
            (4, vec![99.0]),
        ];
        let race = Race {
            champion: None,
            returns: returns.map(|(id, r)| (TeamId(id), r)).into(),
        };
        let mut runners = vec![TeamId(2), TeamId(3), TeamId(1), TeamId(4)];
        race.eliminate(&mut runners, 4, 8);
        assert_eq!(runners, [TeamId(1), TeamId(3)]);
        assert_eq!(race.mean(TeamId(1)), Some(11.5));
    }

    #[test]
    fn who_ran_all_episodes_before_is_judged_by_all_of_them() {
        let returns = [
            (1, vec![4.0, 5.0, 20.0, 21.0]),
            (2, vec![10.0, 11.0, 9.0, 10.0]),
        ];
        let race = Race {
            champion: Some(TeamId(1)),
            returns: returns.map(|(id, r)| (TeamId(id), r)).into(),
        };
        let mut runners = vec![TeamId(1), TeamId(2)];
        race.eliminate(&mut runners, 2, 4);
        assert_eq!(runners, [TeamId(2), TeamId(1)]);
        race.eliminate(&mut runners, 4, 4);
        assert_eq!(runners.first(), Some(&TeamId(1)));
    }
}
