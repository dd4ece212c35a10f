//! Protected lineages of agents whose constants are tuned and written back in each generation.

use serde::{Deserialize, Serialize};
use tpg_runtime::blob::Blob;
use tpg_runtime::rng::mix64;

use super::Session;
use super::eval_stats::EvalStats;
use super::record::Candidate;
use crate::evaluator::{Batch, Evaluator, EvaluatorError};
use crate::evolve::{
    Initial, LARGEST_COUNT, NewConstants, Team, TeamId, grow, remember, rewrite_constants,
};
use crate::lower::{ConstantSite, Mode, Owner, constant_sites, with_constants};
use crate::tune::{RecentMean, Search, Trial};
use tpg_tasks::eval::{Domain, episode_seed};
use tpg_tasks::stats::mean;
use tpg_tasks::task::Rng;

/// Marks the random stream of tuning among those that derive from a run's seed.
const TUNING_STREAM: u64 = 5;
/// Number of a generation's first episode of tuning: the scores' own are numbered from 0.
const FIRST_EPISODE: u64 = 1 << 32;
/// Weight of an iteration in a lineage's trial average.
const TRIAL_WEIGHT: f64 = 0.1;

/// A lineage: the agent that is tuned, which selection does not drop.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Lineage {
    pub(super) root: TeamId,
    /// Root of the last mean over the lineage, protected until the next.
    mean_root: Option<TeamId>,
    mean: RecentMean,
    pub(super) iterations: u64,
    grown: bool,
    remembers: bool,
    /// Generations for which it has lain behind the best agent.
    behind: u32,
    /// Moving average of what all of its trials scored, which the few episodes of its own score would leave to luck.
    pub(super) trial_average: Option<f64>,
}

impl Lineage {
    fn new(root: TeamId) -> Self {
        Lineage {
            root,
            mean_root: None,
            mean: RecentMean::default(),
            iterations: 0,
            grown: false,
            remembers: false,
            behind: 0,
            trial_average: None,
        }
    }

    /// Takes an iteration's trials into its trial average; those without a score tell nothing.
    fn update_trial_average(&mut self, trials: &[Trial]) {
        let scores = trials.iter().flat_map(|t| [t.forwards, t.backwards]);
        let scores: Vec<f64> = scores.filter(|score| score.is_finite()).collect();
        if !scores.is_empty() {
            let score = mean(&scores);
            let before = self.trial_average.unwrap_or(score);
            self.trial_average = Some(before + TRIAL_WEIGHT * (score - before));
        }
    }

    /// Whether a run can have it.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(super) fn check(&self) -> Result<(), &'static str> {
        let counts = self.iterations <= LARGEST_COUNT && self.behind < u32::MAX;
        if counts && self.mean.is_consistent() {
            Ok(())
        } else {
            Err("one of its tuned agents counts what no run reaches")
        }
    }

    /// The agents that it protects.
    pub(super) fn roots(&self) -> impl Iterator<Item = TeamId> + use<> {
        [self.root].into_iter().chain(self.mean_root)
    }
}

/// The constants of an agent that decisions depend on.
pub(super) struct Tunable {
    template: Vec<u8>,
    /// The whole table of constants.
    table: Vec<f32>,
    /// What of it decisions depend on: its places in the table and in the genome.
    read: Vec<(usize, ConstantSite)>,
}

impl Tunable {
    /// Those constants, in the order of the table.
    pub(super) fn values(&self) -> Vec<f32> {
        self.read.iter().map(|(k, _)| self.table[*k]).collect()
    }

    /// The agent's blob with others in their place.
    fn blob(&self, values: &[f32]) -> Option<Vec<u8>> {
        let mut table = self.table.clone();
        for ((k, _), value) in self.read.iter().zip(values) {
            table[*k] = *value;
        }
        with_constants(&self.template, &table)
    }
}

impl Session {
    /// The agents that lineages protect.
    pub(super) fn tuned(&self) -> impl Iterator<Item = TeamId> {
        self.state.lineages.iter().flat_map(Lineage::roots)
    }

    /// Episodes that tuning takes in this generation: trials, and the scores of what comes of them.
    pub(super) fn planned_trials(&self) -> u64 {
        if self.state.generation == 0 {
            return 0;
        }
        let params = &self.settings.tuning;
        let trials = 2 * u64::from(params.iterations) * u64::from(params.directions);
        let episodes = trials * u64::from(params.episodes) + u64::from(self.settings.episodes);
        self.state.lineages.len() as u64 * episodes
    }

