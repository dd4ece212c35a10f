//! Why there is no configuration.

use std::fmt;

/// Why there is no configuration.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// No preset has this name.
    #[error("no preset is called {name:?}; did you mean {suggestion:?}? `tpg presets` lists all")]
    UnknownPreset {
        /// The name that was given.
        name: String,
        /// The nearest name that exists.
        suggestion: String,
    },
    /// No such key.
    #[error("no key is called {key:?}; did you mean {suggestion:?}?")]
    UnknownKey {
        /// The key that was given.
        key: String,
        /// The nearest key that exists.
        suggestion: String,
    },
    /// A `--set` without `=`.
    #[error("{text:?} is no key=value, such as evolution.population=200")]
    NotAnAssignment {
        /// What was given.
        text: String,
    },
    /// A file is no TOML, or a table lacks a key.
    #[error("{0}")]
    Toml(String),
    /// A value is of the wrong type, outside of its bounds, or makes no sense with the other settings.
    #[error("{key} = {value}: {why}")]
    Value {
        /// The key, with those of the tables around it.
        key: String,
        /// Its value.
        value: String,
        /// What is wrong with it, and what would be right.
        why: String,
    },
}

impl ConfigError {
    /// A value that makes no sense, as it is shown.
    pub(super) fn value(key: &str, value: impl fmt::Display, why: impl Into<String>) -> Self {
        ConfigError::Value {
            key: key.into(),
            value: value.to_string(),
            why: why.into(),
        }
    }

    /// A text that makes no sense, shown within quotes.
    pub(super) fn text(key: &str, text: &str, why: impl Into<String>) -> Self {
        Self::value(key, format_args!("{text:?}"), why)
    }
}

impl From<toml::de::Error> for ConfigError {
    fn from(error: toml::de::Error) -> Self {
        ConfigError::Toml(tpg_tasks::console::one_line(&error))
    }
}
