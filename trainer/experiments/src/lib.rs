//! Experiments: the same comparison of variants over tasks and seeds, run and written down so that it can be repeated.

pub mod cell;
pub mod error;
pub mod file;
pub mod folder;
mod locate;
pub mod report;
pub mod row;
pub mod score;