    /// Tunes every lineage and adds what came of it to the population, to be scored with the generation.
    pub(super) fn tune(
        &mut self,
        evaluator: &mut dyn Evaluator,
        stats: &mut EvalStats,
    ) -> Result<Vec<Candidate>, EvaluatorError> {
        let mut candidates = Vec::new();
        self.hold_lineages();
        if self.state.generation == 0 {
            return Ok(candidates);
        }
        let mut rng = Rng::new(mix64(&[self.seed, self.state.generation, TUNING_STREAM]));
        let mut episode = FIRST_EPISODE;
        let mut lineages = std::mem::take(&mut self.state.lineages);
        for lineage in &mut lineages {
            let before = lineage.root;
            let roots = self.tune_lineage(lineage, evaluator, &mut rng, &mut episode, stats)?;
            self.state.population.roots.extend(&roots);
            candidates.extend(roots.into_iter().map(|root| self.candidate(root, before)));
        }
        self.state.lineages = lineages;
        Ok(candidates)
    }

    /// Ends lineages that have lain behind for too long, and begins new ones at the best agents.
    fn hold_lineages(&mut self) {
        let params = self.settings.tuning;
        if params.lineages == 0 {
            return;
        }
        if self.state.generation == 0 {
            // Nothing is scored yet: only a linear policy is worth protecting. Lines that begin alike part by their directions.
            if let (true, Some(root)) = (
                self.settings.params.initial != Initial::Random,
                self.state.population.roots.first(),
            ) {
                self.state.lineages = vec![Lineage::new(*root); params.lineages as usize];
            }
            return;
        }
        let ranking = self.state.ranking();
        if let Some((_, best)) = ranking.first() {
            let least = best - params.margin * best.abs();
            for lineage in &mut self.state.lineages {
                let record = self.state.records.get(&lineage.root);
                let behind = record.is_none_or(|r| r.fitness < least);
                lineage.behind = if behind { lineage.behind + 1 } else { 0 };
            }
        }
        let longest = self
            .state
            .lineages
            .iter()
            .map(|lineage| lineage.iterations)
            .max();
        let wanted = params.lineages_after(longest.unwrap_or(0)) as usize;
        if self.state.lineages.len() > wanted {
            let trial_average =
                |lineage: &Lineage| lineage.trial_average.unwrap_or(f64::NEG_INFINITY);
            // A stable sort: of equals the older lineage goes on.
            self.state
                .lineages
                .sort_by(|a, b| trial_average(b).total_cmp(&trial_average(a)));
            self.state.lineages.truncate(wanted);
        }
        if params.patience > 0 {
            self.state
                .lineages
                .retain(|lineage| lineage.behind < params.patience);
        }
        for (root, _) in ranking {
            if self.state.lineages.len() >= wanted {
                break;
            }
            if !self.tuned().any(|tuned| tuned == root) {
                self.state.lineages.push(Lineage::new(root));
            }
        }
    }

    /// Tunes one lineage; the new roots, none if it has no constants that matter.
    fn tune_lineage(
        &mut self,
        lineage: &mut Lineage,
        evaluator: &mut dyn Evaluator,
        rng: &mut Rng,
        episode: &mut u64,
        stats: &mut EvalStats,
    ) -> Result<Vec<TeamId>, EvaluatorError> {
        let params = self.settings.tuning;
        let due = |after: u32| after > 0 && lineage.iterations >= u64::from(after);
        let (growth, memory) = (due(params.grow_after), due(params.remember_after));
        if growth && !lineage.grown {
            lineage.grown = true;
            self.grow_lineage(lineage, rng);
        }
        if memory && !lineage.remembers {
            lineage.remembers = true;
            self.remember_lineage(lineage);
        }
        let Some(tunable) = self.tunable(lineage.root) else {
            lineage.behind = u32::MAX;
            return Ok(Vec::new());
        };
        let mut values = tunable.values();
        for _ in 0..params.iterations {
            let cooled = params.cooled(lineage.iterations);
            let search = Search::new(&cooled, &values, rng);
            let trials = self.try_directions(&search, &tunable, evaluator, episode, stats)?;
            lineage.update_trial_average(&trials);
            values = search.step(&trials);
            lineage.mean.push(&values);
            lineage.iterations += 1;
        }
        let old = lineage.root;
        lineage.root = self.write_back(old, &tunable, &values);
        let mut roots = vec![lineage.root];
        let due = params.mean_every > 0
            && self
                .state
                .generation
                .is_multiple_of(u64::from(params.mean_every));
        if due && let Some(mean) = lineage.mean.last_quarter() {
            let root = self.write_back(old, &tunable, &mean);
            lineage.mean_root = Some(root);
            roots.push(root);
        }
        Ok(roots)
    }

    /// Clones programs inside the lineage's team, each with a bid of its own; all of its constants are tuned from here on.
    pub(super) fn grow_lineage(&mut self, lineage: &mut Lineage, rng: &mut Rng) {
        let mut team = Team::clone(self.state.population.team(lineage.root));
        let size = self.settings.tuning.grow_to as usize;
        let mut grew = false;
        while team.members.len() < size
            && grow(
                &mut self.state.population,
                &mut team,
                &self.settings.genes,
                usize::MAX,
                rng,
            )
        {
            grew = true;
        }
        if grew {
            lineage.root = self.state.population.add_team(team);
            lineage.mean = RecentMean::default();
        }
    }

