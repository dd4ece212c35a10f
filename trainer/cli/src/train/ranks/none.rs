//! A build without MPI.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use tpg_tasks::exit_status::{Failure, Status};
use tpg_trainer::evaluator::Evaluator;
use tpg_trainer::monitor::Monitor;
use tpg_trainer::session::Session;

use crate::interrupt::stop_on_signal;

/// There are none.
pub(in super::super) enum Ranks {}

impl Ranks {
    pub(in super::super) fn size(&self) -> usize {
        match *self {}
    }

    pub(in super::super) fn evaluator<'a>(
        &'a mut self,
        _session: &Session,
        _monitor: &Arc<Monitor>,
    ) -> Result<Box<dyn Evaluator + 'a>, Failure> {
        match *self {}
    }
}

/// Trains in this process, unless it is one of several.
pub(in super::super) fn run(
    _threads: Option<u16>,
    train: impl FnOnce(Arc<AtomicBool>, Option<&mut Ranks>) -> Result<Status, Failure>,
) -> Result<Status, Failure> {
    let ranks = std::env::var("OMPI_COMM_WORLD_SIZE").unwrap_or_default();
    if ranks.parse().is_ok_and(|ranks: u32| ranks > 1) {
        return Err(Failure::usage(anyhow::anyhow!(
            "mpirun started {ranks} processes, but this program was built without MPI: build it with \
             `cargo build --release -p tpg --features mpi`"
        )));
    }
    train(stop_on_signal()?, None)
}
