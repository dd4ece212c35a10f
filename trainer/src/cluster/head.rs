//! The rank that evolves, and hands out work.

use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use mpi::topology::{Communicator as _, Rank};
use tpg_tasks::eval::Episode;

use super::error::ClusterError;
use super::link::{Idle, Link};
use super::wire;
use super::wire::{
    GOODBYE, Pack, PackedJob, SCORED, SETUP, SHORT_PACK, SHUTDOWN, Scored, ScoredJob, Setup, UNFIT,
    Unfit, WORK,
};
use crate::evaluator::{
    Alone, AloneScore, Batch, Evaluator, EvaluatorError, Job, Packs, job_seeds,
};
use crate::front_end::Recording;
use crate::monitor::Monitor;
use crate::pool::{Episodes, Pool, RecordingArena, Worker};
use crate::session::{Session, SessionError};

/// With more ranks than this, rank 0 runs no episodes of batches: it has enough to do with the others.
const SCORING_HEAD: usize = 16;
/// Packs that a rank has at a time: one that it works on, and one that waits.
const AHEAD: usize = 2;
/// How long ranks have to end after they are told to; then the job is aborted.
const GRACE: Duration = Duration::from_millis(1500);

/// Rank 0 of a job.
pub struct Head {
    link: Link,
    /// Exit status of a job that has to be aborted, because a rank does not end by itself.
    abort_status: i32,
}

impl Head {
    pub(super) fn new(link: Link) -> Self {
        Head {
            link,
            abort_status: 1,
        }
    }

    /// Number of ranks of the job, this one included.
    #[must_use]
    pub fn size(&self) -> usize {
        self.link.size()
    }

    /// An evaluator for a session: all ranks.
    ///
    /// # Errors
    /// [`SessionError::Config`] if the task is not to be had.
    pub fn evaluator(
        &mut self,
        session: &Session,
        monitor: Arc<Monitor>,
    ) -> Result<Ranks<'_>, SessionError> {
        let alone = session.pool(1)?.with_monitor(monitor.clone());
        let arena = RecordingArena::new(session.settings().arena()?);
        let setup = Setup {
            config: toml::to_string(session.config()).unwrap_or_default(),
            task_identity: session.settings().task_identity.clone(),
        };
        let bytes = wire::encode(&setup);
        let others = self.link.size() as Rank;
        (1..others).for_each(|rank| self.link.send(rank, SETUP, &bytes));
        Ok(Ranks {
            scores: self.link.size() <= SCORING_HEAD,
            link: &self.link,
            monitor,
            alone,
            arena,
            batch: 0,
            recordings: Vec::new(),
        })
    }

    /// The exit status that the job gets if a rank does not end within 1.5 seconds when this is dropped.
    pub fn set_abort_status(&mut self, status: u8) {
        self.abort_status = status.into();
    }
}

/// Ends the other ranks.
impl Drop for Head {
    fn drop(&mut self) {
        let others = self.link.size() as Rank - 1;
        (1..=others).for_each(|rank| self.link.send(rank, SHUTDOWN, &[]));
        let (started, mut ended, mut idle) = (Instant::now(), 0, Idle::default());
        while ended < others {
            match self.link.receive() {
                Some((_, GOODBYE, _)) => ended += 1,
                Some(_) => {}
                None if started.elapsed() > GRACE => self.link.world.abort(self.abort_status),
                None => idle.wait(),
            }
        }
    }
}

/// The ranks of a job, as those who score.
pub struct Ranks<'h> {
    link: &'h Link,
    monitor: Arc<Monitor>,
    /// Scores policies that wait for one another's memory.
    alone: Pool,
    arena: RecordingArena,
    /// Whether this rank runs episodes too.
    scores: bool,
    /// Number of the batch that is under way.
    batch: u64,
    recordings: Vec<Recording>,
}

/// What is known of a rank while a batch is scored.
#[derive(Debug, Clone, Default)]
struct Busy {
    /// Packs sent and not answered.
    packs: usize,
    /// Their bytes.
    bytes: Vec<usize>,
}

/// A batch while it is scored.
struct Scoring<'b> {
    batch: &'b Batch<'b>,
    packs: Packs,
    blobs: &'b [OnceLock<Option<Vec<u8>>>],
    busy: Vec<Busy>,
    done: Vec<ScoredJob>,
}

impl<'b> Scoring<'b> {
    fn blob(&self, policy: usize) -> Option<&'b [u8]> {
        let blobs = self.blobs;
        blobs[policy]
            .get_or_init(|| (self.batch.make)(policy))
            .as_deref()
    }

    fn seeds(&self, job: &Job) -> &'b [u64] {
        job_seeds(job, self.batch.episode_seeds, self.batch.episodes)
    }

    /// The next jobs as a message; those without bytes are done. `None` if no job is left.
    fn next_pack(&mut self, number: u64) -> Option<Vec<u8>> {
        while !self.packs.is_empty() {
            let mut packed = Vec::new();
            for job in self.packs.pack() {
                match self.blob(job.policy) {
                    Some(blob) => packed.push(PackedJob {
                        policy: job.policy,
                        first_episode: job.first_episode,
                        seeds: self.seeds(&job).to_vec(),
                        blob,
                    }),
                    None => self.done.push(none(&job)),
                }
            }
            if !packed.is_empty() {
                return Some(wire::encode(&Pack {
                    batch: number,
                    conditions: self.batch.conditions,
                    record: self.batch.record,
                    jobs: packed,
                }));
            }
        }
        None
    }

    /// Gives ranks work until each has enough or none is left.
    fn feed(&mut self, link: &Link, number: u64) {
        for round in 0..AHEAD {
            for rank in 1..self.busy.len() {
                let under_way: usize = self.busy.iter().flat_map(|busy| &busy.bytes).sum();
                if self.busy[rank].packs > round || under_way > SHORT_PACK {
                    continue;
                }
                let Some(bytes) = self.next_pack(number) else {
                    return;
                };
                link.send(rank as Rank, WORK, &bytes);
                self.busy[rank].packs += 1;
                self.busy[rank].bytes.push(bytes.len());
            }
        }
    }

    fn waits(&self) -> bool {
        self.busy.iter().any(|busy| busy.packs > 0)
    }
}

