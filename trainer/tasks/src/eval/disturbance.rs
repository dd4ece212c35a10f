//! Disturbances of a link, as they are written on a command line.

use std::{fmt, str::FromStr};

/// Most steps of a delay.
pub const MAX_DELAY: u32 = 10_000;

/// What can happen to a frame, an observation or an action, on its way.
#[derive(Debug, Clone, PartialEq)]
pub enum Effect {
    /// Every frame arrives this many steps late; before the first one arrives, each step counts as a lost frame.
    Delay(u32),
    /// The frame is lost with this probability: an observation is missing then, of an action the last one is taken again.
    Loss(Probability),
    /// A normal number with mean 0 and this standard deviation is added to every value.
    Noise(f64),
    /// Every value is rounded to the nearest multiple of this one, halves away from zero.
    Quantise(f64),
    /// Something happens to one value of the frame. What is missing stays missing.
    Channel(Which, Fault),
}

/// A probability as a fraction of whole numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Probability {
    /// Dividend.
    pub numerator: u32,
    /// Divisor, not zero.
    pub denominator: u32,
}

/// One element of an observation, or one output of an action.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Which {
    /// Its number, from 0.
    Index(usize),
    /// Its name in the policy's labels.
    Name(String),
}

/// What can happen to one value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fault {
    /// The value does not arrive with this probability, and nobody notices: the last one that arrived is taken again.
    Drop(Probability),
    /// The value is missing with this probability. Observations only.
    Nan(Probability),
    /// The value stays what it is when this begins.
    Stuck,
    /// This number is added, in the value's unit.
    Bias(f64),
    /// A normal number with mean 0 and this standard deviation is added, in the value's unit.
    Noise(f64),
}

/// When a disturbance acts, in seconds of an episode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// When it begins.
    pub start: f64,
    /// How long it lasts.
    pub length: f64,
}

/// Which of the two directions of a link is disturbed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// From the plant to the controller.
    Observation,
    /// From the controller to the plant.
    Action,
}

/// One disturbance of a link.
///
/// # Examples
/// ```
/// use tpg_tasks::eval::{Direction, Disturbance, Effect};
/// let late: Disturbance = "action:delay:2".parse()?;
/// assert_eq!(late.direction, Direction::Action);
/// assert_eq!(late.effect, Effect::Delay(2));
/// assert_eq!(late.to_string(), "action:delay:2");
/// # Ok::<(), tpg_tasks::eval::DisturbError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Disturbance {
    /// What it disturbs.
    pub direction: Direction,
    /// What it does.
    pub effect: Effect,
    /// When it does so; the whole episode if `None`.
    pub window: Option<Window>,
}

/// Why a disturbance does not exist or does not fit a policy.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DisturbError {
    /// The text has none of the known forms.
    #[error(
        "no disturbance is called {0:?}; there are delay:steps, loss:a/b, noise:sd and quantise:step, and for one channel \
         drop:channel:a/b, nan:channel:a/b, stuck:channel, bias:channel:x and noise:channel:sd, each with action: before it \
         for actions"
    )]
    Unknown(String),
    /// The delay is not within its range.
    #[error(
        "{0:?} is not a delay: write a whole number of steps from 1 to {MAX_DELAY}, as in delay:2"
    )]
    NotADelay(String),
    /// The probability of a loss is not a fraction from 0 to 1.
    #[error(
        "{0:?} is not a probability from 0 to 1: write a fraction of whole numbers, as in loss:1/10 or \
         nan:3:1/10"
    )]
    NotAProbability(String),
    /// The size of noise or of a step of quantisation is not positive.
    #[error("{0:?} is not a positive number, as in noise:0.01 or quantise:0.001")]
    NotPositive(String),
    /// A bias is no number.
    #[error("{0:?} is not a number, as in bias:3:-0.1")]
    NotANumber(String),
    /// The times of a disturbance cannot be read.
    #[error("{0:?} does not say when: write seconds, as in \"at 2.0s stuck:3 for 0.5s\"")]
    NotATime(String),
    /// A delay of a part of an episode.
    #[error("{0} cannot begin or end within an episode: leave out `at` and `for`")]
    Untimed(String),
    /// There is no such channel.
    #[error("{text} names no channel of this policy; there are {known}")]
    NoSuchChannel {
        /// The disturbance.
        text: String,
        /// The channels, with their numbers.
        known: String,
    },
    /// An action cannot be missing.
    #[error("{0} does not fit: an action is never missing; action:drop takes the last one again")]
    MissingAction(String),
    /// Noise and quantisation mean nothing for the index of an action.
    #[error(
        "{0} does not fit a policy that chooses one of several actions: only delay and loss do"
    )]
    Discrete(String),
}

