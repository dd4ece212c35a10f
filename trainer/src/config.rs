//! Configurations: defaults, preset, file and `--set`, in this order, into one checked value.

mod checks;
mod documented;
mod error;
mod front_end;
mod layers;
mod preset;
mod schema;
mod settings;
#[cfg(test)]
mod tests;

pub use crate::keys::nearest;
pub use documented::documented;
pub use error::ConfigError;
pub use layers::{default_table, differences, leaves, resolve};
pub use preset::{Preset, presets};
pub use schema::{Config, Curriculum, EvaluationConfig, PolicyConfig, Resets, SelectionParams};
pub use settings::Settings;
