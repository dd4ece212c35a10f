//! How a command ends: the exit statuses, and errors that carry one.

mod failure;
mod status;

pub use failure::{Failure, Fault, HasStatus};
pub use status::Status;