    /// Gives each program of the lineage's team that has the registers a memory of what it observed.
    pub(super) fn remember_lineage(&mut self, lineage: &mut Lineage) {
        let mut team = Team::clone(self.state.population.team(lineage.root));
        let before = team.members.clone();
        for member in &mut team.members {
            if let Some(copy) = remember(
                &mut self.state.population,
                *member,
                &self.settings.genes,
                usize::MAX,
            ) {
                *member = copy;
            }
        }
        if team.members != before {
            lineage.root = self.state.population.add_team(team);
            lineage.mean = RecentMean::default();
        }
    }

    /// What of an agent can be tuned; `None` if nothing, or if the agent is too large to be scored.
    pub(super) fn tunable(&self, root: TeamId) -> Option<Tunable> {
        let template = self
            .export(root, self.state.generation, None, Mode::Compact)
            .ok()?;
        let sites = constant_sites(&self.state.population, root, &self.settings.policy_spec);
        let blob = Blob::decode(&template).ok()?;
        let constants = blob.tables().constants.iter();
        let table: Vec<f32> = constants.map(|x| f32::from_le_bytes(*x)).collect();
        let places = sites.iter().enumerate();
        let read: Vec<(usize, ConstantSite)> =
            places.filter_map(|(k, site)| Some((k, (*site)?))).collect();
        let sound = table.len() == sites.len() && !read.is_empty();
        sound.then_some(Tunable {
            template,
            table,
            read,
        })
    }

    /// Scores the trials of an iteration; both trials of a direction run on the same episodes, those of others on others.
    fn try_directions(
        &self,
        search: &Search<'_>,
        tunable: &Tunable,
        evaluator: &mut dyn Evaluator,
        episode: &mut u64,
        stats: &mut EvalStats,
    ) -> Result<Vec<Trial>, EvaluatorError> {
        let params = &self.settings.tuning;
        let (directions, episodes) = (params.directions as usize, params.episodes as usize);
        let numbers = *episode..*episode + (directions * episodes) as u64;
        *episode = numbers.end;
        let seeds: Vec<u64> = numbers
            .map(|k| episode_seed(Domain::Train, self.seed, self.state.generation, k))
            .collect();
        let make = |trial: usize| tunable.blob(&search.constants(trial));
        let results = evaluator.score(&Batch {
            expected: &vec![0.0; 2 * directions],
            make: &make,
            episodes,
            episode_seeds: &seeds,
            split: self.split(),
            conditions: self.training_conditions(),
            record: self.learner.is_some(),
        })?;
        let fitness: Vec<f64> = results
            .iter()
            .map(|episodes| match episodes {
                Some(episodes) => stats.count(episodes, |e| e.shaped),
                None => f64::NEG_INFINITY,
            })
            .collect();
        let (forwards, backwards) = fitness.split_at(directions);
        let pairs = forwards.iter().zip(backwards);
        let trials = pairs.map(|(forwards, backwards)| Trial {
            forwards: *forwards,
            backwards: *backwards,
        });
        Ok(trials.collect())
    }

    /// Adds the agent with these constants in place of those that were tuned.
    fn write_back(&mut self, root: TeamId, tunable: &Tunable, values: &[f32]) -> TeamId {
        let mut constants = NewConstants::default();
        let population = &self.state.population;
        for ((_, site), value) in tunable.read.iter().zip(values) {
            let all = match site.owner {
                Owner::Program(id) => (constants.programs.entry(id))
                    .or_insert_with(|| population.program(id).constants.values().to_vec()),
                Owner::Team(id) => (constants.teams.entry(id))
                    .or_insert_with(|| population.team(id).memory.values().to_vec()),
            };
            all[site.index] = *value;
        }
        rewrite_constants(&mut self.state.population, root, &constants)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_trial_average_moves_with_the_mean_of_the_trials() {
        let mut lineage = Lineage::new(TeamId(1));
        let trial = |forwards, backwards| Trial {
            forwards,
            backwards,
        };
        lineage.update_trial_average(&[trial(f64::NEG_INFINITY, f64::NEG_INFINITY)]);
        assert_eq!(lineage.trial_average, None);
        lineage.update_trial_average(&[trial(1.0, 3.0), trial(f64::NEG_INFINITY, 5.0)]);
        assert_eq!(lineage.trial_average, Some(3.0));
        lineage.update_trial_average(&[trial(13.0, 13.0)]);
        assert_eq!(lineage.trial_average, Some(3.0 + TRIAL_WEIGHT * 10.0));
    }
}
