//! Rewards and ends, made of a model's values.

use super::description::{self, RewardKind, finite};
use super::source::Source;
use crate::task::Terms;
use mujoco_rs::prelude::{MjData, MjModel};
use std::sync::Arc;

/// The function of state or action that a reward term weights.
#[derive(Debug, Clone, Copy)]
enum Kind {
    Constant,
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
    ControlCost,
}

/// One term of the reward of a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reward {
    weight: f64,
    kind: Kind,
}

impl Reward {
    /// Checks a term of the file and finds its source.
    pub(super) fn new(term: &description::Reward, model: &MjModel) -> Result<Self, String> {
        let weight = finite("reward.weight", term.weight)?;
        let target = finite("reward.target", term.target.unwrap_or(0.0))?;
        let (needs_source, takes_target) = match term.kind {
            RewardKind::Constant | RewardKind::ControlCost => (false, false),
            RewardKind::Velocity => (true, false),
            RewardKind::Linear | RewardKind::Square => (true, true),
        };
        if needs_source != term.source.is_some() {
            let word = if needs_source { "needs a" } else { "has no" };
            return Err(format!("reward.kind = \"{}\": it {word} source", term.kind));
        }
        if term.target.is_some() && !takes_target {
            return Err(format!("reward.kind = \"{}\": it has no target", term.kind));
        }
        let source = || Source::find(term.source.as_deref().unwrap_or_default(), model);
        let kind = match term.kind {
            RewardKind::Constant => Kind::Constant,
            RewardKind::ControlCost => Kind::ControlCost,
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
        };
        Ok(Self { weight, kind })
    }

    /// Keeps what the term needs of the state before a step.
    pub(super) fn begin(&mut self, data: &MjData<Arc<MjModel>>) {
        if let Kind::Velocity { source, before } = &mut self.kind {
            *before = source.read(data);
        }
    }

    /// The term after a step of `period` seconds under an action with this squared norm.
    pub(super) fn value(&self, data: &MjData<Arc<MjModel>>, period: f64, norm: f32) -> f64 {
        let error = |source: Source, target: f64| source.read(data) - target;
        let factor = match self.kind {
            Kind::Constant => 1.0,
            Kind::Linear { source, target } => error(source, target),
            Kind::Square { source, target } => error(source, target).powi(2),
            Kind::Velocity { source, before } => error(source, before) / period,
            Kind::ControlCost => f64::from(-norm),
        };
        self.weight * factor
    }

    /// Adds a value of the term to the terms that training may weight differently, if it is one of them.
    pub(super) fn attribute(&self, value: f64, terms: &mut Terms) {
        match self.kind {
            Kind::Constant => terms.alive += value,
            Kind::ControlCost => terms.control -= value,
            Kind::Linear { .. } | Kind::Square { .. } | Kind::Velocity { .. } => {}
        }
    }
}

/// A value that ends the episode when it leaves a range.
#[derive(Debug, Clone, Copy)]
pub(super) struct Termination {
    source: Source,
    below: f64,
    above: f64,
}

impl Termination {
    /// Checks an end of the file and finds its source.
    pub(super) fn new(term: &description::Termination, model: &MjModel) -> Result<Self, String> {
        let source = Source::find(&term.source, model)?;
        if term.below.is_none() && term.above.is_none() {
            return Err(format!(
                "termination of {:?}: it needs below, above or both",
                term.source
            ));
        }
        let limit = |key: &str, value: Option<f64>, none: f64| {
            value.map_or(Ok(none), |value| finite(key, value))
        };
        Ok(Self {
            source,
            below: limit("termination.below", term.below, f64::NEG_INFINITY)?,
            above: limit("termination.above", term.above, f64::INFINITY)?,
        })
    }

    /// Whether the value is outside its range.
    pub(super) fn reached(&self, data: &MjData<Arc<MjModel>>) -> bool {
        let value = self.source.read(data);
        value < self.below || value > self.above
    }
}
