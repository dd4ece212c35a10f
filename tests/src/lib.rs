//! Helpers of the tests that span the crates.

pub mod firmware;
pub mod fixtures;
pub mod golden;
pub mod graphs;
pub mod ops;
pub mod perception;
pub mod process;
pub mod random;
pub mod samples;

pub use tpg_test_policies::{draft, shapes};
