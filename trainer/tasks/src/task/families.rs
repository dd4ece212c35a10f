//! Families of tasks: names with a parameter, such as `tmaze:100`.

use super::Task;
use super::memory::{
    Autoencode, CountRecall, Forecast, LONGEST, LONGEST_FORECAST, Level, MOST_BITS, MemoryChain,
    PositionOnly, RepeatFirst, RepeatPrevious, TMaze,
};

/// Tasks that differ in one parameter.
pub(super) struct Family {
    /// What comes before the colon.
    pub(super) name: &'static str,
    /// Full name of the task that the name alone stands for.
    pub(super) full: &'static str,
    /// Makes the task of a level, if the family has levels.
    level: Option<fn(Level) -> Box<dyn Task>>,
    /// The tasks of numbers, if the family has any.
    number: Option<Numbers>,
}

/// The least and the greatest number, and what makes a number's task.
type Numbers = (u32, u32, fn(u32) -> Box<dyn Task>);

/// A family of levels.
macro_rules! levels {
    ($name:literal, $make:expr) => {
        Family {
            name: $name,
            full: concat!($name, ":easy-v1"),
            level: Some(|level| Box::new($make(level))),
            number: None,
        }
    };
}

/// A family of numbers.
macro_rules! numbers {
    ($name:literal, $default:literal, $min:expr, $max:expr, $make:expr) => {
        Family {
            name: $name,
            full: concat!($name, ":", $default, "-v1"),
            level: None,
            number: Some(($min, $max, |number| Box::new($make(number)))),
        }
    };
}

pub(super) static TABLE: &[Family] = &[
    numbers!("tmaze", 10, 1, LONGEST, TMaze::new),
    numbers!("noisy-tmaze", 10, 1, LONGEST, TMaze::noisy),
    numbers!("memory-len", 10, 1, LONGEST, MemoryChain::with_length),
    numbers!("memory-size", 1, 1, MOST_BITS, MemoryChain::with_bits),
    levels!("repeat-first", RepeatFirst::new),
    Family {
        number: Some((0, 50, |lag| Box::new(RepeatPrevious::with_lag(lag)))),
        ..levels!("repeat-previous", RepeatPrevious::new)
    },
    levels!("autoencode", Autoencode::new),
    levels!("count-recall", CountRecall::new),
    levels!("position-only-cartpole", PositionOnly::cartpole),
    levels!("position-only-pendulum", PositionOnly::pendulum),
    levels!("noisy-position-only-cartpole", PositionOnly::noisy_cartpole),
    levels!("noisy-position-only-pendulum", PositionOnly::noisy_pendulum),
    numbers!(
        "mackey-glass",
        50,
        1,
        LONGEST_FORECAST,
        Forecast::mackey_glass
    ),
    numbers!(
        "mackey-glass-validation",
        100,
        1,
        LONGEST_FORECAST,
        Forecast::mackey_glass_validation
    ),
    numbers!("lorenz", 50, 1, LONGEST_FORECAST, Forecast::lorenz),
    numbers!(
        "lorenz-validation",
        100,
        1,
        LONGEST_FORECAST,
        Forecast::lorenz_validation
    ),
];

/// The family that a name belongs to, and the parameter if the name has one. All versions are 1.
pub(super) fn find(name: &str) -> Option<(&'static Family, Option<&str>)> {
    let name = name.strip_suffix("-v1").unwrap_or(name);
    let (family, parameter) = match name.split_once(':') {
        Some((family, parameter)) => (family, Some(parameter)),
        None => (name, None),
    };
    let found = TABLE.iter().find(|row| row.name == family)?;
    Some((found, parameter))
}

impl Family {
    /// Makes the task of a parameter, without one the default. `None` if the family has no such task.
    pub(super) fn make(&self, parameter: Option<&str>) -> Option<Box<dyn Task>> {
        let default = || find(self.full).and_then(|(_, parameter)| parameter);
        let parameter = parameter.or_else(default)?;
        let level = Level::ALL
            .into_iter()
            .find(|level| level.name() == parameter);
        if let (Some(make), Some(level)) = (self.level, level) {
            return Some(make(level));
        }
        let (min, max, make) = self.number?;
        let number: u32 = parameter.parse().ok()?;
        // A task has one name: no sign and no leading zero.
        let canonical = number.to_string() == parameter;
        (canonical && (min..=max).contains(&number)).then(|| make(number))
    }

    /// The names that tasks of the family can have.
    pub(super) fn wanted(&self) -> String {
        let name = self.name;
        let [easy, medium, hard] = Level::ALL.map(|level| format!("{name}:{}", level.name()));
        match (self.level, self.number) {
            (Some(_), Some((min, max, _))) => {
                format!("{easy}, {medium}, {hard} or {name}:NUMBER, from {min} to {max}")
            }
            (None, Some((min, max, _))) => format!("{name}:NUMBER, from {min} to {max}"),
            _ => format!("{easy}, {medium} or {hard}"),
        }
    }
}
