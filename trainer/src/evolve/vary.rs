//! New teams from old ones: crossover, then the team operators, then mutation of programs.

use std::sync::Arc;

use tpg_runtime::isa::Operand;

use super::genome::{Source, random_atomic};
use super::{
    Action, Constants, EvolutionParams, Genes, Instruction, Population, Program, ProgramId,
    ResetRule, Team, TeamId, effective, grow, remember,
};
use tpg_tasks::task::Rng;

/// Attempts at a crossover child that is a team and differs from both parents. After the last one a clone takes its place.
const ATTEMPTS: u32 = 100;

/// Makes the children of one generation.
pub struct Variation<'a> {
    /// What genes programs have.
    pub genes: &'a Genes,
    /// Rates and sizes.
    pub params: &'a EvolutionParams,
    /// Every root with its fitness, oldest first.
    pub scores: &'a [(TeamId, f64)],
}

/// A new root.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Child {
    /// Its name.
    pub team: TeamId,
    /// The parent that it was cloned from; the first parent of a crossover child.
    pub parent: TeamId,
}

/// Teams and programs that were there before the generation's first child: what children point at and take programs from.
struct ParentPool {
    teams: Vec<TeamId>,
    programs: Vec<ProgramId>,
}

impl Variation<'_> {
    /// Adds the generation's children to the population as roots. Returns them, oldest first.
    pub fn children(&self, population: &mut Population, rng: &mut Rng) -> Vec<Child> {
        let parent_pool = ParentPool {
            teams: population.teams.keys().copied().collect(),
            programs: population.programs.keys().copied().collect(),
        };
        let children: Vec<Child> = (0..self.params.children)
            .map(|_| self.child(population, &parent_pool, rng))
            .collect();
        population.roots.extend(children.iter().map(|c| c.team));
        children
    }

    fn child(&self, population: &mut Population, parent_pool: &ParentPool, rng: &mut Rng) -> Child {
        let (parent, mut team) = self.crossover_or_clone(population, rng);
        self.vary_members(population, parent_pool, &mut team, rng);
        self.mutate_programs(population, parent_pool, &mut team, rng);
        // With a rate of zero nothing is drawn, so that runs without these operators keep their random streams.
        let longest = self.params.program.size.max as usize;
        let (growth, max) = (self.params.team.grow, self.params.team.size.max as usize);
        if growth > 0.0 && rng.chance(growth) && team.members.len() < max {
            grow(population, &mut team, self.genes, longest, rng);
        }
        if self.params.team.remember > 0.0 && rng.chance(self.params.team.remember) {
            let at = rng.below(team.members.len() as u64) as usize;
            if let Some(member) = remember(population, team.members[at], self.genes, longest) {
                team.members[at] = member;
            }
        }
        let programs = team.members.iter().map(|id| &**population.program(*id));
        self.genes.fit_memory(&mut team.memory, programs, rng);
        if !team.memory.is_empty() && rng.chance(self.params.constants.mutate) {
            team.memory = self.mutate_constants(&team.memory, rng);
        }
        if team.reset_rule.is_some() && rng.chance(self.params.team.reset) {
            team.reset_rule = Some(ResetRule::random(rng));
        }
        Child {
            team: population.add_team(team),
            parent,
        }
    }

    /// The winner of a tournament among random roots.
    fn parent(&self, rng: &mut Rng) -> TeamId {
        let mut draw = || self.scores[rng.below(self.scores.len() as u64) as usize];
        let mut best = draw();
        for _ in 1..self.params.tournament {
            let other = draw();
            if self.params.ties.rank(other, best).is_lt() {
                best = other;
            }
        }
        best.0
    }

    /// A child of two parents, or a clone of one. Returns it with its parent, the first one of two.
    fn crossover_or_clone(&self, population: &Population, rng: &mut Rng) -> (TeamId, Team) {
        let params = &self.params.team;
        if rng.chance(params.crossover) {
            for _ in 0..ATTEMPTS {
                let [parent, other] = [self.parent(rng), self.parent(rng)];
                let [first, second] = [parent, other].map(|id| population.team(id));
                let mut members: Vec<ProgramId> = Vec::new();
                for member in first.members.iter().chain(&second.members) {
                    if rng.chance(params.inherit) && !members.contains(member) {
                        members.push(*member);
                    }
                }
                members.truncate(params.size.max as usize);
                let copy = members == first.members || members == second.members;
                if !copy && population.is_team(&members, &self.genes.shape) {
                    let memory = first.memory.clone();
                    let child = Team {
                        members,
                        memory,
                        stream_key: first.stream_key,
                        reset_rule: first.reset_rule,
                    };
                    return (parent, child);
                }
            }
        }
        let parent = self.parent(rng);
        (parent, Team::clone(population.team(parent)))
    }

    /// Deletes, adds and moves programs, each with its rate.
    fn vary_members(
        &self,
        population: &Population,
        parent_pool: &ParentPool,
        team: &mut Team,
        rng: &mut Rng,
    ) {
        let params = &self.params.team;
        let mut rate = params.delete;
        while team.members.len() > 1 && rng.chance(rate) {
            let at = rng.below(team.members.len() as u64) as usize;
            let removed = team.members.remove(at);
            if !population.is_team(&team.members, &self.genes.shape) {
                team.members.insert(at, removed);
            }
            rate = if params.repeat {
                rate * params.delete
            } else {
                0.0
            };
        }
        let mut rate = params.add;
        while team.members.len() < params.size.max as usize && rng.chance(rate) {
            let added = parent_pool.programs[rng.below(parent_pool.programs.len() as u64) as usize];
            if !team.members.contains(&added) {
                team.members.push(added);
            }
            rate = if params.repeat {
                rate * params.add
            } else {
                0.0
            };
        }
        if rng.chance(params.reorder) {
            let len = team.members.len() as u64;
            let moved = team.members.remove(rng.below(len) as usize);
            team.members.insert(rng.below(len) as usize, moved);
        }
    }

    /// Replaces each program by a mutated clone with the rate `mutate`, and at least one.
    fn mutate_programs(
        &self,
        population: &mut Population,
        parent_pool: &ParentPool,
        team: &mut Team,
        rng: &mut Rng,
    ) {
        let size = team.members.len();
        let rate = match self.params.team.mutate {
            0.0 => 1.0 / size as f64,
            rate => rate,
        };
        let mut chosen: Vec<usize> = (0..size).filter(|_| rng.chance(rate)).collect();
        if chosen.is_empty() {
            chosen.push(rng.below(size as u64) as usize);
        }
        for at in chosen {
            let before = Program::clone(population.program(team.members[at]));
            let mut program = before.clone();
            self.mutate_program(population, parent_pool, team, at, &mut program, rng);
            let mut attempts = 1;
            while self.params.program.insist
                && attempts < ATTEMPTS
                && !self.differs(&before, &program)
            {
                self.mutate_program(population, parent_pool, team, at, &mut program, rng);
                attempts += 1;
            }
            team.members[at] = population.add_program(program);
        }
    }

    /// Varies a program of a team: its code, its constants, its action and its offset, each with its rate.
    fn mutate_program(
        &self,
        population: &mut Population,
        parent_pool: &ParentPool,
        team: &Team,
        at: usize,
        program: &mut Program,
        rng: &mut Rng,
    ) {
        if rng.chance(self.params.program.code) {
            self.mutate_code(program, rng);
            let code = &program.instructions;
            self.genes.fit_program(&mut program.constants, code, rng);
        }
        if !program.constants.is_empty() && rng.chance(self.params.constants.mutate) {
            program.constants = self.mutate_constants(&program.constants, rng);
        }
        if rng.chance(self.params.program.action) {
            self.mutate_action(population, parent_pool, team, at, program, rng);
        }
        if rng.chance(self.params.program.offset) {
            program.offset = rng.below(u64::from(self.genes.shape.observed())) as u16;
        }
    }

    /// Whether two programs can decide differently: in action, in constants, in effective instructions, or in the part of the
    /// observation that these read as a vector or matrix.
    fn differs(&self, a: &Program, b: &Program) -> bool {
        let effective_code = |program: &Program| -> Vec<Instruction> {
            let keep = effective(&program.instructions, &self.genes.demand());
            let kept = program.instructions.iter().zip(keep);
            kept.filter(|(_, keep)| *keep).map(|(i, _)| *i).collect()
        };
        let (code_a, code_b) = (effective_code(a), effective_code(b));
        let reads_observation = |i: &Instruction| {
            let operands = i.op.operands().into_iter().zip([i.a, i.b]);
            operands.into_iter().any(|(kind, source)| {
                source.observed && kind != Operand::S && kind != Operand::None
            })
        };
        a.action != b.action
            || a.constants != b.constants
            || code_a != code_b
            || a.offset != b.offset && code_a.iter().any(reads_observation)
    }

    /// Changes, swaps, deletes and adds instructions, each with its rate.
    fn mutate_code(&self, program: &mut Program, rng: &mut Rng) {
        let params = &self.params.program;
        let code = &mut program.instructions;
        if rng.chance(params.change) {
            let at = rng.below(code.len() as u64) as usize;
            code[at] = self.change(code[at], rng);
        }
        if rng.chance(params.swap) {
            let len = code.len() as u64;
            code.swap(rng.below(len) as usize, rng.below(len) as usize);
        }
        if rng.chance(params.delete) && code.len() > 1 {
            code.remove(rng.below(code.len() as u64) as usize);
        }
        if rng.chance(params.add) && code.len() < params.size.max as usize {
            let at = rng.below(code.len() as u64 + 1) as usize;
            code.insert(at, Instruction::random(self.genes, rng));
        }
    }

    /// Draws all of the instruction anew, or its destination, or one operand. Each of the four is equally probable.
    fn change(&self, mut instruction: Instruction, rng: &mut Rng) -> Instruction {
        let fresh = Instruction::random(self.genes, rng);
        let shape = &self.genes.shape;
        let [a, b] = instruction.op.operands();
        match rng.below(4) {
            0 => return fresh,
            1 => instruction.destination = fresh.destination,
            2 => instruction.a = Source::random(a, shape, rng),
            _ => instruction.b = Source::random(b, shape, rng),
        }
        instruction
    }

    /// Scales every constant by a random factor and flips some signs (T §3.4.3).
    fn mutate_constants(&self, constants: &Constants, rng: &mut Rng) -> Constants {
        let params = &self.params.constants;
        let mutate = |x: &f32| {
            let scaled = f64::from(*x) * rng.uniform(params.factor_min, params.factor_max);
            let flipped = if rng.chance(params.flip) {
                -scaled
            } else {
                scaled
            };
            // Constants stay finite. A later factor below 1 brings them back from the largest number.
            (flipped as f32).clamp(f32::MIN, f32::MAX)
        };
        let values: Arc<[f32]> = constants.values().iter().map(mutate).collect();
        constants.with_values(values)
    }

    /// Draws a new action, unless the team would no longer be one: its last atomic program stays atomic, and an output's last
    /// program stays with that output.
    fn mutate_action(
        &self,
        population: &mut Population,
        parent_pool: &ParentPool,
        team: &Team,
        at: usize,
        program: &mut Program,
        rng: &mut Rng,
    ) {
        let shape = &self.genes.shape;
        let others: Vec<ProgramId> = (0..team.members.len())
            .filter(|k| *k != at)
            .map(|k| team.members[k])
            .collect();
        if shape.separate_outputs() > 0 {
            let action = random_atomic(shape, rng);
            if population.is_team(&others, shape) {
                program.action = action;
            }
            return;
        }
        if rng.chance(self.params.program.atomic) {
            program.action = random_atomic(shape, rng);
            return;
        }
        if !population.is_team(&others, shape) {
            return;
        }
        let mut target = parent_pool.teams[rng.below(parent_pool.teams.len() as u64) as usize];
        if population.roots.binary_search(&target).is_ok() {
            // A root that is pointed at would no longer be a root. A clone of it is pointed at instead.
            let clone = Team::clone(population.team(target));
            target = population.add_team(clone);
        }
        program.action = Action::Team(target);
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{genes, params};
    use super::super::{ActionPrograms, Registers, Ties};
    use super::*;

    /// Every invariant that evolution promises, checked over generations with random scores.
    #[test]
    fn invariants_hold_over_generations() {
        assert!(deepest(&genes()) >= 3, "no graph of teams emerged");
    }

    #[test]
    fn every_output_keeps_a_program() {
        let mut genes = genes();
        genes.shape.actions = tpg_tasks::task::ActionSpace::Continuous {
            len: 3,
            low: -1.0,
            high: 1.0,
        };
        genes.shape.action_programs = ActionPrograms::Each;
        assert_eq!(deepest(&genes), 1);
    }

    /// Evolves, checks what every population promises, and returns the most teams that an agent reached.
    fn deepest(genes: &Genes) -> usize {
        let params = params();
        let mut rng = Rng::new(11);
        let mut population = Population::random(genes, &params, &mut rng);
        let mut scores: Vec<(TeamId, f64)> = population
            .roots
            .iter()
            .map(|r| (*r, rng.uniform(0.0, 1.0)))
            .collect();
        let mut deepest = 0;
        for _ in 0..60 {
            let variation = Variation {
                genes,
                params: &params,
                scores: &scores,
            };
            for child in variation.children(&mut population, &mut rng) {
                scores.push((child.team, rng.uniform(0.0, 1.0)));
            }
            super::super::select(
                &mut population,
                &mut scores,
                params.population as usize,
                Ties::Older,
                &[],
            );
            assert_eq!(population.roots.len(), params.population as usize);
            assert_eq!(population.check(genes), Ok(()));
            for (id, team) in &population.teams {
                let sound = population.is_team(&team.members, &genes.shape);
                assert!(sound, "{id:?} lacks an exit or an output");
                assert!(team.members.len() <= params.team.size.max as usize);
                let members = team.members.iter().map(|m| population.program(*m));
                let slots = members
                    .map(|program| Registers::slots_read(&program.instructions))
                    .fold(Registers::default(), Registers::union);
                assert_eq!(team.memory.registers(), slots);
                for member in &team.members {
                    let program = population.program(*member);
                    let len = program.instructions.len();
                    assert!((1..=params.program.size.max as usize).contains(&len));
                    let constants = &program.constants;
                    let registers = genes.initial_registers(&program.instructions);
                    assert_eq!(constants.registers(), registers, "{program:?}");
                    let words = registers.words(genes.shape.width);
                    assert_eq!(constants.values().len(), words);
                    assert!(constants.values().iter().all(|x| x.is_finite()));
                    if let Action::Team(target) = program.action {
                        assert!(target < *id, "a pointer to a younger team");
                        assert!(!population.roots.contains(&target), "a demoted root");
                    }
                }
            }
            let depths = population
                .roots
                .iter()
                .map(|r| population.reachable(*r).len());
            deepest = deepest.max(depths.max().unwrap_or(0));
        }
        let rules: std::collections::BTreeSet<_> = (population.roots.iter())
            .filter_map(|root| population.team(*root).reset_rule.map(ResetRule::scope))
            .map(tpg_runtime::blob::ResetScope::name)
            .collect();
        assert!(rules.len() > 1, "rules of resets do not vary: {rules:?}");
        deepest
    }

    /// The mutated clones of a generation that are what they were, out of all.
    fn silent_clones(insist: bool) -> (usize, usize) {
        let (genes, mut params) = (genes(), params());
        params.program.insist = insist;
        let mut rng = Rng::new(9);
        let mut population = Population::random(&genes, &params, &mut rng);
        let scores: Vec<_> = population.roots.iter().map(|r| (*r, 0.0)).collect();
        let variation = Variation {
            genes: &genes,
            params: &params,
            scores: &scores,
        };
        let pool = ParentPool {
            teams: population.teams.keys().copied().collect(),
            programs: population.programs.keys().copied().collect(),
        };
        let (mut silent, mut all) = (0, 0);
        for (root, _) in &scores {
            let mut team = Team::clone(population.team(*root));
            let before = team.members.clone();
            variation.mutate_programs(&mut population, &pool, &mut team, &mut rng);
            for (old, new) in before
                .iter()
                .zip(&team.members)
                .filter(|(old, new)| old != new)
            {
                let differs = variation.differs(population.program(*old), population.program(*new));
                silent += usize::from(!differs);
                all += 1;
            }
        }
        (silent, all)
    }

    #[test]
    fn who_insists_makes_no_silent_clones() {
        let (silent, all) = silent_clones(false);
        assert!(5 * silent > all, "{silent} of {all}");
        let (silent, all) = silent_clones(true);
        assert!(silent == 0 && all >= 40, "{silent} of {all}");
    }

    #[test]
    fn a_crossover_child_has_programs_of_both_parents_only() {
        let (genes, params) = (genes(), params());
        let mut rng = Rng::new(5);
        let population = Population::random(&genes, &params, &mut rng);
        let scores: Vec<_> = population.roots.iter().map(|r| (*r, 0.0)).collect();
        let variation = Variation {
            genes: &genes,
            params: &params,
            scores: &scores,
        };
        for _ in 0..200 {
            let (_, child) = variation.crossover_or_clone(&population, &mut rng);
            assert!(population.is_team(&child.members, &genes.shape));
            assert!(
                child
                    .members
                    .iter()
                    .all(|m| population.programs.contains_key(m))
            );
        }
    }
}
