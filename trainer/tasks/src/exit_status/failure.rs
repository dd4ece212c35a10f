//! Errors that know in which status they end a command.

use std::fmt;
use std::path::Path;

use super::Status;

/// An error with the status that the command ends in.
#[derive(Debug)]
pub struct Failure {
    /// The status; [`Status::Fine`] ends the command without a message.
    pub status: Status,
    /// What went wrong, with its causes.
    pub error: anyhow::Error,
}

impl Failure {
    /// An error of the command line or the configuration.
    pub fn usage(error: impl Into<anyhow::Error>) -> Self {
        Self::new(Status::Usage, error)
    }

    /// An error of an input file.
    pub fn bad_input(error: impl Into<anyhow::Error>) -> Self {
        Self::new(Status::BadInput, error)
    }

    /// An error of the simulator or of a peer process.
    pub fn peer(error: impl Into<anyhow::Error>) -> Self {
        Self::new(Status::Peer, error)
    }

    /// An error that knows its status.
    pub fn of<E: HasStatus + Into<anyhow::Error>>(error: E) -> Self {
        Self::new(error.status(), error)
    }

    /// An error with its status.
    pub fn new(status: Status, error: impl Into<anyhow::Error>) -> Self {
        Failure {
            status,
            error: error.into(),
        }
    }
}

/// Anything without a status of its own is our fault.
impl<E: Into<anyhow::Error>> From<E> for Failure {
    fn from(error: E) -> Self {
        Failure::new(Status::OurFault, error)
    }
}

/// An error that knows in which status it ends a command.
pub trait HasStatus {
    /// The status.
    fn status(&self) -> Status;
}

/// Gives errors the status that their origin asks for.
pub trait Fault<T> {
    /// Blames an input file.
    ///
    /// # Errors
    /// The error, with [`Status::BadInput`].
    fn or_bad_input(self, context: impl fmt::Display) -> Result<T, Failure>;

    /// Blames the command line or the configuration.
    ///
    /// # Errors
    /// The error, with [`Status::Usage`].
    fn or_usage(self, context: impl fmt::Display) -> Result<T, Failure>;

    /// Blames an output that cannot be created or written, and names its path.
    ///
    /// # Errors
    /// The error, with [`Status::Usage`].
    fn or_unwritable(self, path: impl AsRef<Path>) -> Result<T, Failure>;
}

impl<T, E: Into<anyhow::Error>> Fault<T> for Result<T, E> {
    fn or_bad_input(self, context: impl fmt::Display) -> Result<T, Failure> {
        self.map_err(|e| Failure::bad_input(e.into().context(context.to_string())))
    }

    fn or_usage(self, context: impl fmt::Display) -> Result<T, Failure> {
        self.map_err(|e| Failure::usage(e.into().context(context.to_string())))
    }

    fn or_unwritable(self, path: impl AsRef<Path>) -> Result<T, Failure> {
        self.or_usage(format_args!("cannot write {}", path.as_ref().display()))
    }
}
