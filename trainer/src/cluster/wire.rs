//! What the ranks of a job say to one another: bytes of postcard, told apart by MPI's tags.

use std::error::Error;

use mpi::Tag;
use mpi::topology::Rank;
use serde::{Deserialize, Serialize};
use tpg_tasks::eval::{Conditions, Episode};

use super::error::ClusterError;
use crate::front_end::Recording;

/// Rank 0 to another: what the run is, a [`Setup`].
pub(super) const SETUP: Tag = 1;
/// Rank 0 to another: episodes to run, a [`Pack`].
pub(super) const WORK: Tag = 2;
/// Rank 0 to another: the end, without contents.
pub(super) const SHUTDOWN: Tag = 3;
/// To rank 0: what a pack came to, a [`Scored`].
pub(super) const SCORED: Tag = 4;
/// To rank 0: the sender cannot work, an [`Unfit`].
pub(super) const UNFIT: Tag = 5;
/// To rank 0: the sender has ended, without contents.
pub(super) const GOODBYE: Tag = 6;

/// Bytes for messages that have not left yet.
pub(super) const BUFFER: usize = 64 << 20;
/// Longer answers wait for rank 0 instead; a rank has at most three under way.
pub(super) const SHORT_ANSWER: usize = 256 << 10;
/// Longer packs wait for their rank instead; together so many bytes may be under way before another is sent.
pub(super) const SHORT_PACK: usize = BUFFER / 2;

/// What a rank needs to run a task's episodes.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Setup {
    /// The configuration, as TOML.
    pub(super) config: String,
    /// What fixes the task: a rank that finds other files must not score.
    pub(super) task_identity: String,
}

/// Why a rank cannot score.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Unfit {
    pub(super) host: String,
    pub(super) why: String,
}

/// Jobs for one rank.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Pack<'a> {
    /// Number of the batch; answers to an older one count for nothing.
    pub(super) batch: u64,
    pub(super) conditions: Conditions,
    pub(super) record: bool,
    #[serde(borrow)]
    pub(super) jobs: Vec<PackedJob<'a>>,
}

/// Episodes of one policy.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct PackedJob<'a> {
    pub(super) policy: usize,
    pub(super) first_episode: usize,
    pub(super) seeds: Vec<u64>,
    /// The policy's bytes.
    #[serde(borrow)]
    pub(super) blob: &'a [u8],
}

/// What a pack came to.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Scored {
    pub(super) batch: u64,
    pub(super) jobs: Vec<ScoredJob>,
    /// Whether the rank was told to stop, so that some of the pack is missing.
    pub(super) stopped: bool,
    /// Why a simulation became unstable, if one did.
    pub(super) instability: Option<String>,
}

/// What one job came to.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct ScoredJob {
    pub(super) policy: usize,
    pub(super) first_episode: usize,
    /// `None` for a policy that is not sound or too large.
    pub(super) episodes: Option<Vec<Episode>>,
    pub(super) recordings: Vec<Recording>,
}

pub(super) fn encode(value: &impl Serialize) -> Vec<u8> {
    // Writing plain structures to memory does not fail.
    postcard::to_stdvec(value).unwrap_or_default()
}

pub(super) fn decode<'b, T: Deserialize<'b>>(
    rank: Rank,
    bytes: &'b [u8],
) -> Result<T, ClusterError> {
    postcard::from_bytes(bytes).map_err(|error| ClusterError::Message {
        rank,
        source: Box::<dyn Error + Send + Sync>::from(error),
    })
}
