//! Disturbances of a link, as they are written on a command line.

use std::{fmt, str::FromStr};

/// Most steps of a delay.
pub const MAX_DELAY: u32 = 10_000;

/// What can happen to a frame, an observation or an action, on its way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Effect {
    /// Every frame arrives this many steps late; before the first one arrives, each step counts as a lost frame.
    Delay(u32),
    /// The frame is lost with this probability: an observation is missing then, of an action the last one is taken again.
    Loss {
        /// Dividend of the probability.
        numerator: u32,
        /// Divisor of the probability, not zero.
        denominator: u32,
    },
    /// A normal number with mean 0 and this standard deviation is added to every value.
    Noise(f64),
    /// Every value is rounded to the nearest multiple of this one, halves away from zero.
    Quantise(f64),
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
/// assert_eq!(late, Disturbance { direction: Direction::Action, effect: Effect::Delay(2) });
/// assert_eq!(late.to_string(), "action:delay:2");
/// # Ok::<(), tpg_tasks::eval::DisturbError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disturbance {
    /// What it disturbs.
    pub direction: Direction,
    /// What it does.
    pub effect: Effect,
}

/// Why a disturbance does not exist or does not fit a policy.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DisturbError {
    /// The text has none of the known forms.
    #[error(
        "no disturbance is called {0:?}; there are delay:steps, loss:a/b, noise:sd and quantise:step, each with \
         action: before it for actions"
    )]
    Unknown(String),
    /// The delay is not within its range.
    #[error(
        "{0:?} is not a delay: write a whole number of steps from 1 to {MAX_DELAY}, as in delay:2"
    )]
    NotADelay(String),
    /// The probability of a loss is not a fraction from 0 to 1.
    #[error(
        "{0:?} is not a probability from 0 to 1: write a fraction of whole numbers, as in loss:1/10"
    )]
    NotAProbability(String),
    /// The size of noise or of a step of quantisation is not positive.
    #[error("{0:?} is not a positive number, as in noise:0.01 or quantise:0.001")]
    NotPositive(String),
    /// Noise and quantisation mean nothing for the index of an action.
    #[error(
        "{0} does not fit a policy that chooses one of several actions: only delay and loss do"
    )]
    Discrete(String),
}

impl fmt::Display for Effect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Delay(steps) => write!(f, "delay:{steps}"),
            Self::Loss {
                numerator,
                denominator,
            } => write!(f, "loss:{numerator}/{denominator}"),
            Self::Noise(sd) => write!(f, "noise:{sd}"),
            Self::Quantise(step) => write!(f, "quantise:{step}"),
        }
    }
}

impl fmt::Display for Disturbance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.direction {
            Direction::Observation => write!(f, "{}", self.effect),
            Direction::Action => write!(f, "action:{}", self.effect),
        }
    }
}

impl FromStr for Disturbance {
    type Err = DisturbError;

    fn from_str(text: &str) -> Result<Self, DisturbError> {
        let (direction, rest) = match text.strip_prefix("action:") {
            Some(rest) => (Direction::Action, rest),
            None => (Direction::Observation, text),
        };
        let Some((name, value)) = rest.split_once(':') else {
            return Err(DisturbError::Unknown(text.into()));
        };
        let positive = || match value.parse::<f64>() {
            Ok(number) if number.is_finite() && number > 0.0 => Ok(number),
            _ => Err(DisturbError::NotPositive(value.into())),
        };
        let effect = match name {
            "delay" => match value.parse() {
                Ok(steps @ 1..=MAX_DELAY) => Effect::Delay(steps),
                _ => return Err(DisturbError::NotADelay(value.into())),
            },
            "loss" => loss(value).ok_or_else(|| DisturbError::NotAProbability(value.into()))?,
            "noise" => Effect::Noise(positive()?),
            "quantise" => Effect::Quantise(positive()?),
            _ => return Err(DisturbError::Unknown(text.into())),
        };
        Ok(Disturbance { direction, effect })
    }
}

fn loss(fraction: &str) -> Option<Effect> {
    let (a, b) = fraction.split_once('/')?;
    let (numerator, denominator) = (a.parse().ok()?, b.parse().ok()?);
    (denominator != 0 && numerator <= denominator).then_some(Effect::Loss {
        numerator,
        denominator,
    })
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
        ] {
            let message = text.parse::<Disturbance>().unwrap_err().to_string();
            assert!(message.contains(way_out), "{text}: {message}");
        }
    }
}
