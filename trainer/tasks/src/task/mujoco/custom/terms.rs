//! Rewards and ends, made of a model's values.

use super::description::{self, CountsAs, Precision, RewardKind, finite};
use super::expression::Expression;
use super::measure::{Measure, Now};
use super::source::{Source, find};
use crate::task::Terms;
use mujoco_rs::prelude::MjModel;

/// The model and the goals that texts of a file refer to.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scope<'a> {
    pub model: &'a MjModel,
    pub goals: &'a [String],
}

impl Scope<'_> {
    pub(super) fn source(self, text: &str) -> Result<Source, String> {
        Source::find(text, self.model, self.goals)
    }

    pub(super) fn expression(self, text: &str) -> Result<Expression, String> {
        Expression::read(text, &|name| Measure::find(name, self.model, self.goals))
    }
}

/// What of a reward is a function of the state or the action.
#[derive(Debug, Clone)]
enum Kind {
    Constant,
    Alive,
    Linear {
        source: Source,
        target: f64,
    },
    Square {
        source: Source,
        target: f64,
    },
    /// Mean velocity over a control period; `before` is the value at its start.
    Velocity {
        source: Source,
        before: f64,
    },
    ControlCost(Precision),
    Expression(Expression),
}

/// One term of the reward of a step.
#[derive(Debug, Clone)]
pub(super) struct Reward {
    weight: f64,
    kind: Kind,
    counts_as: Option<CountsAs>,
}

impl Reward {
    /// Checks a term of the file and finds its source.
    pub(super) fn new(term: &description::Reward, scope: Scope<'_>) -> Result<Self, String> {
        let kind = match (&term.expression, term.kind) {
            (Some(text), None) => Self::expression(text, term, scope)?,
            (None, Some(kind)) => Self::simple(kind, term, scope)?,
            _ => return Err("a [[reward]] needs either a kind or an expression".into()),
        };
        let weight = match (&kind, term.weight) {
            (_, Some(weight)) => finite("reward.weight", weight)?,
            (Kind::Expression(_), None) => 1.0,
            (_, None) => return Err("a [[reward]] with a kind needs a weight".into()),
        };
        let counts_as = match kind {
            Kind::Constant | Kind::Alive => Some(CountsAs::Alive),
            Kind::ControlCost(_) => Some(CountsAs::Control),
            _ => None,
        };
        Ok(Self {
            weight,
            kind,
            counts_as: term.counts_as.or(counts_as),
        })
    }

    fn expression(
        text: &str,
        term: &description::Reward,
        scope: Scope<'_>,
    ) -> Result<Kind, String> {
        if term.source.is_some() || term.target.is_some() || term.precision != Precision::F64 {
            return Err(format!(
                "reward.expression = {text:?}: source, target and precision go with a kind; write them into the expression"
            ));
        }
        scope.expression(text).map(Kind::Expression)
    }

    fn simple(
        kind: RewardKind,
        term: &description::Reward,
        scope: Scope<'_>,
    ) -> Result<Kind, String> {
        let target = finite("reward.target", term.target.unwrap_or(0.0))?;
        let (needs_source, takes_target) = match kind {
            RewardKind::Constant | RewardKind::Alive | RewardKind::ControlCost => (false, false),
            RewardKind::Velocity => (true, false),
            RewardKind::Linear | RewardKind::Square => (true, true),
        };
        if needs_source != term.source.is_some() {
            let word = if needs_source { "needs a" } else { "has no" };
            return Err(format!("reward.kind = {kind:?}: it {word} source"));
        }
        if term.target.is_some() && !takes_target {
            return Err(format!("reward.kind = {kind:?}: it has no target"));
        }
        if term.precision != Precision::F64 && kind != RewardKind::ControlCost {
            return Err(format!(
                "reward.kind = {kind:?}: only a control-cost has a precision"
            ));
        }
        let source = || scope.source(term.source.as_deref().unwrap_or_default());
        Ok(match kind {
            RewardKind::Constant => Kind::Constant,
            RewardKind::Alive => Kind::Alive,
            RewardKind::ControlCost => Kind::ControlCost(term.precision),
            RewardKind::Linear => Kind::Linear {
                source: source()?,
                target,
            },
            RewardKind::Square => Kind::Square {
                source: source()?,
                target,
            },
            RewardKind::Velocity => Kind::Velocity {
                source: source()?,
                before: 0.0,
            },
        })
    }

    /// Whether any value that it reads satisfies this.
    pub(super) fn any(&self, test: impl Fn(&Measure) -> bool) -> bool {
        match &self.kind {
            Kind::Linear { source, .. }
            | Kind::Square { source, .. }
            | Kind::Velocity { source, .. } => test(&Measure::Value(*source)),
            Kind::Expression(expression) => expression.any(test),
            Kind::Constant | Kind::Alive | Kind::ControlCost(_) => false,
        }
    }

