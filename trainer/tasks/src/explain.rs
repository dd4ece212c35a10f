//! What a policy attends to: how it does without an input, which programs act when, which memory they touch.

mod acts;
mod frozen;

pub use acts::{Explained, Explanation, InputSeen, MemoryUse, ProgramActs, When};
pub use frozen::Frozen;
