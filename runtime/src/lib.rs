//! Executes exported Tangled Program Graphs (TPG): no `std`, no heap, no `unsafe`.
//!
//! ```text
//! bytes --Blob::decode--> Blob --Policy::verify--> Policy --Agent::new_in--> Agent --decide--> Action
//! ```
//!
//! - [`blob`]: the file format; a [`Blob`] is a view whose checksum and lengths are right.
//! - [`Policy`]: a blob whose every table was checked, with the [`Bounds`] of one decision.
//! - [`policy!`]: types, numbers and names of a policy that is known when the program is compiled.
//! - [`Agent`]: a policy with its state, wherever that is: a [`State`] of constant capacity, a reference to one, or
//!   [`Slices`] for sizes known only when a policy arrives.
//! - [`isa`]: the instruction table, from which names, encoding and costs derive.
//! - [`math`]: what every operation computes; the only place with float arithmetic.
//! - [`front_end`]: standardises observations and fills in what is missing, where a policy has a front end.
//! - [`registers`]: where the registers of a program lie in the state.
//! - `health` (feature `trace`): compares what sensors show with what the policy's model expects.
//! - [`parts`]: what errors name: fields, tables, capacities, features.
//! - [`rng`]: seeds and random streams; [`memory`]: which of them memory writes follow.
//!
//! A champion computes the same bits on every target: `docs/semantics.md` in the repository defines them.
//!
//! | feature | effect | default |
//! |---|---|---|
//! | `all-operations` | every group of instructions below | on |
//! | `scalar`, `vector`, `matrix`, `constants`, `team-memory`, `classic`, `copies` | execute the [group](isa::Group); a policy that needs a missing one is refused | on |
//! | `write-distributions` | execute policies whose memory is written by [other distributions](blob::WriteDistribution) than the thesis's; they are refused without | on |
//! | `front-end` | execute [front ends](front_end): standardised observations, and what replaces missing elements; a policy that has one is refused without | on |
//! | `history` | execute policies whose [window](Header::history) holds earlier observations; they are refused without | on |
//! | `action-programs` | execute policies whose [outputs have programs of their own](blob::ActionKind::Each); they are refused without | on |
//! | `old-formats` | read policies of versions 1 and 2 of the file format; they are refused without | on |
//! | `small-code` | half the flash for vectors and matrices, but slower; results stay the same | off |
//! | `trace` | `Agent::decide_traced` tells an observer how a decision came about, and `health` watches sensors with it; results stay the same | off |
//! | `any-width` | compiles agents of any width once, in this crate, which programs of several crates build faster by | off |
//! | `std` | takes square roots from the standard library, which compilers turn into vectors; results stay the same | off |
//! | `lanes` | `LaneAgent`: several agents of one policy in lock-step, for hosts that simulate many episodes; results stay the same | off |
//! | `fast-checksum` | checks a blob faster, by a table of 16 KiB; results stay the same | off |
//! | `defmt` | `defmt::Format` for actions, decisions and errors | off |
//! | `serde` | `Serialize` for actions, decisions and errors, and `Deserialize` for those that borrow nothing | off |
//! | `wire` | the messages between host and board over a serial line | off |
//! | `signature` | verifies who signed a policy's file | off |
//!
//! Header, records, codes and errors are `#[non_exhaustive]`: a new field or code of the format is no breaking change.
//! Enums such as [`Action`] and [`isa::Operand`] are not: whoever handles one must handle every case.
#![no_std]
#![forbid(unsafe_code)]
#![deny(
    clippy::float_arithmetic,
    clippy::indexing_slicing,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic
)]
#![cfg_attr(
    test,
    allow(
        clippy::float_arithmetic,
        clippy::indexing_slicing,
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        reason = "tests may panic and compute"
    )
)]

#[cfg(feature = "std")]
extern crate std;

mod agent;
pub mod blob;
mod decision;
mod exec;
pub mod front_end;
pub mod hash;
#[cfg(feature = "trace")]
pub mod health;
pub mod isa;
pub mod known;
#[cfg(feature = "lanes")]
mod lane_agent;
pub mod math;
pub mod memory;
mod outputs;
pub mod parts;
pub mod registers;
pub mod rng;
#[cfg(feature = "signature")]
pub mod signature;
mod sizing;
mod state;
mod storage;
pub mod tables;
#[cfg(feature = "trace")]
pub mod trace;
#[cfg(not(feature = "trace"))]
mod trace;
mod verify;
mod width;
#[cfg(feature = "wire")]
pub mod wire;

pub use agent::{Agent, HostAgent, HostState, SliceAgent};
pub use blob::{Blob, Header};
pub use decision::{Action, Decision, ObservationError, Reset, Restore};
pub use known::{KnownAgent, LoadError};
#[cfg(feature = "lanes")]
pub use lane_agent::{LaneAgent, LaneSlices, MAX_LANE_WIDTH};
pub use sizing::{Capacities, CapacityError};
pub use storage::{Slices, State, Storage};
pub use verify::{Bounds, MAX_OUTPUTS, MAX_WIDTH, MAX_WORDS, Policy, VerifyError};
pub use width::{AnyWidth, Fixed, Width};
