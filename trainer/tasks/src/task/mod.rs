//! The plants that policies control: their specification, their physics, and which part of the state a policy sees.
//!
//! [`create`] makes a [`Task`] by name, or from a file that describes it. Gymnasium's definitions are the reference for
//! the built-in ones. Every task takes its randomness from an [`Rng`] of its caller, so that a seed fixes an episode.
//!
//! | file | what it holds |
//! |---|---|
//! | `spec` | [`Task`], [`Spec`] and their parts |
//! | `registry` | the table of names, [`create`] |
//! | `error` | [`UnknownTask`], why a task cannot be made |
//! | `rng` | [`Rng`], the random stream of initial states and masks |
//! | `observability` | [`Observability`]: what a policy sees, as a word |
//! | `wrappers` | [`Wrappers`]: applies it to observations |
//! | `scene` | [`Scene`]: what a task looks like, for drawings |
//! | `cartpole`, `acrobot`, `pendulum` | [`CartPole`], [`Acrobot`], [`Pendulum`], computed here |
//! | `families` | tasks whose names have a parameter |
//! | `memory` | tasks that cannot be solved without memory, computed here |
//! | `mujoco` | the robots simulated by MuJoCo (feature `mujoco`), a user's own among them |

mod acrobot;
mod cartpole;
mod error;
mod families;
pub mod memory;
#[cfg(feature = "mujoco")]
pub mod mujoco;
mod observability;
mod pendulum;
mod registry;
mod rng;
mod scene;
mod spec;
mod wrappers;

pub use acrobot::Acrobot;
pub use cartpole::CartPole;
pub use error::UnknownTask;
pub(crate) use observability::words_of;
pub use observability::{Observability, ObservabilityError, parse_stack, stack_text};
pub use pendulum::Pendulum;
pub use registry::{
    create, create_with, description_file, identity, is_from_file, locate, locate_in, names,
    simulator_version, sources,
};
pub use rng::Rng;
pub use scene::{Form, Mesh, Pose, Scene, Solid};
#[cfg(feature = "render")]
pub use spec::Simulation;
pub(crate) use spec::round;
pub use spec::{ActionSpace, Channel, Randomization, Spec, Step, Task, Terms};
pub use wrappers::{MISSING, Wrappers};
