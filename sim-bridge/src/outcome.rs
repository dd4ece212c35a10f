//! The result of a plant's run: its report and latencies.

use std::fmt;

use tpg_tasks::console::{print, print_json};
use tpg_tasks::exit_status::Failure;
use tpg_tasks::score::Report;

use crate::error::BridgeError;
use crate::junit::{Case, Verdict};
use crate::losses::Losses;
use crate::require::{Checked, Facts, Requirement};
use crate::timing::{Latency, Timing};

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
    /// What was required, and whether it holds.
    pub requirements: Vec<Checked>,
}

impl Outcome {
    /// Checks requirements.
    pub fn check(&mut self, requirements: &[Requirement]) {
        let facts = Facts {
            report: &self.report,
            latency: &self.latency,
            timing: self.timing.as_ref(),
            losses: self.losses.as_ref(),
        };
        let checked = requirements
            .iter()
            .map(|requirement| requirement.check(&facts));
        self.requirements = checked.collect();
    }

    /// Requirements that do not hold, in a line; none if all hold.
    #[must_use]
    pub fn unmet(&self) -> Option<String> {
        let unmet: Vec<&Checked> = self.requirements.iter().filter(|c| !c.met).collect();
        let text = |checked: &&Checked| format!("{} ({})", checked.text, checked.value_text);
        let list = unmet.iter().map(text).collect::<Vec<_>>().join(", ");
        let (count, all) = (unmet.len(), self.requirements.len());
        (count > 0).then(|| format!("{count} of {all} requirements do not hold: {list}"))
    }

    /// The loop and each requirement as a test case.
    #[must_use]
    pub fn cases(&self) -> Vec<Case> {
        let ran = Case {
            name: "loop".into(),
            verdict: Verdict::Passed,
        };
        let requirement = |checked: &Checked| Case {
            name: checked.text.clone(),
            verdict: match checked.met {
                true => Verdict::Passed,
                false => Verdict::Failed(format!("{} is {}", checked.quantity, checked.value_text)),
            },
        };
        let requirements = self.requirements.iter().map(requirement);
        std::iter::once(ran).chain(requirements).collect()
    }

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
            if !self.requirements.is_empty() {
                let requirements = self.requirements.iter().map(Checked::to_json);
                object["requirements"] = requirements.collect();
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
        self.losses
            .map_or(Ok(()), |losses| write!(f, "\n{losses}"))?;
        (self.requirements.iter()).try_for_each(|checked| write!(f, "\n{checked}"))
    }
}

/// The error as a command's failure.
#[must_use]
pub fn failure(error: BridgeError) -> Failure {
    Failure::new(error.status(), error)
}
