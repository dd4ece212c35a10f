//! Which part of an observation a policy sees.

use std::{fmt, str::FromStr};

/// One way of hiding a part of the observation.
///
/// # Examples
/// ```
/// use tpg_tasks::task::Observability;
/// let blackout: Observability = "blackout:2/3".parse()?;
/// assert_eq!(blackout, Observability::Blackout { numerator: 2, denominator: 3 });
/// assert_eq!(blackout.to_string(), "blackout:2/3");
/// # Ok::<(), tpg_tasks::task::ObservabilityError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Observability {
    /// Hides nothing.
    None,
    /// Leaves out the channels that are velocities (T §2.4.1).
    VelocitiesRemoved,
    /// Makes the whole vector missing in each step, the first too, with this probability (T §3.5.4).
    Blackout {
        /// Dividend of the probability.
        numerator: u32,
        /// Divisor of the probability, not zero.
        denominator: u32,
    },
}

/// Why an observability does not exist or does not fit a task.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ObservabilityError {
    /// The text has none of the known forms.
    #[error(
        "no observability is called {0:?}; there are none, velocities-removed and blackout:a/b, joined by +"
    )]
    Unknown(String),
    /// The probability of a blackout is not a fraction of whole numbers.
    #[error(
        "{0:?} is not a fraction of whole numbers: write a blackout's probability as in blackout:2/3"
    )]
    NotAFraction(String),
    /// The probability of a blackout is not within 0 and 1.
    #[error("a blackout's probability lies within 0 and 1, {numerator}/{denominator} does not")]
    NotAProbability {
        /// Dividend of the fraction.
        numerator: u32,
        /// Divisor of the fraction.
        denominator: u32,
    },
    /// Removing the velocities would change nothing, or leave nothing.
    #[error("velocities-removed does not fit {task}: it would leave {left} of {inputs} inputs")]
    NothingToRemove {
        /// Full name of the task.
        task: String,
        /// Inputs that would remain.
        left: usize,
        /// Inputs that there are, after the wrappers before this one.
        inputs: usize,
    },
}

impl fmt::Display for Observability {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.write_str("none"),
            Self::VelocitiesRemoved => f.write_str("velocities-removed"),
            Self::Blackout {
                numerator,
                denominator,
            } => write!(f, "blackout:{numerator}/{denominator}"),
        }
    }
}

impl FromStr for Observability {
    type Err = ObservabilityError;

    /// Reads the form that `Display` writes; a fraction is reduced, so that equal probabilities are equal values.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "none" => return Ok(Self::None),
            "velocities-removed" => return Ok(Self::VelocitiesRemoved),
            _ => {}
        }
        let fraction = text
            .strip_prefix("blackout:")
            .ok_or_else(|| ObservabilityError::Unknown(text.into()))?;
        let (numerator, denominator) = fraction
            .split_once('/')
            .and_then(|(a, b)| Some((a.parse::<u32>().ok()?, b.parse::<u32>().ok()?)))
            .ok_or_else(|| ObservabilityError::NotAFraction(fraction.into()))?;
        threshold(numerator, denominator)?;
        let divisor = greatest_common_divisor(numerator, denominator);
        Ok(Self::Blackout {
            numerator: numerator / divisor,
            denominator: denominator / divisor,
        })
    }
}

fn greatest_common_divisor(a: u32, b: u32) -> u32 {
    if b == 0 {
        a
    } else {
        greatest_common_divisor(b, a % b)
    }
}

/// How many of the 64-bit words stand for an event of this probability: ⌊2⁶⁴ · numerator / denominator⌋.
pub(crate) fn words_of(numerator: u32, denominator: u32) -> u128 {
    (u128::from(numerator) << 64) / u128::from(denominator.max(1))
}

/// The words that stand for a blackout; refuses what is no probability.
pub(super) fn threshold(numerator: u32, denominator: u32) -> Result<u128, ObservabilityError> {
    if denominator == 0 || numerator > denominator {
        return Err(ObservabilityError::NotAProbability {
            numerator,
            denominator,
        });
    }
    Ok(words_of(numerator, denominator))
}

/// Reads a stack of observabilities: their texts joined by `+`, the first one applied first.
///
/// # Errors
/// Those of the first part that is not one of them.
pub fn parse_stack(text: &str) -> Result<Vec<Observability>, ObservabilityError> {
    let mut list = text
        .split('+')
        .map(str::parse)
        .collect::<Result<Vec<_>, _>>()?;
    list.retain(|part| *part != Observability::None);
    Ok(list)
}

/// Writes a stack of observabilities in its canonical form, `none` if it hides nothing.
#[must_use]
pub fn stack_text(list: &[Observability]) -> String {
    let parts: Vec<_> = list
        .iter()
        .filter(|part| **part != Observability::None)
        .map(ToString::to_string)
        .collect();
    if parts.is_empty() {
        Observability::None.to_string()
    } else {
        parts.join("+")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_read_and_written() {
        for text in [
            "none",
            "velocities-removed",
            "blackout:2/3",
            "velocities-removed+blackout:1/3",
        ] {
            assert_eq!(stack_text(&parse_stack(text).unwrap()), text);
        }
        assert_eq!(
            stack_text(&parse_stack("none+blackout:4/6+none").unwrap()),
            "blackout:2/3"
        );
        assert_eq!(
            stack_text(&parse_stack("blackout:0/7").unwrap()),
            "blackout:0/1"
        );
    }

    #[test]
    fn errors_name_the_text_and_the_way_out() {
        let message = |text: &str| parse_stack(text).unwrap_err().to_string();
        assert!(
            message("fog").starts_with(
                "no observability is called \"fog\"; there are none, velocities-removed"
            )
        );
        for text in [
            "blackout:0.5",
            "blackout:",
            "blackout:-1/3",
            "blackout:1/2/3",
        ] {
            assert!(message(text).contains("as in blackout:2/3"), "{text}");
        }
        assert_eq!(
            message("blackout:4/3"),
            "a blackout's probability lies within 0 and 1, 4/3 does not"
        );
        assert_eq!(
            message("blackout:0/0"),
            "a blackout's probability lies within 0 and 1, 0/0 does not"
        );
    }
}
