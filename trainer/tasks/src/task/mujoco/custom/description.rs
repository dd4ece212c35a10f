//! The keys of a file that describes a task.

use std::fmt;

use super::unknown;
use crate::console::one_line;
use serde::Deserialize;
use toml::{Table, Value};

/// The keys of each part of the file; the first part is the file itself.
const KEYS: [(&str, &[&str]); 6] = [
    (
        "",
        &[
            "name",
            "model",
            "frame-skip",
            "max-steps",
            "period-us",
            "observation",
            "actuator",
            "reward",
            "termination",
            "reset",
        ],
    ),
    (
        "observation",
        &["source", "name", "unit", "velocity", "clip"],
    ),
    ("actuator", &["name", "low", "high", "unit"]),
    ("reward", &["kind", "source", "weight", "target"]),
    ("termination", &["source", "below", "above"]),
    ("reset", &["position-noise", "velocity-noise"]),
];

/// A task as its file describes it; docs/custom-tasks.md explains every key.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) struct Description {
    pub name: String,
    pub model: String,
    pub frame_skip: u32,
    pub max_steps: u32,
    pub period_us: Option<u32>,
    #[serde(default)]
    pub observation: Vec<Observation>,
    #[serde(default)]
    pub actuator: Vec<Actuator>,
    #[serde(default)]
    pub reward: Vec<Reward>,
    #[serde(default)]
    pub termination: Vec<Termination>,
    #[serde(default)]
    pub reset: Reset,
}

#[derive(Debug, Deserialize)]
pub(super) struct Observation {
    pub source: String,
    pub name: String,
    pub unit: String,
    pub velocity: Option<bool>,
    pub clip: Option<f64>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Actuator {
    pub name: String,
    pub low: Option<f64>,
    pub high: Option<f64>,
    pub unit: Option<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum RewardKind {
    Constant,
    Linear,
    Square,
    Velocity,
    ControlCost,
}

impl fmt::Display for RewardKind {
    /// As the file writes it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Constant => "constant",
            Self::Linear => "linear",
            Self::Square => "square",
            Self::Velocity => "velocity",
            Self::ControlCost => "control-cost",
        })
    }
}

#[derive(Debug, Deserialize)]
pub(super) struct Reward {
    pub kind: RewardKind,
    pub weight: f64,
    pub source: Option<String>,
    pub target: Option<f64>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Termination {
    pub source: String,
    pub below: Option<f64>,
    pub above: Option<f64>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) struct Reset {
    #[serde(default)]
    pub position_noise: f64,
    #[serde(default)]
    pub velocity_noise: f64,
}

impl Description {
    /// Reads the text of a file and checks what can be checked without the model.
    pub(super) fn read(text: &str) -> Result<Self, String> {
        let table: Table = text.parse().map_err(one_line)?;
        check_keys(&table, "")?;
        let read: Self = toml::from_str(text).map_err(one_line)?;
        read.check()?;
        Ok(read)
    }

    fn check(&self) -> Result<(), String> {
        let name = self.name.as_bytes();
        let version = self
            .name
            .rsplit_once("-v")
            .map_or("", |(_, version)| version);
        let named = name.first().is_some_and(u8::is_ascii_lowercase)
            && name
                .iter()
                .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || *c == b'-')
            && !version.is_empty()
            && version.bytes().all(|c| c.is_ascii_digit());
        if !named || name.len() > 64 {
            return Err(format!(
                "name = {:?}: a task's name is at most 64 lower-case letters, digits and hyphens, and ends in a \
                 version, such as crane-v1",
                self.name
            ));
        }
        for (key, value) in [
            ("frame-skip", self.frame_skip),
            ("max-steps", self.max_steps),
        ] {
            if value == 0 {
                return Err(format!("{key} = 0: must be at least 1"));
            }
        }
        if self.observation.is_empty() || self.actuator.is_empty() {
            return Err("at least one [[observation]] and one [[actuator]] are needed".into());
        }
        for observation in &self.observation {
            for text in [&observation.name, &observation.unit] {
                check_label(text)?;
            }
            check_width("observation.clip", observation.clip.unwrap_or(0.0))?;
        }
        for actuator in &self.actuator {
            check_label(&actuator.name)?;
            check_label(actuator.unit.as_deref().unwrap_or("1"))?;
        }
        check_width("reset.position-noise", self.reset.position_noise)?;
        check_width("reset.velocity-noise", self.reset.velocity_noise)
    }
}

/// Refuses a text that a policy's table of channels cannot hold.
fn check_label(text: &str) -> Result<(), String> {
    if text.is_empty() || text.len() > 64 || text.chars().any(char::is_control) {
        return Err(format!(
            "{text:?}: names and units are 1 to 64 bytes without tabs and line ends"
        ));
    }
    Ok(())
}

fn check_width(key: &str, value: f64) -> Result<(), String> {
    if value.is_finite() && value >= 0.0 {
        Ok(())
    } else {
        Err(format!(
            "{key} = {value}: must be a finite number, 0 or more"
        ))
    }
}

/// Refuses a value that is not finite.
pub(super) fn finite(key: &str, value: f64) -> Result<f64, String> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(format!("{key} = {value}: must be finite"))
    }
}

/// Refuses keys that do not exist; values of the wrong type are left to serde.
fn check_keys(table: &Table, part: &str) -> Result<(), String> {
    let known = KEYS
        .iter()
        .find(|(name, _)| *name == part)
        .map_or(&[][..], |(_, keys)| *keys);
    for (key, value) in table {
        if !known.contains(&key.as_str()) {
            let kind = if part.is_empty() {
                "key".to_owned()
            } else {
                format!("key of {part}")
            };
            return Err(unknown(&kind, key, known));
        }
        match value {
            Value::Table(inner) => check_keys(inner, key)?,
            Value::Array(list) => {
                for inner in list.iter().filter_map(Value::as_table) {
                    check_keys(inner, key)?;
                }
            }
            _ => {}
        }
    }
    Ok(())
}
