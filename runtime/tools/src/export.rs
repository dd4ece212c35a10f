//! Exports policies as source code in Rust or C. The code decides exactly as the interpreter does, bit for bit.
//!
//! The text of an instruction comes from its form and function in the instruction table
//! ([`Op::form`](tpg_runtime::isa::Op::form), [`Op::function`](tpg_runtime::isa::Op::function)). Rust code calls
//! [`tpg_runtime::math`]. C code does arithmetic inline. It calls the runtime's library for transcendental functions,
//! except for the sine, cosine and tangent, which are inline too.

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
