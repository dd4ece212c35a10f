//! What one thread, or one process of a cluster, needs to score policies one after another.

use std::time::{Duration, Instant};

use tpg_runtime::{HostAgent, Policy, Reset};
use tpg_tasks::eval::{Arena, Conditions, Episode, Lanes};

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
    /// For episodes side by side, where the task allows it.
    lanes: Option<Lanes>,
    recorder: Option<Recorder>,
}

/// A thread's policy, and its agent, made at the first policy that needs it and loaded with one after another.
#[derive(Default)]
pub(crate) struct Worker<'b> {
    policy: Option<(usize, Policy<'b>)>,
    agent: Option<Box<HostAgent<'b>>>,
    /// Number of the policy that the agent is loaded with.
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
        let sound = match self.policy {
            Some((number, sound)) if number == policy => sound,
            _ => {
                let bytes = timed(&mut self.spent.lowering, bytes)?;
                let sound = timed(&mut self.spent.loading, || Policy::load(bytes)).ok()?;
                self.policy = Some((policy, sound));
                sound
            }
        };
        let spent = &mut self.spent;
        if let Some(ran) = timed(&mut spent.episodes, || {
            arena.run_side_by_side(sound, episodes, monitor)
        }) {
            return Some(ran);
        }
        if self.loaded != Some(policy) {
            self.loaded = None;
            timed(&mut spent.loading, || {
                match &mut self.agent {
                    Some(agent) => agent.load(sound).ok()?,
                    None => self.agent = Some(Box::new(HostAgent::new(sound).ok()?)),
                }
                Some(())
            })?;
            self.loaded = Some(policy);
        }
        let agent = self.agent.as_deref_mut()?;
        Some(timed(&mut spent.episodes, || {
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
            lanes: Lanes::of(&arena),
            arena,
            recorder: None,
        }
    }

    /// Runs episodes side by side; `None` if they have to run one after another. What is missing at the end was stopped through
    /// the monitor.
    fn run_side_by_side(
        &mut self,
        policy: Policy<'_>,
        episodes: &Episodes<'_>,
        monitor: &Monitor,
    ) -> Option<Ran> {
        let lanes = self.lanes.as_mut()?;
        if episodes.record || episodes.seeds.len() < 2 || !Lanes::accept(&policy) {
            return None;
        }
        lanes.impose(episodes.conditions);
        let ran = lanes.run(policy, episodes.seeds, || monitor.stopped())?;
        let done: Vec<_> = ran.into_iter().map_while(|episode| episode).collect();
        for episode in &done {
            monitor.count(episode.steps);
        }
        Some(Ran {
            episodes: done,
            recordings: Vec::new(),
        })
    }

    /// Runs episodes of one agent. What is missing at the end was stopped through the monitor.
    pub(crate) fn run(
        &mut self,
        agent: &mut HostAgent<'_>,
        episodes: &Episodes<'_>,
        monitor: &Monitor,
    ) -> Ran {
        let RecordingArena {
            arena, recorder, ..
        } = self;
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
