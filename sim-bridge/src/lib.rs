//! Simulator and controller as two processes in the loop, in lock-step over shared memory.
//!
//! ```text
//! tpg-hil  starts both, collects the result
//!   tpg-plant       task --observation--> Link ==iceoryx2== Link --> Agent       tpg-controller
//!   (trainer)       task <---action------ Link ==iceoryx2== Link <-- Agent       (runtime alone)
//! ```
//!
//! - `RemoteController` lets the trainer's episode loop drive a policy in another process; returns are those
//!   of `tpg eval` in every bit. [`Server`] is that other process.
//! - [`Link`]: connects, checks the [`Contract`] of both sides, carries messages with a deadline on every wait.
//! - [`message`]: what goes through shared memory.
//! - [`BridgeError`]: what can go wrong, with the exit status it leads to.
//!
//! | feature | effect | default |
//! |---|---|---|
//! | `plant` | `tpg-plant` and `tpg-hil`, which need the trainer | on |
//! | `mujoco` | tasks simulated by MuJoCo | on |

mod args;
mod contract;
mod controller;
mod domain;
mod error;
mod hash;
#[cfg(feature = "plant")]
pub mod hil;
pub mod interrupt;
mod link;
pub mod message;
#[cfg(feature = "plant")]
mod outcome;
mod peer;
#[cfg(feature = "plant")]
mod plant;
mod run;

pub use args::{LinkArgs, TimeoutArgs};
pub use contract::Contract;
pub use controller::Server;
pub use error::BridgeError;
pub use link::Link;
#[cfg(feature = "plant")]
pub use outcome::{Outcome, failure, status};
#[cfg(feature = "plant")]
pub use plant::{Latency, RemoteController};
pub use run::{RunName, sweep};