impl fmt::Display for Probability {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.numerator, self.denominator)
    }
}

impl fmt::Display for Which {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Index(index) => write!(f, "{index}"),
            Self::Name(name) => f.write_str(name),
        }
    }
}

impl fmt::Display for Effect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Delay(steps) => write!(f, "delay:{steps}"),
            Self::Loss(probability) => write!(f, "loss:{probability}"),
            Self::Noise(sd) => write!(f, "noise:{sd}"),
            Self::Quantise(step) => write!(f, "quantise:{step}"),
            Self::Channel(which, Fault::Drop(probability)) => {
                write!(f, "drop:{which}:{probability}")
            }
            Self::Channel(which, Fault::Nan(probability)) => write!(f, "nan:{which}:{probability}"),
            Self::Channel(which, Fault::Stuck) => write!(f, "stuck:{which}"),
            Self::Channel(which, Fault::Bias(x)) => write!(f, "bias:{which}:{x}"),
            Self::Channel(which, Fault::Noise(sd)) => write!(f, "noise:{which}:{sd}"),
        }
    }
}

impl fmt::Display for Disturbance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(Window { start, .. }) = self.window {
            write!(f, "at {start}s ")?;
        }
        match self.direction {
            Direction::Observation => write!(f, "{}", self.effect)?,
            Direction::Action => write!(f, "action:{}", self.effect)?,
        }
        match self.window {
            Some(Window { length, .. }) => write!(f, " for {length}s"),
            None => Ok(()),
        }
    }
}

impl FromStr for Disturbance {
    type Err = DisturbError;

    fn from_str(text: &str) -> Result<Self, DisturbError> {
        let (window, timed) = match text.strip_prefix("at ") {
            Some(rest) => {
                let (window, rest) = timed(rest).ok_or(DisturbError::NotATime(text.into()))?;
                (Some(window), rest)
            }
            None => (None, text),
        };
        let (direction, rest) = match timed.strip_prefix("action:") {
            Some(rest) => (Direction::Action, rest),
            None => (Direction::Observation, timed),
        };
        let Some((name, value)) = rest.split_once(':') else {
            return Err(DisturbError::Unknown(text.into()));
        };
        let effect = match (name, value.rsplit_once(':')) {
            ("delay", _) => match value.parse() {
                Ok(steps @ 1..=MAX_DELAY) => Effect::Delay(steps),
                _ => return Err(DisturbError::NotADelay(value.into())),
            },
            ("loss", _) => Effect::Loss(probability(value)?),
            ("noise", None) => Effect::Noise(positive(value)?),
            ("noise", Some((which, sd))) => {
                Effect::Channel(channel(which), Fault::Noise(positive(sd)?))
            }
            ("quantise", _) => Effect::Quantise(positive(value)?),
            ("drop", Some((which, p))) => {
                Effect::Channel(channel(which), Fault::Drop(probability(p)?))
            }
            ("nan", Some((which, p))) => {
                Effect::Channel(channel(which), Fault::Nan(probability(p)?))
            }
            ("bias", Some((which, x))) => Effect::Channel(channel(which), Fault::Bias(number(x)?)),
            ("stuck", _) => Effect::Channel(channel(value), Fault::Stuck),
            _ => return Err(DisturbError::Unknown(text.into())),
        };
        if matches!(effect, Effect::Delay(_)) && window.is_some() {
            return Err(DisturbError::Untimed(rest.into()));
        }
        if let (Direction::Action, Effect::Channel(_, Fault::Nan(_))) = (direction, &effect) {
            return Err(DisturbError::MissingAction(text.into()));
        }
        Ok(Disturbance {
            direction,
            effect,
            window,
        })
    }
}

