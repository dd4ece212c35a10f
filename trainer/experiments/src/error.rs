//! What is wrong with an experiment's file, and the nearest that would be right.

use std::fmt;

use tpg_trainer::config::{ConfigError, nearest};

/// What is wrong with an experiment's file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExperimentError {
    /// An unknown key, a value of the wrong type, or a configuration that makes no sense.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A run's configuration makes no sense.
    #[error("{preset} with the experiment's settings")]
    Preset {
        /// The run's preset.
        preset: String,
        /// What is wrong.
        source: ConfigError,
    },
    /// No preset is for this task.
    #[error("no task of the presets is called {name:?}; did you mean {suggestion:?}?")]
    UnknownTask {
        /// The name that was given.
        name: String,
        /// The nearest task.
        suggestion: String,
    },
    /// The task has no preset of this variant.
    #[error("{task} has no variant {name:?}; did you mean {suggestion:?}? `tpg presets` lists all")]
    UnknownVariant {
        /// The task.
        task: String,
        /// The name that was given.
        name: String,
        /// The task's variant that is spelled most like it.
        suggestion: String,
    },
    /// A mistake, and where it stands.
    #[error("line {line}")]
    At {
        /// The line of the file, from 1.
        line: usize,
        /// What is wrong.
        source: Box<ExperimentError>,
    },
    /// A value makes no sense.
    #[error("{key} = {value}: {why}")]
    Value {
        /// The key.
        key: String,
        /// Its value.
        value: String,
        /// What would be right.
        why: &'static str,
    },
}

pub(crate) fn value(
    key: impl Into<String>,
    value: impl fmt::Debug,
    why: &'static str,
) -> ExperimentError {
    ExperimentError::Value {
        key: key.into(),
        value: format!("{value:?}"),
        why,
    }
}

pub(crate) fn unknown_key(key: String, candidates: &[&str]) -> ExperimentError {
    let suggestion = nearest(&key, candidates.iter().copied());
    ConfigError::UnknownKey { key, suggestion }.into()
}
