//! Scoring many policies at once on the threads of this process, the same for any number of them.

mod worker;

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::Instant;

use tpg_runtime::{HostAgent, Policy};

use tpg_tasks::eval::{Arena, Episode};

use crate::evaluator::{Alone, AloneScore, Batch, Evaluator, EvaluatorError, job_seeds, jobs};
use crate::front_end::Recording;
use crate::monitor::Monitor;

pub use worker::Spent;
use worker::timed;
pub(crate) use worker::{Episodes, Ran, RecordingArena, Worker};

/// One arena for each thread.
pub struct Pool {
    arenas: Vec<RecordingArena>,
    spent: Spent,
    recordings: Vec<Recording>,
    monitor: Arc<Monitor>,
}

impl Pool {
    /// A pool of as many threads as there are arenas, at least one.
    #[must_use]
    pub fn new(arenas: Vec<Arena>) -> Self {
        Pool {
            arenas: arenas.into_iter().map(RecordingArena::new).collect(),
            spent: Spent::default(),
            recordings: Vec::new(),
            monitor: Arc::default(),
        }
    }

    /// The same, watched and stopped through this monitor.
    #[must_use]
    pub fn with_monitor(self, monitor: Arc<Monitor>) -> Self {
        Pool { monitor, ..self }
    }

    /// What scoring has cost so far.
    #[must_use]
    pub const fn spent(&self) -> Spent {
        self.spent
    }
}

impl Evaluator for Pool {
    fn monitor(&self) -> &Arc<Monitor> {
        &self.monitor
    }

    fn score(&mut self, batch: &Batch<'_>) -> Result<Vec<Option<Vec<Episode>>>, EvaluatorError> {
        let workers = self.arenas.len();
        let jobs = jobs(batch.expected, batch.episodes, batch.split, workers);
        let next = AtomicUsize::new(0);
        let blobs: Vec<OnceLock<Option<Vec<u8>>>> = vec![OnceLock::new(); batch.expected.len()];
        let started = Instant::now();
        let monitor = &*self.monitor;
        let work = |arena: &mut RecordingArena| {
            let mut worker = Worker::default();
            let mut done = Vec::new();
            while let Some(job) = jobs.get(next.fetch_add(1, Ordering::Relaxed)) {
                if monitor.stopped() {
                    break;
                }
                // Whoever needs the policy first makes its bytes.
                let bytes = || blobs[job.policy].get_or_init(|| (batch.make)(job.policy));
                let episodes = Episodes {
                    seeds: job_seeds(job, batch.episode_seeds, batch.episodes),
                    conditions: batch.conditions,
                    record: batch.record,
                };
                let ran =
                    worker.score(job.policy, || bytes().as_deref(), &episodes, arena, monitor);
                done.push((job, ran));
            }
            (done, worker.spent, started.elapsed())
        };
        let results = match self.arenas.as_mut_slice() {
            [only] => vec![work(only)],
            arenas => std::thread::scope(|scope| {
                let workers: Vec<_> = arenas
                    .iter_mut()
                    .map(|arena| scope.spawn(|| work(arena)))
                    .collect();
                workers
                    .into_iter()
                    .map(|worker| match worker.join() {
                        Ok(done) => done,
                        Err(panic) => std::panic::resume_unwind(panic),
                    })
                    .collect()
            }),
        };
        let ended = started.elapsed();
        let mut parts = Vec::with_capacity(jobs.len());
        for (done, spent, worked) in results {
            self.spent.idle += ended.saturating_sub(worked);
            self.spent.lowering += spent.lowering;
            self.spent.loading += spent.loading;
            self.spent.episodes += spent.episodes;
            parts.extend(done);
        }
        if self.monitor.stopped() {
            return Err(EvaluatorError::Stopped);
        }
        parts.sort_unstable_by_key(|(job, _)| (job.policy, job.first_episode));
        let mut scored = vec![Some(Vec::new()); batch.expected.len()];
        for (job, ran) in parts {
            let place = &mut scored[job.policy];
            let episodes = ran.map(|ran| {
                self.recordings.extend(ran.recordings);
                ran.episodes
            });
            match (place.as_mut(), episodes) {
                (Some(before), Some(more)) => before.extend(more),
                _ => *place = None,
            }
        }
        Ok(scored)
    }

    fn score_alone(&mut self, alone: &Alone<'_>) -> Result<Option<AloneScore>, EvaluatorError> {
        let policy = Policy::load(alone.blob).ok();
        let Some(Ok(agent)) = policy.map(HostAgent::new) else {
            return Ok(None);
        };
        let mut agent = Box::new(agent);
        let monitor = &*self.monitor;
        let arena = self.arenas.first_mut();
        let ran = timed(&mut self.spent.episodes, || {
            arena.map_or_else(Ran::default, |arena| {
                let episodes = Episodes {
                    seeds: alone.episode_seeds,
                    conditions: alone.conditions,
                    record: alone.record,
                };
                arena.run(&mut agent, &episodes, monitor)
            })
        });
        if self.monitor.stopped() {
            return Err(EvaluatorError::Stopped);
        }
        self.recordings.extend(ran.recordings);
        Ok(Some((ran.episodes, agent.memory().to_vec())))
    }

    fn take_recordings(&mut self) -> Vec<Recording> {
        std::mem::take(&mut self.recordings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluator::Split;
    use tpg_tasks::eval::Conditions;
    use tpg_tasks::task::{CartPole, Task as _, Wrappers};

    #[test]
    fn every_policy_that_cannot_be_made_comes_back_as_none() {
        let arena = || {
            let task = CartPole::new();
            let wrappers = Wrappers::new(&[], task.spec()).expect("nothing is hidden");
            Arena::new(Box::new(task), wrappers)
        };
        let mut pool = Pool::new(vec![arena(), arena()]);
        let batch = Batch {
            expected: &[0.0; 40],
            make: &|k| (k % 2 == 0).then(|| b"no policy".to_vec()),
            episodes: 1,
            episode_seeds: &[1],
            split: Split::Episodes,
            conditions: Conditions::default(),
            record: false,
        };
        let scored = pool.score(&batch).expect("nobody stops it");
        assert_eq!(scored, vec![None; 40]);
    }
}
