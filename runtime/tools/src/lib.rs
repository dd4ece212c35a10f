//! Tools that inspect exported policies. They need neither a simulator nor the trainer.
//!
//! | module | what it produces from a policy |
//! |---|---|
//! | [`convert`](mod@convert) | the same policy in the newest version of the file format |
//! | [`cut`](mod@cut) | a smaller policy, of some of its programs |
//! | [`disassemble`] | its programs as text and its graph as a drawing |
//! | [`export`] | Rust or C source code that makes the same decisions |
//! | [`footprint`] | its flash, RAM, stack and instructions on a board |
//! | [`worst_path`](mod@worst_path) | a policy that runs every program in each decision, to measure |
//! | [`signature`] | a signed file, and the keys for it |

pub mod convert;
pub mod cut;
pub mod disassemble;
pub mod export;
pub mod footprint;
pub mod signature;
pub mod worst_path;
