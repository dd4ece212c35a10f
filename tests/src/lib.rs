//! Helpers of the tests that span the crates.

pub mod browser;
pub mod firmware;
pub mod fixtures;
pub mod front_end;
pub mod golden;
pub mod graphs;
pub mod ops;
pub mod process;
pub mod random;
pub mod samples;

pub use tpg_test_policies::old_format::{crc32, mend, old_format};
pub use tpg_test_policies::{draft, shapes};
