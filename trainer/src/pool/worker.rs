//! What one thread, or one process of a cluster, needs to score policies one after another.

use std::time::{Duration, Instant};

use tpg_runtime::{HostAgent, Policy, Reset};
use tpg_tasks::eval::{Arena, Conditions, Episode};

use crate::front_end::{Recorded, Recorder, Recording};
use crate::monitor::{EndedEarly, Monitor, Stoppable};

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

/// Episodes that one policy is to run, one after another.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Episodes<'a> {
    pub(crate) seeds: &'a [u64],
    pub(crate) conditions: Conditions,
    /// Whether to record what the policy sees.
    pub(crate) record: bool,
}

/// An arena, with a recorder once something has been recorded in it.
pub(crate) struct RecordingArena {
    arena: Arena,
    recorder: Option<Recorder>,
}

/// A thread's agent, made at its first policy and loaded with one after another.
#[derive(Default)]
pub(crate) struct Worker<'b> {
    agent: Option<Box<HostAgent<'b>>>,
    loaded: Option<usize>,
    pub(crate) spent: Spent,
}

impl<'b> Worker<'b> {
    /// Runs episodes of the policy with this number; `None` if it has no bytes, is not sound or too large.
    ///
    /// The bytes are asked for only if the policy is not the one that is loaded.
    pub(crate) fn score(
        &mut self,
        policy: usize,
        bytes: impl FnOnce() -> Option<&'b [u8]>,
        episodes: &Episodes<'_>,
        arena: &mut RecordingArena,
        monitor: &Monitor,
    ) -> Option<Ran> {
        if self.loaded != Some(policy) {
            self.loaded = None;
            let bytes = timed(&mut self.spent.lowering, bytes);
            timed(&mut self.spent.loading, || {
                let policy = Policy::load(bytes?).ok()?;
                match &mut self.agent {
                    Some(agent) => agent.load(policy).ok()?,
                    None => self.agent = Some(Box::new(HostAgent::new(policy).ok()?)),
                }
                Some(())
            })?;
            self.loaded = Some(policy);
        }
        let agent = self.agent.as_deref_mut()?;
        Some(timed(&mut self.spent.episodes, || {
            arena.run(agent, episodes, monitor)
        }))
    }
}

/// Adds the time that something takes.
pub(super) fn timed<T>(sum: &mut Duration, something: impl FnOnce() -> T) -> T {
    let started = Instant::now();
    let result = something();
    *sum += started.elapsed();
    result
}

/// Episodes that one policy ran, with what they showed if that is recorded.
#[derive(Default)]
pub(crate) struct Ran {
    pub(crate) episodes: Vec<Episode>,
    pub(crate) recordings: Vec<Recording>,
}

impl RecordingArena {
    pub(crate) fn new(arena: Arena) -> Self {
        RecordingArena {
            arena,
            recorder: None,
        }
    }

    /// Runs episodes of one agent. What is missing at the end was stopped through the monitor.
    pub(crate) fn run(
        &mut self,
        agent: &mut HostAgent<'_>,
        episodes: &Episodes<'_>,
        monitor: &Monitor,
    ) -> Ran {
        let RecordingArena { arena, recorder } = self;
        arena.impose(episodes.conditions);
        let mut ran = Ran::default();
        ran.episodes.reserve_exact(episodes.seeds.len());
        for (k, seed) in episodes.seeds.iter().enumerate() {
            let what = if k == 0 { Reset::Agent } else { Reset::Episode };
            let inner = &mut *agent;
            let episode = if episodes.record {
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
