//! What one control step was like on the link, for whoever records it.

use std::time::{Duration, Instant};

use tpg_tasks::eval::{Controller, Reply};

/// Where the action of a step comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The controller answered in time.
    Answer,
    /// A miss: the last action again.
    Held,
    /// A miss: the safe action, zero within the range or index 0.
    Safe,
}

impl Source {
    /// The word that stands in recordings.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Source::Answer => "answer",
            Source::Held => "held",
            Source::Safe => "safe",
        }
    }
}

/// One control step on the link.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step {
    /// When the observation was sent.
    pub sent: Instant,
    /// From the observation sent to the action received; none on a miss.
    pub latency: Option<Duration>,
    /// Where the action comes from.
    pub source: Source,
}

/// A controller that knows what its last step was like.
pub trait Stepping: Controller {
    /// What it replied last, and what that step was like.
    ///
    /// # Errors
    /// As for [`Controller::decide`], also before the first step.
    fn last(&self) -> Result<(Reply<'_>, Step), Self::Error>;
}
