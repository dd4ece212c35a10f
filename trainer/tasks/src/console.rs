//! What commands print: results to standard output, everything else to standard error.

mod command;
mod note;

use std::fmt;
use std::io::{self, ErrorKind, Write as _};
use std::process::ExitCode;

use serde::Serialize;

use crate::exit_status::{Failure, Fault as _, Status};

pub use command::command_line;
pub use note::note;

/// Writes a text and a line end to standard output.
///
/// # Errors
/// A [`Failure`] if it cannot be written; its status is [`Status::Fine`] where nobody reads any more, as after `| head`.
pub fn print(text: impl fmt::Display) -> Result<(), Failure> {
    let text = format!("{text}\n");
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => {
            Err(Failure::new(Status::Fine, error))
        }
        written => written.or_unwritable("standard output"),
    }
}

/// Prints a value as one line of JSON, floats at full precision.
///
/// # Errors
/// As [`print()`]; also where the value has no form in JSON.
pub fn print_json(value: &impl Serialize) -> Result<(), Failure> {
    print(serde_json::to_string(value)?)
}

/// The text of an error that spans lines, such as a parser's, in one line.
pub fn one_line(error: impl fmt::Display) -> String {
    error.to_string().trim_end().replace('\n', "; ")
}

/// Prints a failure to standard error, with its causes, and returns the status to end with.
#[must_use]
pub fn report(failure: &Failure) -> ExitCode {
    if failure.status != Status::Fine {
        note(format_args!("error: {:#}", failure.error));
    }
    failure.status.into()
}
