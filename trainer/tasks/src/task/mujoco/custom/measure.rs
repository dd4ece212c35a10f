//! What stands in the braces of a formula: a value of the model, one of before the step, a rate, a sum over a block.

use super::arrays::Array;
use super::pairwise::pairwise;
use super::source::{Moment, Source, find};
use mujoco_rs::prelude::MjModel;
use std::ops::Range;

/// What a measure is taken of.
#[derive(Debug, Clone, Copy)]
pub(super) struct Now<'a> {
    pub moment: Moment<'a>,
    pub effort: Effort,
    /// Seconds of one control step.
    pub period: f64,
    /// Whether the step did not end the episode.
    pub alive: bool,
}

/// The sum of the squared outputs of the policy, each within -1 and 1, in f32.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Effort {
    /// Added one after the other.
    pub in_order: f32,
    /// Added as NumPy adds; from eight outputs on the bits can differ.
    pub pairwise: f32,
}

impl<'a> Now<'a> {
    /// A state between two steps.
    pub(super) fn at(moment: Moment<'a>) -> Self {
        Self {
            moment,
            effort: Effort::default(),
            period: 0.0,
            alive: true,
        }
    }
}

/// A number that a formula can name.
#[derive(Debug, Clone)]
pub(super) enum Measure {
    Value(Source),
    /// The value at the start of the control step.
    Before {
        of: Box<Measure>,
        before: f64,
    },
    /// Mean rate of change over the control step, per second.
    Rate {
        of: Box<Measure>,
        before: f64,
    },
    /// Root of the sum of the squared differences of two blocks.
    Distance {
        from: (Array, Range<usize>),
        to: (Array, Range<usize>),
    },
    /// Sum of the squares, each value first limited to plus and minus this.
    Squares {
        array: Array,
        span: Range<usize>,
        limit: f64,
    },
    Sum {
        array: Array,
        span: Range<usize>,
    },
    Outputs,
    Alive,
    #[cfg(test)]
    Constant(f64),
}

impl Measure {
    /// Finds what a text in braces stands for.
    pub(super) fn find(text: &str, model: &MjModel, goals: &[String]) -> Result<Self, String> {
        let one = |text: &str| Source::find(text.trim(), model, goals);
        let block = |text: &str| {
            let found = find(text.trim(), model, goals)?;
            found
                .span
                .ok_or_else(|| format!("source = {text:?}: it is no block of values"))
        };
        let before = 0.0;
        match text {
            "outputs" => return Ok(Self::Outputs),
            "alive" => return Ok(Self::Alive),
            _ => {}
        }
        let inner = |text: &str| {
            let of = Self::find(text.trim(), model, goals)?;
            if of.needs_step() {
                return Err(format!("{{{text}}}: it has no value before the step"));
            }
            Ok(Box::new(of))
        };
        if let Some(text) = text.strip_prefix("before:") {
            let of = inner(text)?;
            return Ok(Self::Before { of, before });
        }
        if let Some(text) = text.strip_prefix("rate:") {
            let of = inner(text)?;
            return Ok(Self::Rate { of, before });
        }
        if let Some(text) = text.strip_prefix("distance:") {
            let (from, to) = text.split_once(", ").ok_or_else(|| {
                format!("{{distance:{text}}}: needs two sources with a comma between them")
            })?;
            let whole =
                |text: &str| block(text).or_else(|_| block(&format!("{}[..]", text.trim())));
            let (from, to) = (whole(from)?, whole(to)?);
            if from.1.len() != to.1.len() {
                return Err(format!(
                    "{{distance:{text}}}: the first has {} values and the second {}",
                    from.1.len(),
                    to.1.len()
                ));
            }
            return Ok(Self::Distance { from, to });
        }
        if let Some(text) = text.strip_prefix("sum:") {
            let (array, span) = block(text)?;
            return Ok(Self::Sum { array, span });
        }
        if let Some(text) = text.strip_prefix("squares:") {
            let (text, limit) = match text.split_once(" within ") {
                None => (text, f64::INFINITY),
                Some((text, limit)) => (text, limit.trim().parse().unwrap_or(f64::NAN)),
            };
            if limit.is_nan() || limit <= 0.0 {
                return Err(format!(
                    "{{squares:{text} within ...}}: needs a number above 0"
                ));
            }
            let (array, span) = block(text)?;
            return Ok(Self::Squares { array, span, limit });
        }
        one(text).map(Self::Value)
    }

    #[cfg(test)]
    pub(super) fn constant(value: f64) -> Self {
        Self::Constant(value)
    }

    /// Keeps the value before a step where it is needed after it.
    pub(super) fn begin(&mut self, now: Now<'_>) {
        if let Self::Before { of, before } | Self::Rate { of, before } = self {
            *before = of.value(now);
        }
    }

    /// Whether the value means anything only after a step.
    pub(super) fn needs_step(&self) -> bool {
        matches!(
            self,
            Self::Before { .. } | Self::Rate { .. } | Self::Outputs | Self::Alive
        )
    }

    /// Whether it is known as soon as positions, velocities and goals are.
    pub(super) fn is_state(&self) -> bool {
        matches!(self, Self::Value(source) if source.is_state())
    }

    /// Whether it reads a sensor.
    pub(super) fn is_sensor(&self) -> bool {
        self.reads(Array::Sensor)
    }

    /// Whether it reads the contact forces, which MuJoCo computes only when it is asked to.
    pub(super) fn is_contact_force(&self) -> bool {
        self.reads(Array::ContactForce)
    }

    fn reads(&self, which: Array) -> bool {
        match self {
            Self::Value(Source::Element { array, .. })
            | Self::Squares { array, .. }
            | Self::Sum { array, .. } => *array == which,
            Self::Before { of, .. } | Self::Rate { of, .. } => of.reads(which),
            Self::Distance { from, to } => from.0 == which || to.0 == which,
            _ => false,
        }
    }

    pub(super) fn value(&self, now: Now<'_>) -> f64 {
        let block = |array: Array, span: &Range<usize>| {
            let values = array.values(now.moment.data);
            values.get(span.clone()).unwrap_or_default()
        };
        match self {
            Self::Value(source) => source.read(now.moment),
            Self::Before { before, .. } => *before,
            Self::Rate { of, before } => (of.value(now) - before) / now.period,
            Self::Distance { from, to } => {
                let (from, to) = (block(from.0, &from.1), block(to.0, &to.1));
                let differences = from.iter().zip(to).map(|(a, b)| a - b);
                // Product and sum round once together, as in the dot product behind NumPy's norm.
                differences.fold(0.0, |sum, d| d.mul_add(d, sum)).sqrt()
            }
            Self::Squares { array, span, limit } => {
                let values = block(*array, span);
                pairwise(values.len(), |i| {
                    let value = values[i].clamp(-limit, *limit);
                    value * value
                })
            }
            Self::Sum { array, span } => {
                let values = block(*array, span);
                pairwise(values.len(), |i| values[i])
            }
            Self::Outputs => f64::from(now.effort.pairwise),
            Self::Alive => f64::from(u8::from(now.alive)),
            #[cfg(test)]
            Self::Constant(value) => *value,
        }
    }
}
