//! Scoring many policies at once on the threads of this process, the same for any number of them.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use tpg_runtime::{HostAgent, Policy, Reset};

use tpg_tasks::eval::{Arena, Conditions, Episode};

use crate::evaluator::{Alone, AloneScore, Batch, Evaluator, EvaluatorError, Job, job_seeds, jobs};
use crate::front_end::{Recorded, Recorder, Recording};
use crate::monitor::{EndedEarly, Monitor, Stoppable};

/// One arena for each thread.
pub struct Pool {
    arenas: Vec<RecordingArena>,
    spent: Spent,
    recordings: Vec<Recording>,
    monitor: Arc<Monitor>,
}

/// Time that threads spent, summed over them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Spent {
    /// Making the bytes of policies.
    pub lowering: Duration,
    /// Decoding and checking them, and putting them into agents.
    pub loading: Duration,
    /// Episodes: tasks, wrappers and decisions.
    pub episodes: Duration,
    /// Nothing: the line was empty, and other threads were still at work.
    pub idle: Duration,
}

/// An arena, with a recorder once something has been recorded in it.
struct RecordingArena {
    arena: Arena,
    recorder: Option<Recorder>,
}

impl Pool {
    /// A pool of as many threads as there are arenas, at least one.
    #[must_use]
    pub fn new(arenas: Vec<Arena>) -> Self {
        let arenas = arenas.into_iter().map(|arena| RecordingArena {
            arena,
            recorder: None,
        });
        Pool {
            arenas: arenas.collect(),
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
                done.push((job, worker.score(job, &blobs, batch, arena, monitor)));
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
                arena.run(
                    &mut agent,
                    alone.episode_seeds,
                    alone.conditions,
                    alone.record,
                    monitor,
                )
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

/// A thread's agent, made at its first policy and loaded with one after another.
#[derive(Default)]
struct Worker<'b> {
    agent: Option<Box<HostAgent<'b>>>,
    loaded: Option<usize>,
    spent: Spent,
}

impl<'b> Worker<'b> {
    /// The job's episodes, unless its policy is none.
    fn score(
        &mut self,
        job: &Job,
        blobs: &'b [OnceLock<Option<Vec<u8>>>],
        batch: &Batch<'_>,
        arena: &mut RecordingArena,
        monitor: &Monitor,
    ) -> Option<Ran> {
        if self.loaded != Some(job.policy) {
            self.loaded = None;
            // Whoever needs the policy first makes its bytes.
            let bytes = timed(&mut self.spent.lowering, || {
                blobs[job.policy].get_or_init(|| (batch.make)(job.policy))
            });
            timed(&mut self.spent.loading, || {
                let policy = Policy::load(bytes.as_deref()?).ok()?;
                match &mut self.agent {
                    Some(agent) => agent.load(policy).ok()?,
                    None => self.agent = Some(Box::new(HostAgent::new(policy).ok()?)),
                }
                Some(())
            })?;
            self.loaded = Some(job.policy);
        }
        let agent = self.agent.as_deref_mut()?;
        let seeds = job_seeds(job, batch.episode_seeds, batch.episodes);
        let spent = &mut self.spent.episodes;
        Some(timed(spent, || {
            arena.run(agent, seeds, batch.conditions, batch.record, monitor)
        }))
    }
}

/// Adds the time that something takes.
fn timed<T>(sum: &mut Duration, something: impl FnOnce() -> T) -> T {
    let started = Instant::now();
    let result = something();
    *sum += started.elapsed();
    result
}

/// Episodes that one policy ran, with what they showed if that is recorded.
#[derive(Default)]
struct Ran {
    episodes: Vec<Episode>,
    recordings: Vec<Recording>,
}

impl RecordingArena {
    fn run(
        &mut self,
        agent: &mut HostAgent<'_>,
        episode_seeds: &[u64],
        conditions: Conditions,
        record: bool,
        monitor: &Monitor,
    ) -> Ran {
        let RecordingArena { arena, recorder } = self;
        arena.impose(conditions);
        let mut ran = Ran::default();
        ran.episodes.reserve_exact(episode_seeds.len());
        for (k, seed) in episode_seeds.iter().enumerate() {
            let what = if k == 0 { Reset::Agent } else { Reset::Episode };
            let inner = &mut *agent;
            let episode = if record {
                let recorder = recorder.get_or_insert_with(|| {
                    let spec = arena.task().spec();
                    Recorder::new(
                        arena.wrappers().inputs().len(),
                        spec.actions,
                        spec.max_steps,
                    )
                });
                let inner = Recorded { inner, recorder };
                let mut stoppable = Stoppable { inner, monitor };
                let episode = arena.episode(&mut stoppable, what, *seed);
                let recording = episode.is_ok().then(|| stoppable.inner.recorder.finish());
                ran.recordings.extend(recording);
                episode
            } else {
                arena.episode(&mut Stoppable { inner, monitor }, what, *seed)
            };
            match episode {
                Ok(episode) => {
                    monitor.count(episode.steps);
                    if episode.unstable {
                        monitor.note_instability(|| arena.task().instability());
                    }
                    ran.episodes.push(episode);
                }
                // The policy was lowered for this arena, so its observations have the right length.
                Err(EndedEarly::Unfit) => {}
                Err(EndedEarly::Stopped) => break,
            }
        }
        ran
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluator::Split;
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
