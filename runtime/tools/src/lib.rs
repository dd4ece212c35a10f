//! Looks into exported policies, without a simulator and without the trainer.
//!
//! | module | what it makes of a policy |
//! |---|---|
//! | [`disassemble`] | text of its programs, a drawing of its graph |
//! | [`export`] | source code in Rust or C that decides alike |
//! | [`footprint`] | flash, RAM, stack and instructions on a board |

pub mod disassemble;
pub mod export;
pub mod footprint;
