//! Ends the process if joining a run hangs in the shared memory's library, which knows no deadline for some of its waits.

use std::process;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread;
use std::time::Duration;

use crate::Status;
use crate::note;
use crate::run::RunName;

/// Shortest time without a sign of life: the library's own waits may take a second.
const SHORTEST: Duration = Duration::from_secs(2);

/// Time for a sign of life after the limit: a process that was stopped and goes on has had no chance to give one.
const GRACE: Duration = Duration::from_millis(100);

/// Whether this process is a program of the bridge, which may be ended.
static PROGRAM: AtomicBool = AtomicBool::new(false);

/// Lets watchdogs end this process. Without it they do nothing: only a program of its own may be ended from within.
pub fn may_end_this_process() {
    PROGRAM.store(true, Ordering::Relaxed);
}

/// Watches until it is dropped.
#[derive(Debug)]
pub(crate) struct Watchdog {
    alive: Option<Sender<()>>,
}

impl Watchdog {
    /// Begins to watch. Without a sign of life for `limit`, or two seconds if that is longer, the process ends.
    pub(crate) fn start(run: &RunName, limit: Duration) -> Self {
        if !PROGRAM.load(Ordering::Relaxed) {
            return Watchdog { alive: None };
        }
        let limit = limit.max(SHORTEST);
        let (alive, signs) = mpsc::channel();
        let run = run.clone();
        thread::spawn(move || {
            loop {
                let sign = match signs.recv_timeout(limit) {
                    Err(RecvTimeoutError::Timeout) => signs.recv_timeout(GRACE),
                    sign => sign,
                };
                match sign {
                    Ok(()) => {}
                    Err(RecvTimeoutError::Disconnected) => return,
                    Err(RecvTimeoutError::Timeout) => end(&run, limit),
                }
            }
        });
        Watchdog { alive: Some(alive) }
    }

    /// A sign of life.
    pub(crate) fn feed(&self) {
        if let Some(alive) = &self.alive {
            // If the thread has ended, so has the process.
            let _ = alive.send(());
        }
    }
}

fn end(run: &RunName, limit: Duration) -> ! {
    note(format_args!(
        "error: shared memory of run {run} does not come into use within {} ms: a file of another program or user is in \
         the way; remove /dev/shm/{}*, or choose another --run",
        limit.as_millis(),
        run.prefix()
    ));
    process::exit(i32::from(Status::Peer.code()))
}
