//! Measures what a policy needs on a microcontroller. The tool builds the firmware and inspects it. If the board has an
//! emulator, the tool also runs the firmware there.
//!
//! The emulator counts processor instructions. These counts are neither cycles nor time.

mod board;
mod costs;
mod deadline;
mod firmware;
mod pack;
mod share;
mod stack;

pub use board::{Board, Emulation, boards};
pub use costs::{Costs, OperationCost};
pub use deadline::{CYCLES_PER_INSTRUCTION, Clock, Deadline};
pub use firmware::{Firmware, FootprintError, Measured, Profile, Seen};
pub use pack::pack;
pub use share::{ProgramShare, TeamShare, shares};
pub use stack::StackError;
