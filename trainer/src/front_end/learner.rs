//! Learns the front ends of a run, generation by generation.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use tpg_runtime::front_end::monomials;

use super::fit::Pairs;
use super::learned::Model;
use super::record::action_variables;
use super::{FrontEndParams, LearnedFrontEnd, Moments, Others, Recording, choose};
use crate::evolve::LARGEST_COUNT;
use tpg_tasks::task::ActionSpace;

/// One generation may replace at most one in this many of the kept pairs, so that they span several generations.
const SHARE_OF_A_GENERATION: usize = 4;
/// Nothing is fitted with fewer pairs than this for each coefficient of a column.
const PAIRS_PER_COEFFICIENT: usize = 3;

/// Learns front ends.
///
/// All policies of a generation have the same front end. Front ends of past generations are kept for the policies that were
/// scored with them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Learner {
    moments: Moments,
    /// The latest pairs, oldest first, each an observation, the action after it and the next observation.
    pairs: Vec<f32>,
    /// The columns that the model describes, once they are known.
    columns: Option<Vec<u16>>,
    /// Front ends by the generation from which they are used.
    fitted: BTreeMap<u64, Arc<LearnedFrontEnd>>,
}

impl Learner {
    /// A learner that has seen nothing. `columns` are those that the model describes; `None` lets the data choose them.
    #[must_use]
    pub fn new(params: &FrontEndParams, inputs: usize, columns: Option<Vec<u16>>) -> Self {
        let moments = Moments::new(inputs);
        let (means, scales) = moments.scaling();
        let first = LearnedFrontEnd {
            fallback: params.belief,
            means,
            scales,
            model: None,
        };
        Learner {
            moments,
            pairs: Vec::new(),
            columns,
            fitted: BTreeMap::from([(0, Arc::new(first))]),
        }
    }

    /// The front end of a generation: the last one that was made before it.
    #[must_use]
    pub fn of(&self, generation: u64) -> Option<&Arc<LearnedFrontEnd>> {
        self.fitted.range(..=generation).next_back().map(|(_, p)| p)
    }