    /// Keeps what the term needs of the state before a step.
    pub(super) fn begin(&mut self, now: Now<'_>) {
        match &mut self.kind {
            Kind::Velocity { source, before } => *before = source.read(now.moment),
            Kind::Expression(expression) => expression.begin(now),
            _ => {}
        }
    }

    /// The term after a step.
    pub(super) fn value(&self, now: Now<'_>) -> f64 {
        let error = |source: Source, target: f64| source.read(now.moment) - target;
        let factor = match &self.kind {
            Kind::Constant => 1.0,
            Kind::Alive => f64::from(u8::from(now.alive)),
            Kind::Linear { source, target } => error(*source, *target),
            Kind::Square { source, target } => error(*source, *target).powi(2),
            Kind::Velocity { source, before } => error(*source, *before) / now.period,
            Kind::ControlCost(Precision::F64) => f64::from(-now.effort.in_order),
            Kind::ControlCost(Precision::F32) => {
                return -f64::from(self.weight as f32 * now.effort.in_order);
            }
            Kind::Expression(expression) => expression.value(now),
        };
        self.weight * factor
    }

    /// Adds a value of the term to the terms that training may weight differently, if it is one of them.
    pub(super) fn attribute(&self, value: f64, terms: &mut Terms) {
        match self.counts_as {
            Some(CountsAs::Alive) => terms.alive += value,
            Some(CountsAs::Control) => terms.control -= value,
            None => {}
        }
    }
}

/// What ends an episode.
#[derive(Debug, Clone)]
pub(super) enum Termination {
    /// One of these values leaves the range, whose limits are part of it.
    Outside {
        sources: Vec<Source>,
        low: f64,
        high: f64,
    },
    /// One of these values leaves the range, whose limits are not part of it.
    NotInside {
        sources: Vec<Source>,
        low: f64,
        high: f64,
    },
    /// A formula is not zero.
    Holds(Expression),
}

impl Termination {
    /// Checks an end of the file and finds its source.
    pub(super) fn new(term: &description::Termination, scope: Scope<'_>) -> Result<Self, String> {
        let closed = [term.below, term.above];
        let open = [term.at_or_below, term.at_or_above];
        let given = |limits: [Option<f64>; 2]| limits.iter().any(Option::is_some);
        let text = match (&term.source, &term.expression) {
            (Some(text), None) => text,
            (None, Some(text)) if !given(closed) && !given(open) => {
                let expression = scope.expression(text)?;
                if expression.any(|measure| matches!(measure, Measure::Alive)) {
                    return Err(format!(
                        "termination.expression = {text:?}: whether the episode goes on is what it decides"
                    ));
                }
                return Ok(Self::Holds(expression));
            }
            _ => {
                return Err(
                    "a [[termination]] needs either a source with limits or an expression without"
                        .into(),
                );
            }
        };
        let sources = find(text, scope.model, scope.goals)?.sources;
        let limits = match (given(closed), given(open)) {
            (true, false) => closed,
            (false, true) => open,
            (false, false) => {
                return Err(format!(
                    "termination of {text:?}: it needs below, above or both, or at-or-below, at-or-above or both"
                ));
            }
            (true, true) => {
                return Err(format!(
                    "termination of {text:?}: below and above do not go with at-or-below and at-or-above; write two \
                     terminations"
                ));
            }
        };
        let prefix = if given(open) { "at-or-" } else { "" };
        let limit = |key: &str, value: Option<f64>, none: f64| {
            let key = format!("termination.{prefix}{key}");
            value.map_or(Ok(none), |value| finite(&key, value))
        };
        let low = limit("below", limits[0], f64::NEG_INFINITY)?;
        let high = limit("above", limits[1], f64::INFINITY)?;
        if low >= high {
            return Err(format!(
                "termination of {text:?}: {prefix}below = {low} and {prefix}above = {high} end every episode at once; \
                 the first is the lower limit and the second the upper one"
            ));
        }
        Ok(if given(open) {
            Self::NotInside { sources, low, high }
        } else {
            Self::Outside { sources, low, high }
        })
    }

    /// Whether any value that it reads satisfies this.
    pub(super) fn any(&self, test: impl Fn(&Measure) -> bool) -> bool {
        match self {
            Self::Outside { sources, .. } | Self::NotInside { sources, .. } => {
                sources.iter().any(|source| test(&Measure::Value(*source)))
            }
            Self::Holds(expression) => expression.any(test),
        }
    }

    /// Keeps what it needs of the state before a step.
    pub(super) fn begin(&mut self, now: Now<'_>) {
        if let Self::Holds(expression) = self {
            expression.begin(now);
        }
    }

    /// Whether it ends the episode.
    pub(super) fn reached(&self, now: Now<'_>) -> bool {
        match self {
            Self::Outside { sources, low, high } => sources.iter().any(|source| {
                let value = source.read(now.moment);
                value < *low || value > *high
            }),
            Self::NotInside { sources, low, high } => !sources.iter().all(|source| {
                let value = source.read(now.moment);
                *low < value && value < *high
            }),
            Self::Holds(expression) => expression.value(now) != 0.0,
        }
    }
}
