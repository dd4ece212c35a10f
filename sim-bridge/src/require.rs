//! Requirements on a loop, such as `mean >= 3000` or `p99 < 2ms`, and whether they hold.

mod quantity;

use std::cmp::Ordering;
use std::fmt;
use std::str::FromStr;

use serde_json::{Value, json};
use tpg_tasks::score::Report;

use crate::losses::Losses;
use crate::timing::{Latency, Timing};
pub use quantity::Needs;
use quantity::{Dimension, QUANTITIES, Quantity};

/// What a requirement can be about.
#[derive(Debug, Clone, Copy)]
pub struct Facts<'a> {
    /// The result of the episodes.
    pub report: &'a Report,
    /// How long decisions took.
    pub latency: &'a Latency,
    /// How the loop kept to real time.
    pub timing: Option<&'a Timing>,
    /// What was lost on the line to a board.
    pub losses: Option<&'a Losses>,
}

/// How a quantity and its bound have to compare.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Relation {
    Less,
    AtMost,
    Equal,
    Different,
    AtLeast,
    Greater,
}

/// The relations as they are written.
const RELATIONS: [(&str, Relation); 6] = [
    ("<", Relation::Less),
    ("<=", Relation::AtMost),
    ("==", Relation::Equal),
    ("!=", Relation::Different),
    (">=", Relation::AtLeast),
    (">", Relation::Greater),
];

impl Relation {
    /// Nothing holds of what cannot be compared.
    fn holds(self, value: f64, bound: f64) -> bool {
        let Some(order) = value.partial_cmp(&bound) else {
            return false;
        };
        match self {
            Relation::Less => order == Ordering::Less,
            Relation::AtMost => order != Ordering::Greater,
            Relation::Equal => order == Ordering::Equal,
            Relation::Different => order != Ordering::Equal,
            Relation::AtLeast => order != Ordering::Less,
            Relation::Greater => order == Ordering::Greater,
        }
    }
}

/// A quantity of a loop, a relation and a bound.
#[derive(Debug, Clone)]
pub struct Requirement {
    quantity: &'static Quantity,
    relation: Relation,
    /// In the unit in which the quantity is measured.
    bound: f64,
    text: String,
}

/// A requirement and what came of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Checked {
    /// The requirement as it was written.
    pub text: String,
    /// Name of its quantity.
    pub quantity: &'static str,
    /// The value as text, with its unit.
    pub value_text: String,
    /// The value: times in nanoseconds, shares as a fraction.
    pub value: f64,
    /// Whether the requirement holds.
    pub met: bool,
}

/// Why a text is no requirement.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RequirementError {
    /// There is no relation in it.
    #[error(
        "{0:?} compares nothing: write QUANTITY RELATION NUMBER with <, <=, ==, !=, >= or >, such as 'mean >= 3000'"
    )]
    Relation(String),
    /// There is no such quantity.
    #[error("there is no quantity {name:?}; these are known: {}", quantity::list())]
    Quantity {
        /// The name.
        name: String,
    },
    /// The bound is no number.
    #[error("{bound:?} is no bound of {name}: write a number{}", .unit.advice())]
    Bound {
        /// The quantity.
        name: &'static str,
        /// What stands there.
        bound: String,
        /// How the quantity is measured.
        unit: Dimension,
    },
}

impl FromStr for Requirement {
    type Err = RequirementError;

    fn from_str(text: &str) -> Result<Self, RequirementError> {
        let text = text.trim();
        let none = || RequirementError::Relation(text.to_owned());
        let is_relation = |c: char| matches!(c, '<' | '>' | '=' | '!');
        let start = text.find(is_relation).ok_or_else(none)?;
        let (name, rest) = text.split_at(start);
        let end = rest.find(|c| !is_relation(c)).unwrap_or(rest.len());
        let (sign, bound) = rest.split_at(end);
        let relation = RELATIONS.iter().find(|(text, _)| *text == sign);
        let (_, relation) = relation.ok_or_else(none)?;
        let (name, bound) = (name.trim(), bound.trim());
        let quantity = QUANTITIES.iter().find(|quantity| quantity.name == name);
        let quantity = quantity.ok_or_else(|| RequirementError::Quantity {
            name: name.to_owned(),
        })?;
        let value = quantity.dimension.parse(bound);
        Ok(Requirement {
            quantity,
            relation: *relation,
            bound: value.ok_or_else(|| RequirementError::Bound {
                name: quantity.name,
                bound: bound.to_owned(),
                unit: quantity.dimension,
            })?,
            text: text.to_owned(),
        })
    }
}