/// Reads `2.0s EFFECT for 0.5s`.
fn timed(text: &str) -> Option<(Window, &str)> {
    let seconds = |text: &str| {
        let number = text.strip_suffix('s')?.parse::<f64>().ok()?;
        (number.is_finite() && number >= 0.0).then_some(number)
    };
    let (start, rest) = text.split_once(' ')?;
    let (effect, length) = rest.rsplit_once(" for ")?;
    let window = Window {
        start: seconds(start)?,
        length: seconds(length)?,
    };
    (window.length > 0.0).then_some((window, effect))
}

fn channel(text: &str) -> Which {
    match text.parse() {
        Ok(index) => Which::Index(index),
        Err(_) => Which::Name(text.into()),
    }
}

fn number(text: &str) -> Result<f64, DisturbError> {
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err(DisturbError::NotANumber(text.into())),
    }
}

fn positive(text: &str) -> Result<f64, DisturbError> {
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() && number > 0.0 => Ok(number),
        _ => Err(DisturbError::NotPositive(text.into())),
    }
}

fn probability(text: &str) -> Result<Probability, DisturbError> {
    let fraction = || {
        let (a, b) = text.split_once('/')?;
        let (numerator, denominator) = (a.parse().ok()?, b.parse().ok()?);
        (denominator != 0 && numerator <= denominator).then_some(Probability {
            numerator,
            denominator,
        })
    };
    fraction().ok_or_else(|| DisturbError::NotAProbability(text.into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_read_and_written() {
        for text in [
            "delay:2",
            "loss:1/10",
            "noise:0.01",
            "quantise:0.001",
            "action:delay:1",
            "action:loss:0/1",
            "drop:3:1/10",
            "nan:hip_angle:1/2",
            "stuck:3",
            "bias:0:-0.1",
            "noise:2:0.5",
            "action:stuck:torque",
            "at 2s stuck:3 for 0.5s",
            "at 0.25s action:loss:1/1 for 1s",
        ] {
            assert_eq!(text.parse::<Disturbance>().unwrap().to_string(), text);
        }
    }

    #[test]
    fn errors_name_the_text_and_the_way_out() {
        for (text, way_out) in [
            ("fog:1", "no disturbance is called \"fog:1\"; there are"),
            ("delay", "no disturbance is called \"delay\""),
            ("action:", "no disturbance is called \"action:\""),
            ("delay:0", "\"0\" is not a delay"),
            ("delay:10001", "from 1 to 10000"),
            ("loss:0.1", "as in loss:1/10"),
            ("loss:2/1", "\"2/1\" is not a probability"),
            ("loss:0/0", "\"0/0\" is not a probability"),
            ("noise:-1", "\"-1\" is not a positive number"),
            ("noise:inf", "\"inf\" is not a positive number"),
            ("quantise:0", "\"0\" is not a positive number"),
            ("nan:3:2/1", "as in loss:1/10 or nan:3:1/10"),
            ("drop:3", "no disturbance is called \"drop:3\""),
            ("bias:3:inf", "\"inf\" is not a number"),
            ("action:nan:0:1/2", "an action is never missing"),
            ("at 2.0 stuck:3 for 0.5s", "does not say when"),
            ("at 2.0s stuck:3", "as in \"at 2.0s stuck:3 for 0.5s\""),
            ("at 2.0s stuck:3 for 0s", "does not say when"),
            ("at 2.0s delay:3 for 1s", "delay:3 cannot begin or end"),
        ] {
            let message = text.parse::<Disturbance>().unwrap_err().to_string();
            assert!(message.contains(way_out), "{text}: {message}");
        }
    }
}
