//! Evolves Tangled Program Graphs.
pub mod cli;
pub mod config;
mod defaults;
pub mod disassemble;
pub mod eval;
pub mod evolve;
pub mod experiment;
pub mod export;
pub mod footprint;
pub mod frontend;
pub mod lower;
pub mod session;
pub mod stats;
pub mod task;
pub mod trace;
pub mod tune;
