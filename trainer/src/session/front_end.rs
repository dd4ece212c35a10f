//! What a run learns of how its policies perceive, once in a generation.

use std::borrow::Cow;

use super::Session;
use crate::config::Settings;
use crate::evaluator::Evaluator;
use crate::front_end::Learner;
use crate::lower::PolicySpec;

/// The learner of a run that has just begun.
pub(super) fn learner(settings: &Settings) -> Option<Learner> {
    let params = &settings.front_end;
    let inputs = usize::from(settings.policy_spec.shape.inputs);
    (params.is_on()).then(|| Learner::new(params, inputs, settings.front_end_columns.clone()))
}

impl Session {
    /// The specification of a generation's policies: all of them have its front end.
    pub(super) fn policy_spec(&self, generation: u64) -> Cow<'_, PolicySpec> {
        let policy_spec = &self.settings.policy_spec;
        match self.learner.as_ref().and_then(|l| l.of(generation)) {
            None => Cow::Borrowed(policy_spec),
            Some(front_end) => Cow::Owned(PolicySpec {
                front_end: Some(front_end.clone()),
                ..policy_spec.clone()
            }),
        }
    }

    /// Learns from what this generation's training showed, for the next one.
    pub(super) fn learn(&mut self, evaluator: &mut dyn Evaluator) {
        let recordings = evaluator.take_recordings();
        let actions = self.settings.policy_spec.shape.actions;
        if let Some(learner) = &mut self.learner {
            learner.learn(
                &self.settings.front_end,
                actions,
                self.state.generation,
                &recordings,
            );
        }
    }

    /// Drops the front ends with which nobody who is left was scored.
    pub(super) fn forget(&mut self) {
        let generations = self.state.records.values().map(|record| record.generation);
        if let Some(learner) = &mut self.learner {
            learner.retain(generations);
        }
    }
}