/// The result of a job whose policy is none.
fn none(job: &Job) -> ScoredJob {
    ScoredJob {
        policy: job.policy,
        first_episode: job.first_episode,
        episodes: None,
        recordings: Vec::new(),
    }
}

impl Ranks<'_> {
    /// Runs one job on this rank.
    fn run_here<'b>(&mut self, scoring: &mut Scoring<'b>, worker: &mut Worker<'b>) {
        let Some(job) = scoring.packs.one() else {
            return;
        };
        let episodes = Episodes {
            seeds: scoring.seeds(&job),
            conditions: scoring.batch.conditions,
            record: scoring.batch.record,
        };
        let bytes = || scoring.blob(job.policy);
        let ran = worker.score(job.policy, bytes, &episodes, &mut self.arena, &self.monitor);
        scoring.done.push(match ran {
            Some(ran) => ScoredJob {
                episodes: Some(ran.episodes),
                recordings: ran.recordings,
                ..none(&job)
            },
            None => none(&job),
        });
    }

    /// Takes a message.
    fn take(
        &mut self,
        scoring: &mut Scoring<'_>,
        (rank, tag, bytes): (Rank, mpi::Tag, Vec<u8>),
    ) -> Result<(), ClusterError> {
        match tag {
            SCORED => {
                let scored: Scored = wire::decode(rank, &bytes)?;
                // An answer to a batch that was stopped.
                if scored.batch != self.batch {
                    return Ok(());
                }
                let busy = &mut scoring.busy[rank as usize];
                busy.packs = busy.packs.saturating_sub(1);
                if !busy.bytes.is_empty() {
                    busy.bytes.remove(0);
                }
                if scored.stopped {
                    // A signal may reach one rank alone; the whole run stops then.
                    self.monitor.interrupt();
                }
                for episode in scored.jobs.iter().flat_map(|job| &job.episodes).flatten() {
                    self.monitor.count(episode.steps);
                }
                if let Some(reason) = scored.instability {
                    self.monitor.note_instability(|| Some(reason));
                }
                scoring.done.extend(scored.jobs);
                Ok(())
            }
            UNFIT => {
                let Unfit { host, why } = wire::decode(rank, &bytes)?;
                Err(ClusterError::Unfit { rank, host, why })
            }
            _ => Ok(()),
        }
    }

    fn run(&mut self, scoring: &mut Scoring<'_>) -> Result<(), EvaluatorError> {
        let (mut worker, mut idle) = (Worker::default(), Idle::default());
        scoring.feed(self.link, self.batch);
        while scoring.waits() || !scoring.packs.is_empty() {
            if self.monitor.stopped() {
                return Err(EvaluatorError::Stopped);
            }
            let mut heard = false;
            while let Some(message) = self.link.receive() {
                let taken = self.take(scoring, message);
                taken.map_err(|error| EvaluatorError::Failed(Box::new(error)))?;
                heard = true;
            }
            if heard {
                scoring.feed(self.link, self.batch);
                idle = Idle::default();
            }
            match self.scores && !scoring.packs.is_empty() {
                true => self.run_here(scoring, &mut worker),
                false if !heard => idle.wait(),
                false => {}
            }
        }
        Ok(())
    }
}

impl Evaluator for Ranks<'_> {
    fn monitor(&self) -> &Arc<Monitor> {
        &self.monitor
    }

    fn score(&mut self, batch: &Batch<'_>) -> Result<Vec<Option<Vec<Episode>>>, EvaluatorError> {
        self.batch += 1;
        let ranks = self.link.size();
        let workers = ranks - usize::from(!self.scores);
        let blobs = vec![OnceLock::new(); batch.expected.len()];
        let mut scoring = Scoring {
            batch,
            packs: Packs::new(batch.expected, batch.episodes, batch.split, workers),
            blobs: &blobs,
            busy: vec![Busy::default(); ranks],
            done: Vec::new(),
        };
        self.run(&mut scoring)?;
        if self.monitor.stopped() {
            return Err(EvaluatorError::Stopped);
        }
        let mut done = scoring.done;
        done.sort_unstable_by_key(|job| (job.policy, job.first_episode));
        let mut scored = vec![Some(Vec::new()); batch.expected.len()];
        for job in done {
            let place = &mut scored[job.policy];
            match (place.as_mut(), job.episodes) {
                (Some(before), Some(more)) => {
                    self.recordings.extend(job.recordings);
                    before.extend(more);
                }
                _ => *place = None,
            }
        }
        Ok(scored)
    }

    fn score_alone(&mut self, alone: &Alone<'_>) -> Result<Option<AloneScore>, EvaluatorError> {
        let scored = self.alone.score_alone(alone);
        self.recordings.extend(self.alone.take_recordings());
        scored
    }

    fn take_recordings(&mut self) -> Vec<Recording> {
        std::mem::take(&mut self.recordings)
    }
}
