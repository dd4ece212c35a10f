//! The ranks of an MPI job, where a launcher such as `mpirun` started this process as one of several.

#[cfg(feature = "mpi")]
mod job;
#[cfg(not(feature = "mpi"))]
mod none;

#[cfg(feature = "mpi")]
pub(super) use job::{Ranks, run};
#[cfg(not(feature = "mpi"))]
pub(super) use none::{Ranks, run};
