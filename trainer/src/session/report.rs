//! What a run says of each generation.

use serde::{Deserialize, Serialize};

/// One row of `log.csv`; the fields' names are its columns.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GenerationReport {
    /// Generations completed.
    pub generation: u64,
    /// Environment steps so far.
    pub steps: u64,
    /// The champion's training score: mean return of its training episodes.
    pub best: f64,
    /// Its fitness in training: the same of the shaped rewards.
    pub fitness: f64,
    /// Its mean return over the episodes of the last race; none where the champion is not chosen by races.
    pub select: Option<f64>,
    /// Mean training score of the surviving roots.
    pub mean: f64,
    /// The champion's team number, unique in the run.
    pub champion: u64,
    /// Teams that the champion can reach.
    pub champion_teams: u16,
    /// Programs of those teams.
    pub champion_programs: u16,
    /// Effective instructions of those programs.
    pub champion_instructions: u32,
    /// Instructions that the champion executed per decision in training.
    pub instructions_mean: f64,
    /// Teams in the population.
    pub teams: usize,
    /// Programs in the population.
    pub programs: usize,
    /// New teams that were too large to be scored.
    pub unscorable: u64,
    /// Episodes that an unstable simulation ended.
    pub unstable: u64,
    /// Episodes of this generation, races and tuning included; no column.
    #[serde(skip)]
    pub episodes: u64,
    /// Seconds of training so far; the only column that differs between equal runs.
    pub seconds: f64,
}
