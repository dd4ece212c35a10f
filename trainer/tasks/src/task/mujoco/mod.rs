//! Robots simulated by MuJoCo, as Gymnasium defines them.
//!
//! The models are Gymnasium's own files, which `scripts/setup` fetches and the build embeds. `scripts/parity` holds
//! observations, rewards and ends to Gymnasium's in every bit. A further robot is one more file beside
//! [`Hopper`]'s, and its rows in the table of names.

pub(super) mod custom;
mod double_pendulum;
mod half_cheetah;
mod hopper;
mod sim;

pub use double_pendulum::DoublePendulum;
pub use half_cheetah::HalfCheetah;
pub use hopper::Hopper;

/// The folder of Gymnasium's models on the machine that built this.
pub const MODELS_DIR: &str = env!("TPG_MODELS_DIR");

/// The version of Gymnasium's environment that a task follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Version {
    /// The version that the thesis used.
    V4,
    /// Gymnasium's latest: no bonus on the step of a failure.
    V5,
}
