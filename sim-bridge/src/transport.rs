//! What a remote controller sends and receives through: shared memory, or a serial line.

use std::fmt;
use std::time::Duration;

use crate::error::BridgeError;
use crate::link::Link;
use crate::losses::Losses;
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
