//! What came of a bench: as a table, as JSON, as test suites.

use std::fmt;

use serde_json::{Value, json};
use tpg_tasks::exit_status::{Failure, Status};

use super::file::Case;
use crate::junit::{self, Suite, Verdict};

/// How a case ended.
#[derive(Debug)]
pub(super) enum End {
    /// The loop ran to its end.
    Ran {
        /// Whether all requirements hold.
        met: bool,
        /// What `tpg hil --json` printed.
        outcome: Value,
    },
    /// The loop broke off.
    Broken(Failure),
}

#[derive(Debug)]
struct Row {
    case: Case,
    end: End,
    seconds: f64,
}

/// What came of a bench.
#[derive(Debug)]
pub(super) struct Summary {
    name: String,
    rows: Vec<Row>,
}

impl Summary {
    pub(super) const fn new(name: String) -> Self {
        Summary {
            name,
            rows: Vec::new(),
        }
    }

    pub(super) fn add(&mut self, case: &Case, end: End, seconds: f64) {
        self.rows.push(Row {
            case: case.clone(),
            end,
            seconds,
        });
    }

    /// That of the first loop that broke off, else whether requirements hold.
    pub(super) fn status(&self) -> Status {
        let broken = self.rows.iter().find_map(|row| match &row.end {
            End::Broken(failure) => Some(failure.status),
            End::Ran { .. } => None,
        });
        let unmet = self.passed() < self.rows.len();
        broken.unwrap_or(if unmet { Status::Unmet } else { Status::Fine })
    }

    fn passed(&self) -> usize {
        let passed = |row: &&Row| matches!(row.end, End::Ran { met: true, .. });
        self.rows.iter().filter(passed).count()
    }

    pub(super) fn to_json(&self) -> Value {
        let case = |row: &Row| {
            let mut object = json!({
                "policy": row.case.policy,
                "scenario": row.case.scenario,
                "seconds": row.seconds,
                "result": row.word(),
            });
            match &row.end {
                End::Ran { outcome, .. } => object["outcome"] = outcome.clone(),
                End::Broken(failure) => {
                    object["error"] = format!("{:#}", failure.error).into();
                    object["status"] = failure.status.code().into();
                }
            }
            object
        };
        json!({
            "name": self.name,
            "cases": self.rows.iter().map(case).collect::<Vec<_>>(),
            "passed": self.passed(),
        })
    }

    /// One suite for each case.
    pub(super) fn suites(&self) -> Vec<Suite> {
        let suite = |row: &Row| Suite {
            name: format!("{} / {}", self.name, row.case.name),
            seconds: row.seconds,
            cases: row.cases(),
        };
        self.rows.iter().map(suite).collect()
    }
}

impl Row {
    const fn word(&self) -> &'static str {
        match self.end {
            End::Ran { met: true, .. } => "passed",
            End::Ran { met: false, .. } => "failed",
            End::Broken(_) => "error",
        }
    }

    fn cases(&self) -> Vec<junit::Case> {
        let case = |name: &str, verdict| junit::Case {
            name: name.to_owned(),
            verdict,
        };
        match &self.end {
            End::Broken(failure) => {
                vec![case(
                    "loop",
                    Verdict::Broken(format!("{:#}", failure.error)),
                )]
            }
            End::Ran { outcome, .. } => {
                let requirement = |checked: &Value| {
                    let text = |key: &str| checked[key].as_str().unwrap_or_default();
                    let verdict = match checked["met"].as_bool() {
                        Some(true) => Verdict::Passed,
                        _ => Verdict::Failed(format!(
                            "{} is {}",
                            text("quantity"),
                            text("value_text")
                        )),
                    };
                    case(text("requirement"), verdict)
                };
                let checked = outcome["requirements"].as_array().into_iter().flatten();
                std::iter::once(case("loop", Verdict::Passed))
                    .chain(checked.map(requirement))
                    .collect()
            }
        }
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "bench          {}", self.name)?;
        let width = self
            .rows
            .iter()
            .map(|row| row.case.name.chars().count())
            .max();
        let width = width.unwrap_or(0);
        for row in &self.rows {
            let word = match row.word() {
                "passed" => "passed",
                "failed" => "FAILED",
                _ => "ERROR",
            };
            write!(f, "{:width$}  {word:6}", row.case.name)?;
            match &row.end {
                End::Broken(failure) => write!(f, "  {:#}", failure.error)?,
                End::Ran { outcome, .. } => {
                    if let Some(mean) = outcome["mean"].as_f64() {
                        write!(f, "  mean {mean:.2}")?;
                    }
                    for case in row.cases() {
                        if let Verdict::Failed(message) = case.verdict {
                            write!(f, "; {}: {message}", case.name)?;
                        }
                    }
                }
            }
            writeln!(f)?;
        }
        write!(
            f,
            "result         {} of {} cases passed",
            self.passed(),
            self.rows.len()
        )
    }
}
