//! A population: roots, and all teams and programs that they can reach.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::{Action, Program, ProgramId, Shape, Team, TeamId};

/// Roots, and all teams and programs that they can reach.
///
/// Teams and programs never change once they are in a population. Children are new ones. A program can therefore only lead to a
/// team older than itself, and the graph has no cycles.
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
    /// The team of this id.
    ///
    /// # Panics
    /// If the id is not of this population, or [`Population::collect`] has dropped the team.
    #[must_use]
    pub fn team(&self, team_id: TeamId) -> &Arc<Team> {
        &self.teams[&team_id]
    }

    /// The program of this id.
    ///
    /// # Panics
    /// If the id is not of this population, or [`Population::collect`] has dropped the program.
    #[must_use]
    pub fn program(&self, program_id: ProgramId) -> &Arc<Program> {
        &self.programs[&program_id]
    }

    /// Whether there is a team of this id.
    pub(crate) fn has_team(&self, team_id: TeamId) -> bool {
        self.teams.contains_key(&team_id)
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
    pub fn add_team(&mut self, mut team: Team) -> TeamId {
        team.members.shrink_to_fit();
        let team_id = TeamId(self.next_team);
        self.next_team += 1;
        self.teams.insert(team_id, Arc::new(team));
        team_id
    }

    /// Adds a program and names it.
    pub fn add_program(&mut self, mut program: Program) -> ProgramId {
        // Variation leaves room for instructions that may never come, in each of a hundred thousand programs.
        program.instructions.shrink_to_fit();
        let program_id = ProgramId(self.next_program);
        self.next_program += 1;
        self.programs.insert(program_id, Arc::new(program));
        program_id
    }

    /// The teams that a root can reach, each once, in the order of a breadth-first search. The root is the first.
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

    /// Drops every team and program that no root can reach any more.
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
    pub(super) fn is_closed(&self) -> bool {
        let leads_somewhere = |program: &Arc<Program>| match program.action {
            Action::Team(target) => self.teams.contains_key(&target),
            Action::Atomic(_) => true,
        };
        let members = self.teams.values().flat_map(|team| &team.members);
        self.roots.iter().all(|r| self.teams.contains_key(r))
            && members.into_iter().all(|m| self.programs.contains_key(m))
            && self.programs.values().all(leads_somewhere)
    }

    /// Whether these programs make a team: one of them must be atomic. Where outputs have programs of their own, each output must
    /// have one.
    #[must_use]
    pub fn is_team(&self, members: &[ProgramId], shape: &Shape) -> bool {
        let any =
            |found: &dyn Fn(&Program) -> bool| members.iter().any(|m| found(self.program(*m)));
        match shape.separate_outputs() {
            0 => any(&Program::is_atomic),
            outputs => (0..outputs).all(|k| any(&|p| p.action == Action::Atomic(k))),
        }
    }
}
