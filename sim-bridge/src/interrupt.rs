//! Ctrl-C and termination requests: a flag that every wait looks at.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::BridgeError;

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Turns the signals into the flag, from now on, in this process.
///
/// iceoryx2 puts handlers of its own in place when it first needs one: a process that joins a loop calls
/// this after [`Link::open`](crate::Link::open), which has it do so.
///
/// # Errors
/// [`BridgeError::Signals`] with what the system said.
pub fn install() -> Result<(), BridgeError> {
    Ok(ctrlc::set_handler(|| {
        REQUESTED.store(true, Ordering::Relaxed);
    })?)
}

/// Whether the user asked to stop.
#[must_use]
pub fn requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}
