//! The elements of the observation.

use super::description::Description;
use super::expression::Expression;
use super::measure::{Measure, Now};
use super::source::{Source, find};
use super::terms::Scope;
use crate::task::spec::round;
use crate::task::{Channel, Rng};
use tpg_runtime::tables::Range;

/// One element of the observation. Without a clip in the file, `clip` is infinite.
#[derive(Debug)]
pub(super) struct Input {
    value: Value,
    clip: f64,
    /// The most by which the value is off in an episode.
    spread: f64,
    /// By how much it is off in this one.
    offset: f64,
}

/// The zero that changes no number when it is added to it, not even -0.
pub(super) const NOTHING: f64 = -0.0;

#[derive(Debug)]
enum Value {
    Source(Source),
    Expression(Box<Expression>),
}

impl Input {
    /// Whether it reads a number for which `test` holds.
    pub(super) fn any(&self, test: &dyn Fn(&Measure) -> bool) -> bool {
        match &self.value {
            Value::Source(source) => test(&Measure::Value(*source)),
            Value::Expression(expression) => expression.any(test),
        }
    }

    /// Draws the offset of an episode.
    pub(super) fn draw(&mut self, rng: &mut Rng) {
        if self.spread > 0.0 {
            self.offset = rng.uniform(-self.spread, self.spread);
        }
    }

    /// The value that the policy sees.
    pub(super) fn read(&self, now: Now<'_>) -> f32 {
        let value = match &self.value {
            Value::Source(source) => source.read(now.moment),
            Value::Expression(expression) => expression.value(now),
        };
        round((value + self.offset).clamp(-self.clip, self.clip))
    }
}

/// The elements of the observation, and what they are called.
pub(super) fn inputs(
    description: &Description,
    scope: Scope<'_>,
) -> Result<(Vec<Input>, Vec<Channel>), String> {
    let (mut inputs, mut channels) = (Vec::new(), Vec::<Channel>::new());
    for observation in &description.observation {
        let clip = observation.clip.unwrap_or(f64::INFINITY);
        let range = observation.range.map(|[low, high]| Range {
            low: low as f32,
            high: high as f32,
        });
        let (values, velocity, block) = match (&observation.source, &observation.expression) {
            (Some(text), None) => {
                let found = find(text, scope.model, scope.goals)?;
                let block = found.block;
                let values: Vec<Value> = found.sources.into_iter().map(Value::Source).collect();
                (values, found.velocity, block)
            }
            (None, Some(text)) => {
                let expression = scope.expression(text)?;
                if expression.any(Measure::needs_step) {
                    return Err(format!(
                        "observation.expression = {text:?}: before, rate, outputs and alive mean nothing before the \
                         first step"
                    ));
                }
                let value = Value::Expression(Box::new(expression));
                (vec![value], false, false)
            }
            _ => {
                return Err(format!(
                    "the observation {:?} needs either a source or an expression",
                    observation.name
                ));
            }
        };
        for (k, value) in values.into_iter().enumerate() {
            let name = if block {
                format!("{}_{k}", observation.name)
            } else {
                observation.name.clone()
            };
            if channels.iter().any(|known| known.name == name) {
                return Err(format!(
                    "observation.name = {name:?}: two observations have this name; give each its own"
                ));
            }
            inputs.push(Input {
                value,
                clip,
                spread: observation.offset,
                offset: NOTHING,
            });
            channels.push(Channel {
                name,
                unit: observation.unit.clone(),
                velocity: observation.velocity.unwrap_or(velocity),
                range,
            });
        }
    }
    Ok((inputs, channels))
}
