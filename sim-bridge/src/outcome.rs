//! How a plant's run ends: with a report and latencies, or with a status.

use std::fmt;
use std::io::{self, Write as _};

use tpg_tasks::exit_status::{Failure, Status};
use tpg_tasks::score::Report;

use crate::error::BridgeError;
use crate::timing::{Latency, Timing};
use crate::transport::Losses;

/// The result of a loop.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// What the episodes came to, as `tpg eval` reports it.
    pub report: Report,
    /// How long decisions took.
    pub latency: Latency,
    /// How it kept to real time, if it had to.
    pub timing: Option<Timing>,
    /// What was lost on the serial line, if there was one.
    pub losses: Option<Losses>,
}

impl Outcome {
    /// Prints the outcome to standard output, as one JSON object or for people.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn print(&self, json: bool) -> Result<(), Failure> {
        let mut out = io::stdout().lock();
        if json {
            let mut object = serde_json::to_value(&self.report)?;
            object["latency"] = self.latency.to_json();
            if let Some(timing) = self.timing {
                object["realtime"] = timing.to_json();
            }
            if let Some(losses) = self.losses {
                object["serial"] = losses.to_json();
            }
            writeln!(out, "{object}")?;
        } else {
            writeln!(out, "{self}")?;
        }
        Ok(())
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}\n{}", self.report, self.latency)?;
        self.timing
            .map_or(Ok(()), |timing| write!(f, "\n{timing}"))?;
        self.losses.map_or(Ok(()), |losses| write!(f, "\n{losses}"))
    }
}

/// The status of a command that ends with this error.
#[must_use]
pub fn status(error: &BridgeError) -> Status {
    status_of_code(error.status())
}

/// The error as a command's failure.
#[must_use]
pub fn failure(error: BridgeError) -> Failure {
    Failure::new(status(&error), error)
}

/// What the exit status of one of the bridge's programs stands for; a panic's is our fault.
pub(crate) fn status_of_code(code: u8) -> Status {
    let known = [
        Status::Usage,
        Status::BadInput,
        Status::Peer,
        Status::Interrupted,
    ];
    let named = known.into_iter().find(|status| *status as u8 == code);
    named.unwrap_or(Status::OurFault)
}
