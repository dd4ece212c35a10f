//! Exports policies as source code in Rust or C, and as units for simulation tools. The code decides exactly as the
//! interpreter does, bit for bit.
//!
//! The text of an instruction comes from its form and function in the instruction table
//! ([`Op::form`](tpg_runtime::isa::Op::form), [`Op::function`](tpg_runtime::isa::Op::function)). Rust code calls
//! [`tpg_runtime::math`]. C code brings functions of its own with the same bits.

mod c;
mod decision;
mod fmu;
mod plan;
mod program;
mod reset;
mod rust;
mod text;
mod values;

pub use c::{CSource, c};
pub use fmu::Fmu;
pub use rust::rust;
