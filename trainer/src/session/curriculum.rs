//! Training that becomes the task itself by and by: blackouts as frequent as it says, a fitness that is its score.

use super::{Newcomer, Race, Session};
use crate::eval::Pool;

impl Session {
    /// Sets how frequent blackouts are in this generation's training, how long its episodes, and how their rewards are shaped. Where a stage of
    /// blackouts begins, what was scored in an easier one is comparable no more: it is forgotten, and all who had a score are to be scored again.
    pub(super) fn rise(&mut self, pool: &mut Pool) -> Vec<Newcomer> {
        let curriculum = self.blueprint.curriculum;
        let stage = curriculum.stage(self.steps);
        pool.ease(stage, curriculum.stages);
        pool.shorten(self.blueprint.max_steps);
        let shaping = self.blueprint.shaping.after(self.steps);
        pool.shape(shaping);
        if shaping.is_default() {
            for record in self.records.values_mut() {
                record.fitness = record.score;
            }
        }
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
