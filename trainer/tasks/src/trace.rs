//! Traces of decisions: recorded while a policy is scored, replayed to find the first decision that differs.
//!
//! A trace is a file of JSON lines; `docs/tools.md` in the repository describes them.

mod record;
mod replay;

pub use record::{Decision, Event, Header, RecordError, TeamVisit, TracingController};
pub use replay::{Difference, ReplayError, replay, replay_with};
