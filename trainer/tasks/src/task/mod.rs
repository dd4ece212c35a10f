//! The plants that policies control: what they are, their physics, and what of them a policy may see.
//!
//! [`create`] makes a [`Task`] by name, or from a file that describes it. Gymnasium's definitions are the reference for each of them, and every task
//! takes its randomness from an [`Rng`] of its caller, so that a seed fixes an episode.
//!
//! | file | what it holds |
//! |---|---|
//! | `spec` | [`Task`], [`Spec`] and their parts |
//! | `registry` | the table of names, [`create`] |
//! | `rng` | [`Rng`], the random stream of initial states and masks |
//! | `observability` | [`Observability`]: what a policy sees, as a word |
//! | `wrappers` | [`Wrappers`]: the same at work |
//! | `cartpole`, `acrobot`, `pendulum` | [`CartPole`], [`Acrobot`], [`Pendulum`], computed here |
//! | `mujoco` | the robots simulated by MuJoCo (feature `mujoco`), a user's own among them |

mod acrobot;
mod cartpole;
#[cfg(feature = "mujoco")]
pub mod mujoco;
mod observability;
mod pendulum;
mod registry;
mod rng;
mod spec;
mod wrappers;

pub use acrobot::Acrobot;
pub use cartpole::CartPole;
pub use observability::{Observability, ObservabilityError, parse_stack, stack_text};
pub use pendulum::Pendulum;
pub use registry::{UnknownTask, create, identity, locate, names, simulator_version, sources};
pub use rng::Rng;
pub use spec::{ActionSpace, Channel, Spec, Step, Task, Terms};
pub use wrappers::Wrappers;
