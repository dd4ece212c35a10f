//! Ctrl-C and termination signals: the current generation is finished and a checkpoint written.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use tpg_tasks::console::note;
use tpg_tasks::exit_status::{Failure, Status};

/// A flag that the first signal sets; the second one ends the process at once.
pub(crate) fn stop_on_signal() -> Result<Arc<AtomicBool>, Failure> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = stop.clone();
    ctrlc::set_handler(move || {
        // A second signal ends the process at once; the last checkpoint stays as it is.
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(Status::Interrupted.code().into());
        }
        note("stopping, then writing a checkpoint; again to stop at once");
    })?;
    Ok(stop)
}