    /// Whether it can be that of a run with so many inputs and these actions. One that comes from a file may not be.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn check(&self, inputs: usize, actions: ActionSpace) -> Result<(), &'static str> {
        let variables = action_variables(actions);
        let ascending = |columns: &[u16]| {
            columns.is_sorted_by(|a, b| a < b) && columns.iter().all(|c| usize::from(*c) < inputs)
        };
        let fits = |model: &Model| {
            let columns = model.columns.len();
            (1..=3).contains(&model.degree)
                && ascending(&model.columns)
                && model.coefficients.len()
                    == columns * monomials(columns + variables, model.degree) as usize
        };
        if !self.moments.are_of(inputs) {
            return Err("its moments are of another observation");
        }
        if !self.pairs.len().is_multiple_of(2 * inputs + variables) {
            return Err("its pairs of observations are cut");
        }
        if !self.columns.as_deref().is_none_or(ascending) {
            return Err("its model describes columns that do not exist");
        }
        if self.fitted.is_empty() || self.fitted.keys().any(|from| *from > LARGEST_COUNT) {
            return Err("it has no front end, or one of a generation that never comes");
        }
        for front_end in self.fitted.values() {
            if front_end.means.len() != inputs || front_end.scales.len() != inputs {
                return Err("one of its scalings is of another observation");
            }
            if !front_end.model.as_ref().is_none_or(fits) {
                return Err("one of its models has other sizes than it says");
            }
        }
        Ok(())
    }

    /// Takes in the recordings of a generation, in the order of individual and episode. Every `refit_every` generations it makes a
    /// new front end, which is used from the next generation on.
    pub fn learn(
        &mut self,
        params: &FrontEndParams,
        actions: ActionSpace,
        generation: u64,
        recordings: &[Recording],
    ) {
        for recording in recordings {
            self.moments.merge(&recording.moments);
        }
        let (inputs, variables) = (self.inputs(), action_variables(actions));
        if params.belief.has_model() {
            self.keep(params, 2 * inputs + variables, recordings);
        }
        if !generation.is_multiple_of(u64::from(params.refit_every.max(1))) {
            return;
        }
        let (means, mut scales) = match params.standardise {
            true => self.moments.scaling(),
            false => Moments::new(inputs).scaling(),
        };
        let model = if params.belief.has_model() {
            self.fit(params, variables, &means, &scales)
        } else {
            None
        };
        if let (Others::Drop, Some(model)) = (params.others, &model) {
            for (column, scale) in (0u16..).zip(&mut scales) {
                if !model.columns.contains(&column) {
                    *scale = 0.0;
                }
            }
        }
        let front_end = LearnedFrontEnd {
            fallback: params.belief,
            means,
            scales,
            model,
        };
        self.fitted.insert(generation + 1, Arc::new(front_end));
    }

    /// Drops all front ends except those of these generations and the latest.
    pub fn retain(&mut self, generations: impl Iterator<Item = u64>) {
        let from = |generation| {
            self.fitted
                .range(..=generation)
                .next_back()
                .map(|(k, _)| *k)
        };
        let mut named: BTreeSet<u64> = generations.filter_map(from).collect();
        named.extend(self.fitted.keys().next_back());
        self.fitted.retain(|from, _| named.contains(from));
    }

    fn inputs(&self) -> usize {
        self.of(u64::MAX).map_or(0, |p| p.means.len())
    }

    /// Keeps the latest pairs. A generation is subsampled to at most a quarter of the buffer.
    fn keep(&mut self, params: &FrontEndParams, stride: usize, recordings: &[Recording]) {
        let limit = params.pairs as usize;
        let new: usize = recordings.iter().map(|r| r.pairs.len() / stride).sum();
        let every = new.div_ceil((limit / SHARE_OF_A_GENERATION).max(1)).max(1);
        let all = recordings.iter().flat_map(|r| r.pairs.chunks_exact(stride));
        for pair in all.step_by(every) {
            self.pairs.extend_from_slice(pair);
        }
        let excess = (self.pairs.len() / stride).saturating_sub(limit);
        self.pairs.drain(..excess * stride);
    }

    fn fit(
        &mut self,
        params: &FrontEndParams,
        actions: usize,
        means: &[f32],
        scales: &[f32],
    ) -> Option<Model> {
        let inputs = self.inputs();
        let pairs = Pairs {
            raw: &self.pairs,
            inputs,
            actions,
            means,
            scales,
            weighting: params.weighting,
        };
        let enough = |columns: usize, degree: u8| {
            let monomials = monomials(columns + actions, degree) as usize;
            self.pairs.len() / (2 * inputs + actions) >= PAIRS_PER_COEFFICIENT * monomials
        };
        let columns = match &self.columns {
            Some(columns) => columns.clone(),
            None if enough(inputs, params.degree.max(2)) => {
                choose::columns(&pairs, params.degree, params.ridge)
            }
            None => return None,
        };
        if !enough(columns.len(), params.degree) {
            return None;
        }
        let coefficients = pairs.model(&columns, params)?;
        self.columns = Some(columns.clone());
        Some(Model {
            degree: params.degree,
            columns,
            coefficients,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::FrontEndFallback;
    use super::*;
    use tpg_tasks::task::Rng;

    /// Once there is a model, programs get zeros for the columns that it leaves out, also in visible steps.
    #[test]
    fn other_columns_are_dropped_once_there_is_a_model() {
        let actions = ActionSpace::Continuous {
            len: 1,
            low: -1.0,
            high: 1.0,
        };
        let params = FrontEndParams {
            belief: FrontEndFallback::Learned,
            others: Others::Drop,
            refit_every: 1,
            ..FrontEndParams::default()
        };
        let mut learner = Learner::new(&params, 2, Some(vec![1]));
        let mut rng = Rng::new(6);
        let mut pairs = Vec::new();
        for _ in 0..50 {
            let [x, y, u] = [(); 3].map(|()| rng.uniform(-1.0, 1.0) as f32);
            pairs.extend([x, y, u, -x, 0.9 * y + 0.1 * u]);
        }
        let recording = Recording {
            moments: Moments::new(2),
            pairs: pairs.into(),
        };
        learner.learn(&params, actions, 0, &[recording]);
        let scales = |generation| learner.of(generation).expect("a front end").scales.clone();
        let dropped = |scales: Vec<f32>| scales.iter().map(|s| *s > 0.0).collect::<Vec<_>>();
        assert_eq!(dropped(scales(0)), [true, true]);
        assert_eq!(dropped(scales(1)), [false, true]);
    }
}
