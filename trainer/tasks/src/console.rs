//! What commands print: results to standard output, everything else to standard error.

mod command;
mod note;

use std::fmt;
use std::io::{self, ErrorKind, Write as _};
use std::process::ExitCode;

use anstream::AutoStream;
use anstyle::{AnsiColor, Color, Style};
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

/// How the word `error:` looks on a terminal: as the parser of arguments writes it.
const ERROR: Style = Style::new()
    .bold()
    .fg_color(Some(Color::Ansi(AnsiColor::Red)));

/// Prints a failure to standard error, with its causes, and returns the status to end with.
///
/// The first word is coloured on a terminal, unless the environment says otherwise (`NO_COLOR`, `CLICOLOR`, `TERM=dumb`).
#[must_use]
pub fn report(failure: &Failure) -> ExitCode {
    if failure.status != Status::Fine {
        let line = format!("{ERROR}error:{ERROR:#} {:#}\n", failure.error);
        // What cannot be written is dropped, as all notes are.
        let _ = AutoStream::auto(io::stderr()).write_all(line.as_bytes());
    }
    failure.status.into()
}
