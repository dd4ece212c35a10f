//! Fuzz targets. Each takes any bytes, gives them to the code that reads such input, and panics if a promise is broken.
//!
//! The programs in `src/bin` run them under libFuzzer (`make fuzz`). A test of `tests/` runs them over the seeds and over
//! inputs that once failed.

mod policies;
mod seeds;
mod serial;
mod texts;

pub use policies::{loader, policy};
pub use seeds::{regressions, seeds, write_seeds};
pub use serial::{session, wire};
pub use texts::{checkpoint, configuration, rows, task, trace};

/// A policy of the Hopper, for targets that need one.
const BUILT_IN: &[u8] = include_bytes!("../../golden/champions/hopper-sr-sm-b23.tpg");

/// A target: it takes any bytes.
pub type Target = fn(&[u8]);

/// All targets by name.
pub const TARGETS: [(&str, Target); 9] = [
    ("loader", loader),
    ("policy", policy),
    ("wire", wire),
    ("session", session),
    ("checkpoint", checkpoint),
    ("configuration", configuration),
    ("task", task),
    ("trace", trace),
    ("rows", rows),
];
