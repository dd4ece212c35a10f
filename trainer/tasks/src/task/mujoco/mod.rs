//! Robots simulated by MuJoCo: those that the program brings along, as Gymnasium defines them, and a user's own.
//!
//! Every robot is a file that describes it, read by the same code. The models of those that the program brings along are
//! Gymnasium's own files, which `scripts/setup` fetches and the build embeds; `scripts/parity` holds observations, rewards
//! and ends to Gymnasium's in every bit. A further one is one more file in `robots`, its name in `custom/builtin` and its row in the
//! table of names.

pub(super) mod custom;
mod scene;
mod sim;

pub use custom::Robot;

/// The folder of Gymnasium's models on the machine that built this.
pub const MODELS_DIR: &str = env!("TPG_MODELS_DIR");
