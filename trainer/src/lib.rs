//! Evolves Tangled Program Graphs.
pub mod config;
pub mod evolve;
pub mod front_end;
mod keys;
pub mod lower;
pub mod pool;
pub mod run_folder;
pub mod session;
pub mod tune;
