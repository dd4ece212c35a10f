//! A build with MPI.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use tpg_tasks::console::note;
use tpg_tasks::exit_status::{Failure, Fault as _, Status};
use tpg_trainer::cluster::{Head, Member, join};
use tpg_trainer::evaluator::Evaluator;
use tpg_trainer::monitor::Monitor;
use tpg_trainer::session::Session;

use crate::interrupt::{flag_on_signal, stop_on_signal};

/// The ranks of a job, seen from rank 0.
pub(in super::super) struct Ranks {
    head: Head,
}

impl Ranks {
    /// How many there are.
    pub(in super::super) fn size(&self) -> usize {
        self.head.size()
    }

    /// An evaluator on all ranks.
    pub(in super::super) fn evaluator<'a>(
        &'a mut self,
        session: &Session,
        monitor: &Arc<Monitor>,
    ) -> Result<Box<dyn Evaluator + 'a>, Failure> {
        if session.scores_in_turn() {
            note(
                "warning: with this reset scope each team finds the memory that the one before left, so all are scored \
                 one after another by rank 0",
            );
        }
        let ranks = self.head.evaluator(session, monitor.clone());
        Ok(Box::new(ranks.or_usage("bad configuration")?))
    }
}

/// Trains in this process, or does its part if it is one of several. Rank 0 alone prints and writes files.
pub(in super::super) fn run(
    threads: Option<u16>,
    train: impl FnOnce(Arc<AtomicBool>, Option<&mut Ranks>) -> Result<Status, Failure>,
) -> Result<Status, Failure> {
    match join().map_err(Failure::peer)? {
        Member::Alone => train(stop_on_signal()?, None),
        Member::Worker(worker) => {
            let monitor = Arc::new(Monitor::new(flag_on_signal()?));
            worker.serve(&monitor).map_err(Failure::peer)?;
            Ok(Status::Fine)
        }
        Member::Head(head) => {
            let mut ranks = Ranks { head };
            if threads.is_some() {
                return Err(Failure::usage(anyhow::anyhow!(
                    "--threads is not for the ranks of a job, which have one thread each: give mpirun more ranks"
                )));
            }
            let result = train(stop_on_signal()?, Some(&mut ranks));
            let status = result
                .as_ref()
                .map_or_else(|failure| failure.status, |status| *status);
            ranks.head.set_abort_status(status.code());
            result
        }
    }
}
