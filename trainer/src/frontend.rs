//! Front ends that a run learns from what its policies saw: scaling, and a model for the steps at which they were blind.
//!
//! ```text
//! Recorded (around each agent) --Recording--> Learner --Perception, for the next generation--> lowering
//! ```
//!
//! Only what policies see is recorded, in the order of individual, episode and step, so that any number of threads learns the
//! same bits.

mod choose;
mod fit;
mod learner;
mod moments;
mod params;
mod perception;
mod record;

pub use learner::Learner;
pub use moments::Moments;
pub use params::{Belief, Columns, FrontEndParams, Others};
pub use perception::Perception;
pub use record::{Recorded, Recorder, Recording, action_variables};
