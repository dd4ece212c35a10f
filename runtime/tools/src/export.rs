//! Policies as source code: a module in Rust or in C that decides as the interpreter does, bit for bit.
//!
//! The text of an instruction follows from the form and the function that the instruction table states
//! ([`Op::form`](tpg_runtime::isa::Op::form), [`Op::function`](tpg_runtime::isa::Op::function)). Rust calls
//! [`tpg_runtime::math`]; C has the arithmetic inline and calls the runtime's library for everything transcendental.

mod c;
mod decision;
mod plan;
mod program;
mod reset;
mod rust;
mod text;
mod values;

pub use c::{CSource, c};
pub use rust::rust;
