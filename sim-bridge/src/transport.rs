//! What a remote controller sends and receives through: shared memory, or a serial line.

use std::fmt;
use std::time::Duration;

use crate::error::BridgeError;
use crate::link::Link;
use crate::message::{ActionMessage, ObservationMessage};

/// The way to a controller.
pub(crate) trait Transport: fmt::Debug {
    /// Sends a request.
    fn send(&mut self, request: &ObservationMessage) -> Result<(), BridgeError>;

    /// Waits for the next answer, at most for the timeout.
    fn receive(&mut self) -> Result<ActionMessage, BridgeError>;

    /// Takes the next answer if there is one, without waiting.
    fn poll(&mut self) -> Result<Option<ActionMessage>, BridgeError>;

    /// Finds out why the controller has said nothing for a while; no error if it may go on saying nothing.
    fn look(&mut self, waited: Duration) -> Result<(), BridgeError>;

    /// What was lost and sent again, on a line where that happens.
    fn losses(&self) -> Option<Losses> {
        None
    }
}

/// What was lost on a serial line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Losses {
    /// Requests that were sent again since no answer came.
    pub resent: u64,
    /// Damaged frames that the host dropped.
    pub damaged_here: u64,
    /// Damaged frames that the board had dropped when the conversation began.
    pub damaged_there_before: u64,
}

impl Losses {
    /// The form that stands in `--json`.
    #[must_use]
    pub fn to_json(self) -> serde_json::Value {
        serde_json::json!({
            "resent": self.resent,
            "damaged_here": self.damaged_here,
            "damaged_there_before": self.damaged_there_before,
        })
    }
}

impl fmt::Display for Losses {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "serial line    {} requests sent again, {} damaged frames dropped",
            self.resent, self.damaged_here
        )
    }
}

impl Transport for Link<ObservationMessage, ActionMessage> {
    fn send(&mut self, request: &ObservationMessage) -> Result<(), BridgeError> {
        Link::send(self, request)
    }

    fn receive(&mut self) -> Result<ActionMessage, BridgeError> {
        Link::receive(self)
    }

    fn poll(&mut self) -> Result<Option<ActionMessage>, BridgeError> {
        Link::poll(self)
    }

    fn look(&mut self, waited: Duration) -> Result<(), BridgeError> {
        Link::look(self, waited)
    }
}
