//! Blackouts that become as frequent as the task says while training goes on.

use super::{Newcomer, Race, Session};
use crate::eval::Pool;

impl Session {
    /// Sets how frequent blackouts are in this generation's training, and how long its episodes. Where a stage begins, what was scored in an easier
    /// one is comparable no more: it is forgotten, and all who had a score are to be scored again.
    pub(super) fn rise(&mut self, pool: &mut Pool) -> Vec<Newcomer> {
        let curriculum = self.blueprint.curriculum;
        let stage = curriculum.stage(self.steps);
        pool.ease(stage, curriculum.stages);
        pool.shorten(self.blueprint.max_steps);
        if stage == std::mem::replace(&mut self.stage, stage) {
            return Vec::new();
        }
        self.exported = None;
        self.race = Race::default();
        let all = std::mem::take(&mut self.records).into_iter();
        let again = all.map(|(root, record)| Newcomer {
            root,
            expected: record.steps_mean,
        });
        again.collect()
    }
}
