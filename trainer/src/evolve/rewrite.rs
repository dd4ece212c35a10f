//! Writes tuned constants back, as a new agent.

use std::collections::BTreeMap;

use super::{Action, Population, Program, ProgramId, Team, TeamId};

/// New constants of some programs and teams of an agent.
#[derive(Debug, Clone, Default)]
pub struct NewConstants {
    /// All constants of each program that changes, as many as it has.
    pub programs: BTreeMap<ProgramId, Vec<f32>>,
    /// All memory constants of each team that changes, as many as it has.
    pub teams: BTreeMap<TeamId, Vec<f32>>,
}

/// Adds an agent that differs from another one in these constants alone. Returns its root team, which is not yet among the
/// population's roots.
///
/// Teams and programs never change once they are in a population. So every team and program that leads to a new one is new
/// too. The rest is shared.
#[must_use]
pub fn rewrite_constants(
    population: &mut Population,
    root: TeamId,
    constants: &NewConstants,
) -> TeamId {
    let mut teams = population.reachable(root);
    // Programs lead to older teams only. In this order a target is rewritten before what points at it.
    teams.sort_unstable();
    let mut new_teams: BTreeMap<TeamId, TeamId> = BTreeMap::new();
    let mut new_programs: BTreeMap<ProgramId, ProgramId> = BTreeMap::new();
    for id in teams {
        let mut team = Team::clone(population.team(id));
        for member in &mut team.members {
            if !new_programs.contains_key(member) {
                let rewritten = rewrite_program(population, *member, constants, &new_teams);
                let new = rewritten.map_or(*member, |program| population.add_program(program));
                new_programs.insert(*member, new);
            }
            *member = new_programs[member];
        }
        if let Some(memory) = constants.teams.get(&id) {
            team.memory = team.memory.with_values(memory.as_slice());
        }
        // The root is always new, because it names another agent.
        if id == root || team != **population.team(id) {
            let new = population.add_team(team);
            new_teams.insert(id, new);
        }
    }
    new_teams[&root]
}

/// The program with its new constants and target, or `None` if neither changes.
fn rewrite_program(
    population: &Population,
    id: ProgramId,
    constants: &NewConstants,
    new_teams: &BTreeMap<TeamId, TeamId>,
) -> Option<Program> {
    let mut program = Program::clone(population.program(id));
    let mut changed = false;
    if let Some(constants) = constants.programs.get(&id) {
        program.constants = program.constants.with_values(constants.as_slice());
        changed = true;
    }
    if let Action::Team(target) = &mut program.action
        && let Some(new) = new_teams.get(target)
    {
        *target = *new;
        changed = true;
    }
    changed.then_some(program)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{genes, params};
    use super::*;
    use tpg_tasks::task::Rng;

    #[test]
    fn what_leads_to_something_new_is_new_and_the_rest_is_shared() {
        let mut rng = Rng::new(3);
        let mut population = Population::random(&genes(), &params(), &mut rng);
        let (inner, other) = (population.roots[0], population.roots[1]);
        let leaf = population.team(inner).members[0];
        let pointer = Program {
            action: Action::Team(inner),
            ..Program::clone(population.program(leaf))
        };
        let pointer = population.add_program(pointer);
        let mut outer = Team::clone(population.team(other));
        outer.members.insert(0, pointer);
        let outer = population.add_team(outer);
        let mut constants = NewConstants::default();
        let len = population.program(leaf).constants.values().len();
        constants.programs.insert(leaf, vec![2.0; len]);
        let new = rewrite_constants(&mut population, outer, &constants);
        assert_ne!(new, outer);
        assert_eq!(
            population.team(new).members[1..],
            population.team(outer).members[1..]
        );
        let Action::Team(target) = population.program(population.team(new).members[0]).action
        else {
            panic!("the pointer still leads to a team");
        };
        assert!(target != inner && target < new);
        let rewritten = population.program(population.team(target).members[0]);
        assert_eq!(rewritten.constants.values().to_vec(), vec![2.0; len]);
        assert_ne!(
            population.program(leaf).constants.values().to_vec(),
            vec![2.0; len]
        );
    }
}
