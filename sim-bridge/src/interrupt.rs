//! Requests to stop: Ctrl-C, termination, or the end of the process that started this one.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use crate::error::BridgeError;

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Turns the signals into a flag that every wait looks at, so that shared memory is cleared away in the end.
///
/// # Errors
/// [`BridgeError::Signals`] with what the system said.
pub fn install() -> Result<(), BridgeError> {
    Ok(ctrlc::set_handler(request)?)
}

/// Sets the flag when standard input closes: it does when the process at its other end ends, even if that is killed.
pub fn follow_standard_input() {
    thread::spawn(|| {
        // The input itself is ignored; only its end counts.
        let _ = io::copy(&mut io::stdin().lock(), &mut io::sink());
        request();
    });
}

/// Whether somebody asked to stop.
#[must_use]
pub fn requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}

fn request() {
    REQUESTED.store(true, Ordering::Relaxed);
}
