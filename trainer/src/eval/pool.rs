//! Scoring many policies at once, the same for any number of threads.

use std::sync::atomic::{AtomicUsize, Ordering};

use tpg_runtime::{CapacityError, HostAgent, Policy, Reset};

use super::{Arena, Episode};

/// How far a policy's evaluation can be split among threads without changing it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Split {
    /// Into single episodes: each starts from a full reset.
    Episodes,
    /// Into agents: an agent's episodes follow on one another.
    Agents,
}

/// One arena for each thread.
pub struct Pool {
    arenas: Vec<Arena>,
}

/// One piece of work: episodes of one policy, in order, from a given one on.
struct Job {
    policy: usize,
    first_episode: usize,
    episodes: usize,
}

impl Pool {
    /// A pool of as many threads as there are arenas, at least one.
    #[must_use]
    pub fn new(arenas: Vec<Arena>) -> Self {
        Pool { arenas }
    }

    /// Runs every policy on every seed; the result holds each policy's episodes in order.
    ///
    /// A policy that is too large for a host's agent comes back as its [`CapacityError`].
    pub fn score(
        &mut self,
        policies: &[Policy<'_>],
        episode_seeds: &[u64],
        split: Split,
    ) -> Vec<Result<Vec<Episode>, CapacityError>> {
        let per_job = match split {
            Split::Episodes => 1,
            Split::Agents => episode_seeds.len(),
        };
        let jobs: Vec<Job> = (0..policies.len())
            .flat_map(|policy| {
                let starts = (0..episode_seeds.len()).step_by(per_job.max(1));
                starts.map(move |first_episode| Job {
                    policy,
                    first_episode,
                    episodes: per_job,
                })
            })
            .collect();
        let next = AtomicUsize::new(0);
        let work = |arena: &mut Arena| {
            let mut done = Vec::new();
            let mut agent: Option<Box<HostAgent<'_>>> = None;
            let mut loaded = None;
            while let Some(k) =
                Some(next.fetch_add(1, Ordering::Relaxed)).filter(|k| *k < jobs.len())
            {
                let job = &jobs[k];
                if loaded != Some(job.policy) {
                    if let Err(e) = load(&mut agent, policies[job.policy]) {
                        done.push((k, Err(e)));
                        continue;
                    }
                    loaded = Some(job.policy);
                }
                let Some(agent) = agent.as_deref_mut() else {
                    continue;
                };
                let seeds = &episode_seeds[job.first_episode..job.first_episode + job.episodes];
                done.push((k, Ok(run(arena, agent, seeds))));
            }
            done
        };
        let mut results: Vec<(usize, Result<Vec<Episode>, CapacityError>)> =
            match self.arenas.as_mut_slice() {
                [only] => work(only),
                arenas => std::thread::scope(|scope| {
                    let workers: Vec<_> = arenas
                        .iter_mut()
                        .map(|arena| scope.spawn(|| work(arena)))
                        .collect();
                    workers
                        .into_iter()
                        .flat_map(|worker| match worker.join() {
                            Ok(done) => done,
                            Err(panic) => std::panic::resume_unwind(panic),
                        })
                        .collect()
                }),
            };
        results.sort_by_key(|(k, _)| *k);
        let mut scored: Vec<Result<Vec<Episode>, CapacityError>> =
            policies.iter().map(|_| Ok(Vec::new())).collect();
        for (k, result) in results {
            let place = &mut scored[jobs[k].policy];
            match (place.as_mut(), result) {
                (Ok(episodes), Ok(more)) => episodes.extend(more),
                (_, Err(e)) => *place = Err(e),
                (Err(_), Ok(_)) => {}
            }
        }
        scored
    }

    /// Runs one policy on every seed, in order, and returns the shared memory that it leaves too.
    ///
    /// # Errors
    /// [`CapacityError`] if the policy is too large for a host's agent.
    pub fn score_alone(
        &mut self,
        policy: Policy<'_>,
        episode_seeds: &[u64],
    ) -> Result<Alone, CapacityError> {
        let mut agent = Box::new(HostAgent::new(policy)?);
        let arena = self.arenas.first_mut();
        let episodes = arena.map_or_else(Vec::new, |arena| run(arena, &mut agent, episode_seeds));
        Ok((episodes, agent.memory().to_vec()))
    }
}

/// What one policy's episodes came to, and the memory that they left.
type Alone = (Vec<Episode>, Vec<f32>);

/// Loads a policy into the worker's agent, which is made at its first policy.
fn load<'p>(
    agent: &mut Option<Box<HostAgent<'p>>>,
    policy: Policy<'p>,
) -> Result<(), CapacityError> {
    match agent {
        Some(agent) => agent.load(policy),
        None => {
            *agent = Some(Box::new(HostAgent::new(policy)?));
            Ok(())
        }
    }
}

fn run(arena: &mut Arena, agent: &mut HostAgent<'_>, episode_seeds: &[u64]) -> Vec<Episode> {
    let mut episodes = Vec::with_capacity(episode_seeds.len());
    for (k, seed) in episode_seeds.iter().enumerate() {
        let what = if k == 0 { Reset::Agent } else { Reset::Episode };
        // The policy was lowered for this arena, so its observations have the right length.
        if let Ok(episode) = arena.episode(agent, what, *seed) {
            episodes.push(episode);
        }
    }
    episodes
}