impl fmt::Display for Requirement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl Requirement {
    /// What the loop must be for the quantity to exist.
    #[must_use]
    pub const fn needs(&self) -> Needs {
        self.quantity.needs
    }

    /// Compares; a quantity that this loop does not have fails.
    #[must_use]
    pub fn check(&self, facts: &Facts<'_>) -> Checked {
        let value = (self.quantity.of)(facts).unwrap_or(f64::NAN);
        Checked {
            text: self.text.clone(),
            quantity: self.quantity.name,
            value_text: self.quantity.dimension.show(value),
            value,
            met: self.relation.holds(value, self.bound),
        }
    }
}

impl Checked {
    /// The form that stands in `--json`.
    #[must_use]
    pub fn to_json(&self) -> Value {
        json!({
            "requirement": self.text,
            "quantity": self.quantity,
            "value": self.value,
            "value_text": self.value_text,
            "met": self.met,
        })
    }
}

impl fmt::Display for Checked {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = if self.met { "met" } else { "NOT MET" };
        let Checked {
            text,
            quantity,
            value_text,
            ..
        } = self;
        write!(
            f,
            "requirement    {text}: {verdict}, {quantity} is {value_text}"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Requirement {
        text.parse()
            .unwrap_or_else(|error| panic!("{text}: {error}"))
    }

    fn error(text: &str) -> String {
        text.parse::<Requirement>().expect_err(text).to_string()
    }

    #[test]
    fn bounds_have_units() {
        for (text, bound) in [
            ("mean >= 3000", 3000.0_f64),
            ("mean>=-1.5e3", -1500.0),
            ("misses == 0", 0.0),
            ("p99 < 2ms", 2e6),
            ("p99 < 2 ms", 2e6),
            ("jitter-max <= 250us", 250e3),
            ("latency-max < 0.5s", 0.5e9),
            ("p50 != 70ns", 70.0),
            ("miss-rate <= 0.1%", 0.001),
            ("miss-rate <= 0.001", 0.001),
        ] {
            let got = parse(text).bound;
            assert_eq!(got.to_bits(), bound.to_bits(), "{text}: {got}");
        }
    }

    #[test]
    fn nonsense_is_told_with_what_is_known() {
        for (text, expected) in [
            ("mean", "\"mean\" compares nothing"),
            ("mean = 3", "compares nothing"),
            ("mean =< 3", "compares nothing"),
            ("men >= 3", "no quantity \"men\""),
            ("men >= 3", "p99 (time)"),
            (">= 3", "no quantity \"\""),
            (
                "mean >= lots",
                "\"lots\" is no bound of mean: write a number without a unit",
            ),
            ("mean >= 3ms", "without a unit"),
            ("mean >= inf", "no bound"),
            ("mean >= NaN", "no bound"),
            ("p99 < 2", "with ns, us, ms or s behind it"),
            ("p99 < 2 h", "with ns, us, ms or s behind it"),
            ("miss-rate < 1 ms", "a share, or with % behind it"),
        ] {
            let got = error(text);
            assert!(got.contains(expected), "{text}: {got}");
        }
    }

    #[test]
    fn relations_compare_and_nothing_holds_of_nan() {
        for (_, relation) in RELATIONS {
            assert!(!relation.holds(f64::NAN, 0.0), "{relation:?}");
        }
        let of = |relation: Relation| [1.0, 2.0, 3.0].map(|value| relation.holds(value, 2.0));
        assert_eq!(of(Relation::Less), [true, false, false]);
        assert_eq!(of(Relation::AtMost), [true, true, false]);
        assert_eq!(of(Relation::Equal), [false, true, false]);
        assert_eq!(of(Relation::Different), [true, false, true]);
        assert_eq!(of(Relation::AtLeast), [false, true, true]);
        assert_eq!(of(Relation::Greater), [false, false, true]);
    }
}
