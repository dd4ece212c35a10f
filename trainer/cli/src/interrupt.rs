//! Ctrl-C and termination signals: the generation is left, and a checkpoint written.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use tpg_tasks::console::note;
use tpg_tasks::exit_status::{Failure, Status};

/// Signals that come closer together than this are one: `timeout` sends its own to the process and to its group.
const ONE_SIGNAL: Duration = Duration::from_millis(250);

/// A flag that the first signal sets; the second one ends the process at once.
pub(crate) fn stop_on_signal() -> Result<Arc<AtomicBool>, Failure> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = stop.clone();
    let mut first = None;
    on_signal(move || {
        flag.store(true, Ordering::Relaxed);
        match first {
            None => {
                first = Some(Instant::now());
                note("stopping, then writing a checkpoint; again to stop at once");
            }
            // The second signal is meant: the last checkpoint stays as it is.
            Some(first) if Instant::elapsed(&first) >= ONE_SIGNAL => {
                std::process::exit(Status::Interrupted.code().into());
            }
            Some(_) => {}
        }
    })?;
    Ok(stop)
}

/// A flag that every signal sets, without a word: for a process that does what another one says.
#[cfg(feature = "mpi")]
pub(crate) fn flag_on_signal() -> Result<Arc<AtomicBool>, Failure> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = stop.clone();
    on_signal(move || flag.store(true, Ordering::Relaxed))?;
    Ok(stop)
}

/// Calls the handler at every signal that asks for an end, from a thread of its own.
#[cfg(unix)]
fn on_signal(mut handler: impl FnMut() + Send + 'static) -> Result<(), Failure> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1};

    // SIGUSR1 is the warning of batch systems that the time of a job is nearly over.
    let mut signals = vec![SIGINT, SIGTERM, SIGUSR1];
    // Under `nohup` a closed terminal is to end nothing.
    if !hangup_is_ignored() {
        signals.push(SIGHUP);
    }
    let mut signals = signal_hook::iterator::Signals::new(signals)?;
    std::thread::spawn(move || signals.forever().for_each(|_| handler()));
    Ok(())
}

#[cfg(not(unix))]
fn on_signal(handler: impl FnMut() + Send + 'static) -> Result<(), Failure> {
    Ok(ctrlc::set_handler(handler)?)
}

/// Whether the process was started to ignore the end of its terminal, where the system tells: on Linux.
#[cfg(unix)]
fn hangup_is_ignored() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status
        .lines()
        .find_map(|line| line.strip_prefix("SigIgn:"))
        .and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    let bit = 1 << (signal_hook::consts::SIGHUP - 1);
    mask.is_some_and(|mask| mask & bit != 0)
}
