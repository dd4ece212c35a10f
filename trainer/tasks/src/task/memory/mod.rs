//! Tasks that cannot be solved without memory, computed here: the same bits on every machine.
//!
//! | file | what it holds |
//! |---|---|
//! | `deck` | the shuffled cards of POPGym's tasks |
//! | `repeat` | RepeatFirst and RepeatPrevious |
//! | `autoencode`, `count_recall` | Autoencode, CountRecall |
//! | `positions` | CartPole and Pendulum without velocities, with and without noise |
//! | `forecast` | Mackey-Glass, Lorenz and series of a user's own, to be continued |
//! | `series` | how series are scaled and split |
//! | `csv_series` | columns of CSV files as series |
//! | `memory_chain` | bsuite's memory_len and memory_size |
//! | `tmaze` | the passive T-maze, with and without noise |
//!
//! POPGym: Morad et al., ICLR 2023, package `popgym` 1.0.7. bsuite: Osband et al., ICLR 2020, package `bsuite` 0.3.6. A policy
//! sees what Gymnasium's `flatten` makes of their observations: a number out of n as n elements, of which one is 1.

mod autoencode;
mod count_recall;
mod csv_series;
mod deck;
mod forecast;
mod memory_chain;
mod positions;
mod repeat;
mod series;
mod tmaze;

pub use autoencode::Autoencode;
pub use count_recall::CountRecall;
pub(super) use csv_series::CsvSeries;
pub use forecast::Forecast;
pub(super) use forecast::LONGEST_FORECAST;
pub(super) use memory_chain::MOST_BITS;
pub use memory_chain::MemoryChain;
pub use positions::PositionOnly;
pub use repeat::{RepeatFirst, RepeatPrevious};
pub(super) use tmaze::LONGEST;
pub use tmaze::TMaze;

use super::{Channel, Step, Terms};
use tpg_runtime::Action;

/// POPGym's three levels of a task.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// The shortest episodes, or the least noise.
    Easy,
    /// In between.
    Medium,
    /// The longest episodes, or the most noise.
    Hard,
}

impl Level {
    /// Every level.
    pub const ALL: [Level; 3] = [Level::Easy, Level::Medium, Level::Hard];

    /// The name used in names of tasks.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Level::Easy => "easy",
            Level::Medium => "medium",
            Level::Hard => "hard",
        }
    }

    /// The value of this level among those of all three.
    const fn pick<T: Copy>(self, [easy, medium, hard]: [T; 3]) -> T {
        match self {
            Level::Easy => easy,
            Level::Medium => medium,
            Level::Hard => hard,
        }
    }
}

/// Simulated time between two decisions of a task that knows no time, in microseconds.
const PERIOD_US: u32 = 20_000;

/// Names of the suits in the order of their numbers.
const SUITS: [&str; 4] = ["spades", "diamonds", "clubs", "hearts"];

/// A channel without a unit.
fn number(name: impl Into<String>) -> Channel {
    Channel {
        name: name.into(),
        unit: "1".into(),
        velocity: false,
        range: None,
    }
}

/// The channel of a discrete action.
fn index(name: &str) -> Channel {
    Channel {
        name: name.into(),
        unit: "index".into(),
        velocity: false,
        range: None,
    }
}

/// The index that an action names, 0 if it is of the wrong kind.
const fn chosen(action: Action<'_>) -> u16 {
    match action {
        Action::Discrete(index) => index,
        _ => 0,
    }
}

/// A step of a task without terms of the reward.
const fn step(reward: f64, terminated: bool) -> Step {
    Step {
        reward,
        terms: Terms {
            alive: 0.0,
            control: 0.0,
        },
        terminated,
        unstable: false,
    }
}

/// Writes 1 at the place of a number and 0 elsewhere.
fn one_hot(out: &mut [f32], number: usize) {
    for (k, out) in out.iter_mut().enumerate() {
        *out = f32::from(u8::from(k == number));
    }
}
