//! What changes from generation to generation.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use tpg_runtime::isa::INDEXED_CELLS;

use super::race::Race;
use super::record::Record;
use super::tuning::Lineage;
use crate::evolve::{Genes, LARGEST_COUNT, Population, TeamId, rank};

/// A team is scored at most once in a generation, and no run has so many.
const MOST_SCORINGS: u32 = u32::MAX / 2;

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

    /// Whether a run with these genes can have this state. That of a file may be another.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(super) fn check(&self, genes: &Genes) -> Result<(), String> {
        self.population.check(genes).map_err(|e| e.to_string())?;
        let tuned = self.lineages.iter().flat_map(Lineage::roots);
        let mut roots = tuned
            .chain(self.race.champion)
            .chain(self.population.roots.iter().copied());
        // Before the first generation a given population has no scores.
        if self.generation > 0 && !roots.all(|root| self.records.contains_key(&root)) {
            return Err("it names roots whose scores it does not hold".into());
        }
        if !self
            .records
            .keys()
            .all(|root| self.population.has_team(*root))
        {
            return Err("it has scores of teams that it does not hold".into());
        }
        if self.generation > LARGEST_COUNT || self.steps > LARGEST_COUNT {
            return Err("it counts more generations or steps than a run reaches".into());
        }
        let memories = self.records.values().filter_map(|r| r.memory.as_ref());
        if memories
            .chain(&self.memory)
            .any(|m| m.len() != INDEXED_CELLS)
        {
            return Err("its shared memory has another size".into());
        }
        if self.records.values().any(|r| r.scorings > MOST_SCORINGS) {
            return Err("a team was scored more often than a run can".into());
        }
        self.lineages
            .iter()
            .try_for_each(Lineage::check)
            .map_err(str::to_owned)
    }
}
