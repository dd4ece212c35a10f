//! Blackouts that become as frequent as the task says while training goes on.

use super::Session;
use super::race::Race;
use super::record::Candidate;
use tpg_tasks::eval::Conditions;

impl Session {
    /// In what this generation's training is easier than the task.
    pub(super) fn training_conditions(&self) -> Conditions {
        Conditions {
            stage: self.state.stage,
            stages: self.settings.curriculum.stages,
            max_steps: self.settings.max_steps,
        }
    }

    /// Enters the stage of the curriculum that is due. Scores of an easier stage cannot be compared with those of this
    /// one: where a stage begins they are forgotten, and all who had one are returned, to be scored again.
    pub(super) fn advance_curriculum(&mut self) -> Vec<Candidate> {
        let stage = self.settings.curriculum.stage(self.state.steps);
        if stage == std::mem::replace(&mut self.state.stage, stage) {
            return Vec::new();
        }
        self.exported = None;
        self.state.race = Race::default();
        let all = std::mem::take(&mut self.state.records).into_iter();
        let again = all.map(|(root, record)| Candidate {
            root,
            expected: record.steps_mean,
        });
        again.collect()
    }
}
