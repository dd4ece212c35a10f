//! Configurations: defaults, preset, file and `--set`, in this order, into one checked value.

mod beyond;
mod front_end;
mod layers;
mod preset;
mod schema;
mod settings;

pub use layers::{ConfigError, differences, leaves, nearest, resolve};
pub use preset::{Preset, presets};
pub use schema::{Config, Curriculum, EvaluationConfig, PolicyConfig, SelectionParams};
pub use settings::Settings;
