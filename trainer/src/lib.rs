//! Evolves Tangled Program Graphs.
#[cfg(feature = "mpi")]
pub mod cluster;
pub mod columns;
pub mod config;
pub mod evaluator;
pub mod evolve;
pub mod files;
pub mod front_end;
mod keys;
pub mod lower;
pub mod made_with;
pub mod monitor;
pub mod pool;
pub mod report_page;
pub mod run_folder;
pub mod session;
pub mod tensorboard;
pub mod tune;
