//! Front ends that a run learns from what its policies saw: scaling, and a model for what is missing of them.
//!
//! ```text
//! Recorded (around each agent) --Recording--> Learner --LearnedFrontEnd, for the next generation--> lowering
//! ```
//!
//! Only what policies see is recorded. Recordings are taken in by individual, episode and step, so that the result does not
//! depend on the number of threads.

mod choose;
mod fit;
mod learned;
mod learner;
mod moments;
mod params;
mod record;

pub use learned::LearnedFrontEnd;
pub use learner::Learner;
pub use moments::Moments;
pub use params::{Columns, FrontEndFallback, FrontEndParams, Others};
pub use record::{Recorded, Recorder, Recording, action_variables};
