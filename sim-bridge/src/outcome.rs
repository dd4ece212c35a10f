//! The result of a plant's run: its report and latencies.

use std::fmt;

use tpg_tasks::console::{print, print_json};
use tpg_tasks::exit_status::Failure;
use tpg_tasks::score::Report;

use crate::error::BridgeError;
use crate::timing::{Latency, Timing};
use crate::transport::Losses;

/// The result of a loop.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The result of the episodes, as `tpg eval` reports it.
    pub report: Report,
    /// How long decisions took.
    pub latency: Latency,
    /// How it kept to real time, if it had to.
    pub timing: Option<Timing>,
    /// What was lost on the serial line, if there was one.
    pub losses: Option<Losses>,
}

impl Outcome {
    /// Prints the outcome to standard output, as one JSON object or as a table.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn print(&self, json: bool) -> Result<(), Failure> {
        if json {
            let mut object = serde_json::to_value(&self.report)?;
            object["latency"] = self.latency.to_json();
            if let Some(timing) = self.timing {
                object["realtime"] = timing.to_json();
            }
            if let Some(losses) = self.losses {
                object["serial"] = losses.to_json();
            }
            print_json(&object)
        } else {
            print(self)
        }
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

/// The error as a command's failure.
#[must_use]
pub fn failure(error: BridgeError) -> Failure {
    Failure::new(error.status(), error)
}
