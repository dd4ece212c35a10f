//! Scoring by the ranks of an MPI job: rank 0 evolves, all ranks run episodes.
//!
//! Evolution asks the [`Head`] as it would ask the threads of a [`Pool`](crate::pool::Pool), and gets the same answers in
//! every bit. The other ranks [serve](Worker::serve). A policy travels as the bytes that are scored.

mod error;
mod head;
mod link;
mod wire;
mod worker;

use mpi::Threading;
use mpi::topology::{Communicator as _, SimpleCommunicator};

pub use error::ClusterError;
pub use head::{Head, Ranks};
pub use worker::Worker;

use link::{HEAD, Link};

/// Variables that launchers set for the processes of a job: `mpirun` of OpenMPI, others by PMIx or PMI.
const LAUNCHED: [&str; 3] = ["OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK"];

/// What this process is in its job.
pub enum Member {
    /// It has no job, or a job of one rank.
    Alone,
    /// It evolves.
    Head(Head),
    /// It runs episodes.
    Worker(Worker),
}

/// What this process is in its job. Starts MPI if a launcher started the process.
///
/// A panic of any thread ends the whole job from then on, after its message: the others would wait for ever.
///
/// # Errors
/// [`ClusterError::Start`].
pub fn join() -> Result<Member, ClusterError> {
    if LAUNCHED.iter().all(|name| std::env::var_os(name).is_none()) {
        return Ok(Member::Alone);
    }
    // The handler of signals has a thread of its own, which does not call MPI.
    let (universe, _) =
        mpi::initialize_with_threading(Threading::Funneled).ok_or(ClusterError::Start)?;
    let world = universe.world();
    if world.size() == 1 {
        return Ok(Member::Alone);
    }
    abort_on_panic();
    let rank = world.rank();
    let link = Link::new(universe, world);
    Ok(match rank {
        HEAD => Member::Head(Head::new(link)),
        _ => Member::Worker(Worker::new(link)),
    })
}

fn abort_on_panic() {
    let before = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        before(info);
        if mpi::environment::is_initialized() && !mpi::environment::is_finalized() {
            SimpleCommunicator::world().abort(PANICKED);
        }
    }));
}

/// Exit status of a job in which a rank panicked, as of a process that did.
const PANICKED: i32 = 101;
