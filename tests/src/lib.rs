//! Helpers.

pub mod draft;
pub mod ops;
