//! How a command ends.

use std::fmt;
use std::process::ExitCode;

/// Exit statuses, part of the commands' interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Status {
    /// Done.
    Fine = 0,
    /// A defect or a failing system: our fault.
    OurFault = 1,
    /// The command line or the configuration is wrong.
    Usage = 2,
    /// An input file cannot be read or is not what it should be.
    BadInput = 3,
    /// The simulator or the other process of a loop failed.
    Peer = 4,
    /// Interrupted; a checkpoint was written.
    Interrupted = 130,
}

impl From<Status> for ExitCode {
    fn from(status: Status) -> Self {
        ExitCode::from(status as u8)
    }
}

/// An error with the status that the command ends in.
#[derive(Debug)]
pub struct Failure {
    /// The status.
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

/// A message in one line, such as those of parsers, which have several.
#[must_use]
pub fn one_line(message: &impl ToString) -> String {
    message.to_string().trim_end().replace('\n', "; ")
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
}

impl<T, E: Into<anyhow::Error>> Fault<T> for Result<T, E> {
    fn or_bad_input(self, context: impl fmt::Display) -> Result<T, Failure> {
        self.map_err(|e| Failure::bad_input(e.into().context(context.to_string())))
    }

    fn or_usage(self, context: impl fmt::Display) -> Result<T, Failure> {
        self.map_err(|e| Failure::usage(e.into().context(context.to_string())))
    }
}

/// Anything without a status of its own is our fault.
impl<E: Into<anyhow::Error>> From<E> for Failure {
    fn from(error: E) -> Self {
        Failure::new(Status::OurFault, error)
    }
}

impl Failure {
    /// Prints the error to standard error, with its causes, and returns the status.
    #[must_use]
    pub fn report(&self) -> ExitCode {
        // A closed pipe at the other end of our output is no error of ours. Only an error without a context can be
        // that one: where a peer or a serial line went away, another error says so and has the pipe's as its source.
        let outermost = self.error.chain().next();
        let broken_pipe = outermost
            .and_then(|error| error.downcast_ref::<std::io::Error>())
            .is_some_and(|error| error.kind() == std::io::ErrorKind::BrokenPipe);
        if broken_pipe {
            return Status::Fine.into();
        }
        eprintln!("error: {:#}", self.error);
        self.status.into()
    }
}
