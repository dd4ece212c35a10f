//! Simulator and controller as two processes in the loop, in lock-step or in real time over shared memory.
//!
//! ```text
//! tpg-hil  starts both, collects the result
//!   tpg-plant       task --observation--> Link ==iceoryx2== Link --> Agent       tpg-controller
//!   (tpg-tasks)     task <---action------ Link ==iceoryx2== Link <-- Agent       (runtime alone)
//! ```
//!
//! - `RemoteController` lets the episode loop of `tpg-tasks` drive a policy in another process; returns are those
//!   of `tpg eval` in every bit. [`Server`] is that other process.
//! - `Paced` puts it under a clock: the answer to observation k, sent at t0 + k·period, must lie in shared memory when
//!   the plant looks at t0 + (k + 1)·period; it is then what the plant does in step k, so that without misses the
//!   returns are those of lock-step in every bit. docs/bridge.md says what happens on a miss.
//! - [`Link`]: connects, checks the [`Handshake`] of both sides, carries messages with a deadline on every wait.
//! - [`message`]: what goes through shared memory.
//! - `serial`: the way to a board, or to any controller, in place of shared memory and the other process.
//! - [`listen`]: the way for any plant to a policy, in place of shared memory.
//! - [`BridgeError`]: what can go wrong, with the exit status it leads to.
//!
//! | feature | effect | default |
//! |---|---|---|
//! | `plant` | `tpg-plant`, `tpg-hil` and `tpg-update`, which need `tpg-tasks` | on |
//! | `mujoco` | tasks simulated by MuJoCo | on |

// These macros panic where the output is closed.
#![warn(clippy::print_stdout, clippy::print_stderr)]

// The controller alone builds without tpg-tasks: these two files of it need nothing but the standard library.
#[cfg(not(feature = "plant"))]
#[path = "../../trainer/tasks/src/console/note.rs"]
mod note;
#[cfg(not(feature = "plant"))]
#[path = "../../trainer/tasks/src/exit_status/status.rs"]
mod status;

mod args;
#[cfg(feature = "plant")]
pub mod bench;
mod controller;
mod conversation;
mod domain;
mod error;
mod folder;
mod handshake;
mod hash;
#[cfg(feature = "plant")]
pub mod hil;
pub mod interrupt;
#[cfg(feature = "plant")]
pub mod junit;
mod link;
mod listen;
#[cfg(feature = "plant")]
mod losses;
pub mod message;
#[cfg(feature = "plant")]
mod outcome;
mod peer;
#[cfg(feature = "plant")]
mod plant;
#[cfg(feature = "plant")]
mod realtime;
#[cfg(feature = "plant")]
pub mod record;
#[cfg(feature = "plant")]
pub mod require;
mod resources;
mod run;
#[cfg(feature = "plant")]
pub mod serial;
#[cfg(feature = "plant")]
mod step;
#[cfg(feature = "plant")]
mod timing;
#[cfg(feature = "plant")]
mod transport;
#[cfg(feature = "plant")]
pub mod update;
mod watchdog;

#[cfg(feature = "plant")]
pub use args::{BenchArgs, ControllerArgs, PaceArgs};
pub use args::{DeadlineArgs, Deadlines, LinkArgs, ProcessArgs, TimeoutArgs};
pub use controller::Server;
pub use error::BridgeError;
pub use handshake::Handshake;
pub use link::Link;
pub use listen::{ListenPlace, listen};
#[cfg(feature = "plant")]
pub use losses::Losses;
#[cfg(not(feature = "plant"))]
pub use note::note;
#[cfg(feature = "plant")]
pub use outcome::{Outcome, failure};
#[cfg(feature = "plant")]
pub use plant::RemoteController;
#[cfg(feature = "plant")]
pub use realtime::Paced;
pub use resources::{Place, Priority, ResourceArgs};
pub use run::{RunName, sweep};
#[cfg(not(feature = "plant"))]
pub use status::Status;
#[cfg(feature = "plant")]
pub use step::{Source, Step, Stepping};
#[cfg(feature = "plant")]
pub use timing::{Counts, Latency, Timing};
#[cfg(feature = "plant")]
pub use tpg_tasks::{console::note, exit_status::Status};
pub use watchdog::may_end_this_process;
