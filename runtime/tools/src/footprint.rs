//! What a policy takes on a microcontroller: its firmware is built, looked into, and run on an emulator where there is one.
//!
//! Instructions of the processor are counted by the emulator: they are neither cycles nor time.

mod board;
mod firmware;
mod share;
mod stack;

pub use board::{Board, Emulation, boards};
pub use firmware::{Firmware, FootprintError, Measured, Profile, Seen};
pub use share::{ProgramShare, TeamShare, shares};
pub use stack::StackError;
