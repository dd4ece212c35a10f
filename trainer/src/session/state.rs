//! What changes from generation to generation.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::race::Race;
use super::record::Record;
use super::tuning::Lineage;
use crate::evolve::{Population, TeamId, rank};

/// The part of a run that a generation changes, but for the learned front end, which changes when nothing can stop a
/// generation any more. A generation that is stopped leaves the state as it found it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct State {
    /// Generations completed.
    pub(super) generation: u64,
    /// Environment steps of all training episodes.
    pub(super) steps: u64,
    /// Seconds of training, over all resumes.
    pub(super) seconds: f64,
    #[serde(with = "super::stored_population")]
    pub(super) population: Population,
    pub(super) records: BTreeMap<TeamId, Record>,
    /// The population's memory, for scopes in which it outlives agents; `None` until something is in it.
    pub(super) memory: Option<Arc<[f32]>>,
    /// Median scores of the teams that the last generation made, and the one before.
    pub(super) medians: [Option<f64>; 2],
    pub(super) lineages: Vec<Lineage>,
    pub(super) race: Race,
    /// Stage of the curriculum in which scores were found.
    pub(super) stage: u32,
}

impl State {
    /// Every scored root with its fitness, oldest first.
    pub(super) fn fitness(&self) -> Vec<(TeamId, f64)> {
        let fitness = |(id, r): (&TeamId, &Record)| (*id, r.fitness);
        self.records.iter().map(fitness).collect()
    }

    /// Every scored root with its fitness, the best first.
    pub(super) fn ranking(&self) -> Vec<(TeamId, f64)> {
        let mut ranking = self.fitness();
        ranking.retain(|(_, fitness)| fitness.is_finite());
        ranking.sort_by(|a, b| rank(*a, *b));
        ranking
    }

    /// The winner of the last race, else the best root in training, ties to the older, with its record.
    pub(super) fn champion(&self) -> Option<(TeamId, &Record)> {
        if let Some(root) = self.race.champion
            && let Some(record) = self.records.get(&root)
        {
            return Some((root, record));
        }
        let records = self.records.iter().map(|(id, r)| (*id, r));
        records.min_by(|a, b| rank((a.0, a.1.fitness), (b.0, b.1.fitness)))
    }

    /// Whether everything that is named exists.
    pub(super) fn is_closed(&self) -> bool {
        let tuned = self.lineages.iter().flat_map(Lineage::roots);
        let mut roots = tuned
            .chain(self.race.champion)
            .chain(self.population.roots.iter().copied());
        // Before the first generation a given population has no scores.
        self.population.is_closed()
            && (self.generation == 0 || roots.all(|root| self.records.contains_key(&root)))
    }
}
