//! A rank that runs episodes.

use std::collections::VecDeque;
use std::sync::Arc;

use mpi::Tag;

use super::error::ClusterError;
use super::link::{HEAD, Idle, Link};
use super::wire;
use super::wire::{
    GOODBYE, Pack, SCORED, SETUP, SHUTDOWN, Scored, ScoredJob, Setup, UNFIT, Unfit, WORK,
};
use crate::config::{Config, Settings};
use crate::monitor::Monitor;
use crate::pool::{self, Episodes, RecordingArena};

/// A rank other than 0, which does what rank 0 says.
pub struct Worker {
    link: Link,
    /// What arrived and has not been looked at.
    inbox: VecDeque<(Tag, Vec<u8>)>,
}

impl Worker {
    pub(super) fn new(link: Link) -> Self {
        Worker {
            link,
            inbox: VecDeque::new(),
        }
    }

    /// Runs episodes until rank 0 ends the job. The monitor ends the episode that is running.
    ///
    /// # Errors
    /// [`ClusterError::Message`] if rank 0 cannot be understood.
    pub fn serve(mut self, monitor: &Arc<Monitor>) -> Result<(), ClusterError> {
        let mut arena = None;
        let mut idle = Idle::default();
        loop {
            self.collect();
            let Some((tag, bytes)) = self.inbox.pop_front() else {
                idle.wait();
                continue;
            };
            idle = Idle::default();
            match tag {
                SETUP => match set_up(&wire::decode(HEAD, &bytes)?) {
                    Ok(made) => arena = Some(made),
                    Err(why) => {
                        let host = mpi::environment::processor_name().unwrap_or_default();
                        self.link.send_value(HEAD, UNFIT, &Unfit { host, why });
                    }
                },
                WORK => {
                    if let Some(arena) = &mut arena {
                        let scored = self.score(&wire::decode(HEAD, &bytes)?, arena, monitor);
                        self.link.send_value(HEAD, SCORED, &scored);
                    }
                }
                SHUTDOWN => {
                    self.link.send(HEAD, GOODBYE, &[]);
                    return Ok(());
                }
                _ => {}
            }
        }
    }

    /// Takes what has arrived, so that rank 0 need not wait.
    fn collect(&mut self) {
        while let Some((_, tag, bytes)) = self.link.receive() {
            match tag {
                // Before all that is still to be done.
                SHUTDOWN => self.inbox.push_front((tag, bytes)),
                _ => self.inbox.push_back((tag, bytes)),
            }
        }
    }

    fn score(&mut self, pack: &Pack<'_>, arena: &mut RecordingArena, monitor: &Monitor) -> Scored {
        let mut worker = pool::Worker::default();
        let mut jobs = Vec::with_capacity(pack.jobs.len());
        for job in &pack.jobs {
            self.collect();
            let over = self.inbox.front().is_some_and(|(tag, _)| *tag == SHUTDOWN);
            if over || monitor.stopped() {
                break;
            }
            let episodes = Episodes {
                seeds: &job.seeds,
                conditions: pack.conditions,
                record: pack.record,
            };
            let ran = worker.score(job.policy, || Some(job.blob), &episodes, arena, monitor);
            let (episodes, recordings) = ran.map(|ran| (ran.episodes, ran.recordings)).unzip();
            jobs.push(ScoredJob {
                policy: job.policy,
                first_episode: job.first_episode,
                episodes,
                recordings: recordings.unwrap_or_default(),
            });
        }
        Scored {
            batch: pack.batch,
            stopped: monitor.stopped(),
            jobs,
            instability: monitor.instability().map(str::to_owned),
        }
    }
}

/// The task's arena, if it is the one that rank 0 means.
fn set_up(setup: &Setup) -> Result<RecordingArena, String> {
    let text = |error: &dyn std::error::Error| error.to_string();
    let config: Config = toml::from_str(&setup.config).map_err(|error| text(&error))?;
    let settings = Settings::new(&config).map_err(|error| text(&error))?;
    if settings.task_identity != setup.task_identity {
        let task = &settings.task;
        return Err(format!(
            "its files of {task} are not those of rank 0: put the same files on every machine"
        ));
    }
    let arena = settings.arena().map_err(|error| text(&error))?;
    Ok(RecordingArena::new(arena))
}
