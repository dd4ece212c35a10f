use std::error::Error;

use mpi::topology::Rank;

/// Why the ranks of a job cannot work together.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ClusterError {
    /// MPI does not start.
    #[error(
        "MPI does not start, or was started before: check that mpirun and the library are of one installation"
    )]
    Start,
    /// A rank could not be told or asked something.
    #[error("rank {rank} sent a message that cannot be read: are all ranks the same program?")]
    Message {
        /// The rank.
        rank: Rank,
        /// Why not.
        #[source]
        source: Box<dyn Error + Send + Sync>,
    },
    /// A rank cannot run the task's episodes.
    #[error("rank {rank} on {host} cannot run the task: {why}")]
    Unfit {
        /// The rank.
        rank: Rank,
        /// Its machine.
        host: String,
        /// Why it cannot.
        why: String,
    },
}
