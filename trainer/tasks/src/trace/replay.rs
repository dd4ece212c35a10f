//! Re-executes a trace through the runtime.

use std::io::{self, BufRead};

use serde_json::Value;
use tpg_runtime::{HostAgent, Reset};

use super::record::{Decision, Event, Header, VERSION, decide, digest, float};

/// The first decision that came out differently.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "episode {episode}, step {step} (line {line}): {field} was recorded as {recorded}, is {replayed} now"
)]
pub struct Difference {
    /// Line of the trace, from 1.
    pub line: u64,
    /// Number of the episode, from 0.
    pub episode: u32,
    /// Number of the step in the episode, from 0.
    pub step: u32,
    /// Which part of the decision, such as `path[1].programs[0].bid`.
    pub field: String,
    /// What the trace says, as JSON.
    pub recorded: String,
    /// What the policy did now, as JSON.
    pub replayed: String,
}

/// Why a trace cannot be replayed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// The file cannot be read.
    #[error("line {line} cannot be read")]
    Read {
        /// Line of the trace, from 1.
        line: u64,
        /// Why.
        source: io::Error,
    },
    /// A line does not have the form of a trace.
    #[error("line {line} is not a line of a trace: {reason}")]
    Malformed {
        /// Line of the trace, from 1.
        line: u64,
        /// What is wrong with it.
        reason: String,
    },
    /// The last line is missing.
    #[error(
        "the trace is truncated after line {line}: its last line should say how many decisions it has"
    )]
    Truncated {
        /// The last line that there is.
        line: u64,
    },
    /// The trace is of another policy.
    #[error(
        "the trace was recorded from another policy, with SHA-256 {recorded}; this one has {given}"
    )]
    OtherPolicy {
        /// Hash in the trace.
        recorded: String,
        /// Hash of the policy given.
        given: String,
    },
}

/// Replays a trace with a freshly made agent of the policy in `bytes`; the number of decisions that agree.
///
/// # Errors
/// A [`ReplayError`] where the trace is bad; within `Ok`, the first [`Difference`].
pub fn replay(
    trace: impl BufRead,
    bytes: &[u8],
    agent: &mut HostAgent<'_>,
) -> Result<Result<u64, Difference>, ReplayError> {
    replay_with(trace, bytes, agent, |_| ())
}

/// Replays a trace as [`replay`] does, and shows each decision that agrees.
///
/// # Errors
/// As [`replay`].
pub fn replay_with(
    trace: impl BufRead,
    bytes: &[u8],
    agent: &mut HostAgent<'_>,
    mut show: impl FnMut(&Decision),
) -> Result<Result<u64, Difference>, ReplayError> {
    let (mut line, mut agreeing, mut place) = (0, 0, None);
    for text in trace.lines() {
        line += 1;
        let bad = |reason: &str| ReplayError::Malformed {
            line,
            reason: reason.to_owned(),
        };
        let text = text.map_err(|source| ReplayError::Read { line, source })?;
        let parsed = serde_json::from_str(&text).map_err(|error| {
            // Every line is a text of its own, so the parser's line number would mislead.
            bad(&error
                .to_string()
                .replace(" at line 1 column ", " at column "))
        })?;
        match (parsed, line) {
            (Event::Header(header), 1) => check(&header, bytes).map_err(|fault| match fault {
                Some(other) => other,
                None => bad("its form is of another version"),
            })?,
            (_, 1) => return Err(bad("the first is not a header")),
            (Event::Header(_), _) => return Err(bad("a second header")),
            (
                Event::Reset {
                    episode,
                    agent: first,
                    seed,
                },
                _,
            ) => {
                agent.reset(if first { Reset::Agent } else { Reset::Episode }, seed);
                place = Some((episode, 0));
            }
            (Event::Decision(recorded), _) => {
                if place != Some((recorded.episode, recorded.step)) {
                    return Err(bad("episode and step do not follow the line before"));
                }
                place = Some((recorded.episode, recorded.step + 1));
                let observation: Option<Vec<f32>> = recorded
                    .observation
                    .iter()
                    .map(|text| float(text))
                    .collect();
                let observation = observation
                    .ok_or_else(|| bad("an observation is not eight hexadecimal digits"))?;
                let (replayed, _) = decide(agent, &observation, recorded.episode, recorded.step)
                    .map_err(|error| bad(&error.to_string()))?;
                if let Some(difference) = compare(line, &recorded, &replayed) {
                    return Ok(Err(difference));
                }
                agreeing += 1;
                show(&replayed);
            }
            (Event::End { decisions }, _) if decisions == agreeing => return Ok(Ok(agreeing)),
            (Event::End { .. }, _) => return Err(bad("it counts other decisions than there are")),
        }
    }
    Err(ReplayError::Truncated { line })
}

/// Refuses the header of another form (`None`) or of another policy.
fn check(header: &Header, bytes: &[u8]) -> Result<(), Option<ReplayError>> {
    if header.version != VERSION {
        return Err(None);
    }
    let given = digest(bytes);
    if header.policy != given {
        return Err(Some(ReplayError::OtherPolicy {
            recorded: header.policy.clone(),
            given,
        }));
    }
    Ok(())
}

fn compare(line: u64, recorded: &Decision, replayed: &Decision) -> Option<Difference> {
    let values = [recorded, replayed].map(|decision| serde_json::to_value(decision).ok());
    let [Some(was), Some(is)] = values else {
        return None;
    };
    let (field, was, is) = first_difference("", &was, &is)?;
    Some(Difference {
        line,
        episode: recorded.episode,
        step: recorded.step,
        field,
        recorded: was.to_string(),
        replayed: is.to_string(),
    })
}

/// The first place at which two values differ, in the order in which they are stored.
fn first_difference<'v>(
    field: &str,
    was: &'v Value,
    is: &'v Value,
) -> Option<(String, &'v Value, &'v Value)> {
    match (was, is) {
        (Value::Object(was), Value::Object(is)) => was.iter().find_map(|(key, was)| {
            let field = if field.is_empty() {
                key.clone()
            } else {
                format!("{field}.{key}")
            };
            first_difference(&field, was, is.get(key).unwrap_or(&Value::Null))
        }),
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => a
            .iter()
            .zip(b)
            .enumerate()
            .find_map(|(k, (was, is))| first_difference(&format!("{field}[{k}]"), was, is)),
        _ => (was != is).then(|| (field.to_owned(), was, is)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_difference_is_named_by_its_place() {
        let was = serde_json::json!({"path": [{"bid": "00000000"}, {"bid": "3f800000"}], "action": ["1"]});
        let mut is = was.clone();
        assert_eq!(first_difference("", &was, &is), None);
        is["action"][0] = "2".into();
        is["path"][1]["bid"] = "bf800000".into();
        let (field, was, is) = first_difference("", &was, &is).expect("a difference");
        assert_eq!(field, "path[1].bid");
        assert_eq!(
            (was.as_str(), is.as_str()),
            (Some("3f800000"), Some("bf800000"))
        );
    }

    #[test]
    fn floats_are_their_bits() {
        assert_eq!(float("80000000").map(f32::to_bits), Some(0x8000_0000));
        assert_eq!(float("+3f80000"), None);
        assert_eq!(float("3f8000"), None);
    }
}
