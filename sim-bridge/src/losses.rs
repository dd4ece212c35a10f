//! What a line to a controller lost.

use std::fmt;

/// What was lost on a serial line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Losses {
    /// Requests that were sent again since no answer came.
    pub resent: u64,
    /// Damaged frames that the host dropped.
    pub damaged_here: u64,
    /// Damaged frames that the board had dropped when the conversation began.
    pub damaged_there_before: u64,
}

impl Losses {
    /// The form that stands in `--json`.
    #[must_use]
    pub fn to_json(self) -> serde_json::Value {
        serde_json::json!({
            "resent": self.resent,
            "damaged_here": self.damaged_here,
            "damaged_there_before": self.damaged_there_before,
        })
    }
}

impl fmt::Display for Losses {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "serial line    {} requests sent again, {} damaged frames dropped",
            self.resent, self.damaged_here
        )
    }
}
