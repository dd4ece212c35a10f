//! A population: roots, and all teams and programs that they can reach.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::genome::random_constants;
use super::linear::linear_team;
use super::{
    Action, ActionPrograms, EvolutionParams, Genes, Initial, Program, ProgramId, ResetRule, Shape,
    SizeRange, Team, TeamId,
};
use tpg_tasks::task::Rng;

/// Roots, and all teams and programs that they can reach.
///
/// Teams and programs never change once they are in: children are new ones. A program can therefore only
/// lead to a team older than itself, and the graph has no cycles.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Population {
    /// Root teams, oldest first: the agents.
    pub roots: Vec<TeamId>,
    pub(crate) teams: BTreeMap<TeamId, Arc<Team>>,
    pub(crate) programs: BTreeMap<ProgramId, Arc<Program>>,
    pub(crate) next_team: u64,
    pub(crate) next_program: u64,
}

impl Population {
    /// A first generation: every team is a root of atomic programs of its own, all random, or the first one linear.
    #[must_use]
    pub fn random(genes: &Genes, params: &EvolutionParams, rng: &mut Rng) -> Self {
        let mut population = Population::default();
        if params.initial != Initial::Random {
            let linear = linear_team(&mut population, genes, params.initial, rng);
            population.roots.push(linear);
        }
        while population.roots.len() < params.population as usize {
            let owned = match genes.shape.action_programs {
                ActionPrograms::Winner => 0,
                ActionPrograms::Each => genes.shape.atomic_actions(),
            };
            let size = initial_size(params.team.size, rng).max(usize::from(owned));
            // The first programs see to it that every output has one.
            let actions = (0..owned).map(Some).chain(std::iter::repeat(None));
            let members = actions
                .take(size)
                .map(|owned| {
                    let len = initial_size(params.program.size, rng);
                    let mut program = Program::random(genes, len, rng);
                    if let Some(output) = owned {
                        program.action = Action::Atomic(output);
                    }
                    population.add_program(program)
                })
                .collect();
            let root = population.add_team(Team {
                members,
                memory: random_memory(genes, rng),
                stream_key: rng.word() as u32,
                reset_rule: genes.reset_rules.then(|| ResetRule::random(rng)),
            });
            population.roots.push(root);
        }
        population
    }

    /// A team; every id that a population hands out names one until it is collected.
    #[must_use]
    pub fn team(&self, team_id: TeamId) -> &Arc<Team> {
        &self.teams[&team_id]
    }

    /// A program; every id that a population hands out names one until it is collected.
    #[must_use]
    pub fn program(&self, program_id: ProgramId) -> &Arc<Program> {
        &self.programs[&program_id]
    }

    /// Number of teams, roots and inner ones.
    #[must_use]
    pub fn team_count(&self) -> usize {
        self.teams.len()
    }

    /// Number of programs.
    #[must_use]
    pub fn program_count(&self) -> usize {
        self.programs.len()
    }

    /// Adds a team, not yet as a root, and names it.
    pub fn add_team(&mut self, team: Team) -> TeamId {
        let team_id = TeamId(self.next_team);
        self.next_team += 1;
        self.teams.insert(team_id, Arc::new(team));
        team_id
    }

    /// Adds a program and names it.
    pub fn add_program(&mut self, program: Program) -> ProgramId {
        let program_id = ProgramId(self.next_program);
        self.next_program += 1;
        self.programs.insert(program_id, Arc::new(program));
        program_id
    }

    /// The teams that an agent can reach, the root first, each once, in order of discovery.
    #[must_use]
    pub fn reachable(&self, root: TeamId) -> Vec<TeamId> {
        let mut found = vec![root];
        let mut seen = BTreeSet::from([root]);
        let mut next = 0;
        while let Some(team_id) = found.get(next).copied() {
            next += 1;
            for member in &self.team(team_id).members {
                if let Action::Team(target) = self.program(*member).action
                    && seen.insert(target)
                {
                    found.push(target);
                }
            }
        }
        found
    }

    /// Drops every team and program that no root reaches any more.
    pub fn collect(&mut self) {
        let mut teams = BTreeSet::new();
        let mut programs = BTreeSet::new();
        let mut open = self.roots.clone();
        while let Some(team_id) = open.pop() {
            if !teams.insert(team_id) {
                continue;
            }
            for member in &self.team(team_id).members {
                programs.insert(*member);
                if let Action::Team(target) = self.program(*member).action {
                    open.push(target);
                }
            }
        }
        self.teams.retain(|id, _| teams.contains(id));
        self.programs.retain(|id, _| programs.contains(id));
    }

    /// Whether every team and program that is named exists.
    pub(crate) fn is_closed(&self) -> bool {
        let leads_somewhere = |program: &Arc<Program>| match program.action {
            Action::Team(target) => self.teams.contains_key(&target),
            Action::Atomic(_) => true,
        };
        let members = self.teams.values().flat_map(|team| &team.members);
        self.roots.iter().all(|r| self.teams.contains_key(r))
            && members.into_iter().all(|m| self.programs.contains_key(m))
            && self.programs.values().all(leads_somewhere)
    }

    /// Whether these members make a team: one of them is atomic, or one for each output that has programs of its own.
    #[must_use]
    pub fn is_team(&self, members: &[ProgramId], shape: &Shape) -> bool {
        let any =
            |found: &dyn Fn(&Program) -> bool| members.iter().any(|m| found(self.program(*m)));
        match shape.action_programs {
            ActionPrograms::Winner => any(&Program::is_atomic),
            ActionPrograms::Each => {
                (0..shape.atomic_actions()).all(|k| any(&|p| p.action == Action::Atomic(k)))
            }
        }
    }
}

fn initial_size(range: SizeRange, rng: &mut Rng) -> usize {
    let choices = u64::from(range.initial_max.saturating_sub(range.initial_min)) + 1;
    range.initial_min as usize + rng.below(choices) as usize
}

/// Initial constants of a team's memory; none for a run without such memory.
fn random_memory(genes: &Genes, rng: &mut Rng) -> Arc<[f32]> {
    let len = if genes.team_memory {
        genes.shape.team_constants()
    } else {
        0
    };
    random_constants(genes, len, rng)
}
