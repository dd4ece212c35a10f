//! Who runs the episodes that score policies. Evolution asks, and does not know who answers.
//!
//! [`Pool`](crate::pool::Pool) answers with threads of this process. Others may run episodes in another program or on other
//! machines: a policy travels as the bytes that are scored.

mod packs;

use std::error::Error;
use std::sync::Arc;

use tpg_tasks::eval::{Conditions, Episode};

use crate::front_end::Recording;
use crate::monitor::Monitor;

pub use packs::Packs;

/// Runs episodes of policies.
///
/// The same batches get the same answers, in every bit, on any number of workers: each episode is determined by its seed,
/// its policy, and the episodes of the same agent before it.
pub trait Evaluator {
    /// Through which others see how far scoring is, and stop it.
    fn monitor(&self) -> &Arc<Monitor>;

    /// Runs every policy on every seed. The result holds each policy's episodes in order.
    ///
    /// A policy without bytes, or one that is not sound or too large, comes back as `None`.
    ///
    /// # Errors
    /// [`EvaluatorError::Stopped`] soon after the monitor was stopped, [`EvaluatorError::Failed`] where episodes could not
    /// be run. What was recorded for the batch may be incomplete then.
    fn score(&mut self, batch: &Batch<'_>) -> Result<Vec<Option<Vec<Episode>>>, EvaluatorError>;

    /// Runs one policy on every seed, in order, and returns the shared memory that it leaves too. `None` if the policy is
    /// not sound or too large.
    ///
    /// # Errors
    /// As for [`Evaluator::score`].
    fn score_alone(&mut self, alone: &Alone<'_>) -> Result<Option<AloneScore>, EvaluatorError>;

    /// What was recorded since the last call, in the order of batches, policies and episodes.
    fn take_recordings(&mut self) -> Vec<Recording>;
}

/// Why a batch was not scored.
#[derive(Debug, thiserror::Error)]
pub enum EvaluatorError {
    /// The monitor was stopped.
    #[error("stopped before its end")]
    Stopped,
    /// Episodes could not be run.
    #[error(transparent)]
    Failed(Box<dyn Error + Send + Sync>),
}

/// How far a policy's evaluation can be split among workers without changing it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Split {
    /// Into single episodes: each starts from a full reset.
    Episodes,
    /// Into agents: an agent's episodes follow on one another.
    Agents,
}

/// Policies that are to be scored.
pub struct Batch<'a> {
    /// For each policy, how long an episode of it may be expected to last, in any unit. The longest go first; the
    /// results do not depend on it.
    pub expected: &'a [f64],
    /// Makes the bytes of a policy by its number; `None` if it has none. Called once for each, by any thread.
    pub make: &'a (dyn Fn(usize) -> Option<Vec<u8>> + Sync),
    /// Episodes of each policy, at least one.
    pub episodes: usize,
    /// Their seeds: a list of that length for all policies, or several lists, one after another, which the policies take
    /// in turn.
    pub episode_seeds: &'a [u64],
    /// How far these may be split.
    pub split: Split,
    /// In what the episodes are easier than the task.
    pub conditions: Conditions,
    /// Whether to record what the policies see, for [`Evaluator::take_recordings`].
    pub record: bool,
}

/// A policy that is scored by itself, because others wait for the memory that it leaves.
pub struct Alone<'a> {
    /// Its bytes.
    pub blob: &'a [u8],
    /// Seeds of its episodes.
    pub episode_seeds: &'a [u64],
    /// In what the episodes are easier than the task.
    pub conditions: Conditions,
    /// Whether to record what the policy sees.
    pub record: bool,
}

/// What one policy's episodes came to, and the memory that they left.
pub type AloneScore = (Vec<Episode>, Vec<f32>);

/// One piece of work: episodes of one policy, in order, from a given one on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Job {
    /// Number of the policy in its batch.
    pub policy: usize,
    /// Number of the first episode.
    pub first_episode: usize,
    /// How many episodes.
    pub episodes: usize,
}

/// Policies whose episodes are split, at the end of the line, for each worker: enough to occupy every worker to the end,
/// and so few that hardly any policy is loaded twice.
const SPLIT_AT_THE_END: usize = 4;

/// The jobs of a batch, in the order in which `workers` should take them.
///
/// Whole policies come first, the longest of them before the others. Then come the shortest, split into their episodes
/// where they may be, so that all workers end together.
#[must_use]
pub fn jobs(expected: &[f64], episodes: usize, split: Split, workers: usize) -> Vec<Job> {
    let mut order: Vec<usize> = (0..expected.len()).collect();
    order.sort_by(|a, b| expected[*b].total_cmp(&expected[*a]));
    let splits = match split {
        Split::Episodes if workers > 1 => SPLIT_AT_THE_END * workers,
        _ => 0,
    };
    let whole = order.len().saturating_sub(splits);
    let job = |policy, first_episode, episodes| Job {
        policy,
        first_episode,
        episodes,
    };
    let (long, short) = order.split_at(whole);
    let long = long.iter().map(|policy| job(*policy, 0, episodes));
    let short = short
        .iter()
        .flat_map(|policy| (0..episodes).map(move |k| job(*policy, k, 1)));
    long.chain(short).collect()
}

/// The seeds of a job: its policy's list, from the job's first episode on.
#[must_use]
pub fn job_seeds<'a>(job: &Job, episode_seeds: &'a [u64], episodes: usize) -> &'a [u64] {
    let lists = (episode_seeds.len() / episodes).max(1);
    let first = job.policy % lists * episodes + job.first_episode;
    &episode_seeds[first..][..job.episodes]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn order(expected: &[f64], workers: usize, split: Split) -> Vec<(usize, usize, usize)> {
        let triple = |job: &Job| (job.policy, job.first_episode, job.episodes);
        let jobs = jobs(expected, 2, split, workers);
        jobs.iter().map(triple).collect()
    }

    #[test]
    fn the_longest_go_first_and_the_last_are_split() {
        let mut expected = vec![1.0; 9];
        expected[3] = 7.0;
        let line = order(&expected, 2, Split::Episodes);
        assert_eq!(line[..3], [(3, 0, 2), (0, 0, 1), (0, 1, 1)]);
        assert_eq!(line.len(), 1 + 2 * 8);
        let agents = order(&expected, 2, Split::Agents);
        assert_eq!(agents[..2], [(3, 0, 2), (0, 0, 2)]);
        assert_eq!(agents.len(), 9);
    }

    #[test]
    fn policies_take_the_lists_of_seeds_in_turn() {
        let seeds = [1, 2, 3, 4];
        let of = |policy, first_episode, episodes| {
            let job = Job {
                policy,
                first_episode,
                episodes,
            };
            job_seeds(&job, &seeds, 2)
        };
        assert_eq!(of(0, 0, 2), [1, 2]);
        assert_eq!(of(1, 1, 1), [4]);
        assert_eq!(of(2, 0, 1), [1]);
    }
}
