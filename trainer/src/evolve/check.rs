//! Whether teams and programs are such as a run makes. Those of a file may be others.

use std::collections::BTreeMap;

use thiserror::Error;
use tpg_runtime::isa::{INDEXED_CELLS, Operand, REGISTERS, SLOTS};

use super::params::MOST_MEMBERS;
use super::{
    Action, Constants, Genes, Instruction, Population, Program, ProgramId, Source, Team, TeamId,
};

/// Largest id of a team or program, and latest generation. A run of years does not count so far.
pub(crate) const LARGEST_COUNT: u64 = u64::MAX / 4;

/// What no run makes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum PopulationError {
    /// A name that nothing has.
    #[error("it names teams or programs that it does not hold")]
    Missing,
    /// A program that no program of this run can be.
    #[error("program {} is none of this run: {why}", .program.0)]
    Program {
        /// The program.
        program: ProgramId,
        /// What is wrong with it.
        why: &'static str,
    },
    /// A team that no team of this run can be.
    #[error("team {} is none of this run: {why}", .team.0)]
    Team {
        /// The team.
        team: TeamId,
        /// What is wrong with it.
        why: &'static str,
    },
}

impl Population {
    /// Whether a run with these genes can have made it: everything that is named exists, no team leads back to itself, and each
    /// index is in range.
    ///
    /// # Errors
    /// [`PopulationError`] names the first team or program that cannot be.
    pub fn check(&self, genes: &Genes) -> Result<(), PopulationError> {
        if !self.is_closed() {
            return Err(PopulationError::Missing);
        }
        for (id, program) in &self.programs {
            let error = |why| PopulationError::Program { program: *id, why };
            if id.0 >= self.next_program || self.next_program > LARGEST_COUNT {
                return Err(error("its number is not below that of the next"));
            }
            genes.check_program(program).map_err(error)?;
        }
        for (id, team) in &self.teams {
            let error = |why| PopulationError::Team { team: *id, why };
            if id.0 >= self.next_team || self.next_team > LARGEST_COUNT {
                return Err(error("its number is not below that of the next"));
            }
            genes.check_team(team).map_err(error)?;
            if !self.is_team(&team.members, &genes.shape) {
                return Err(error("it lacks a program with an atomic action"));
            }
        }
        match self.in_a_cycle() {
            Some(team) => Err(PopulationError::Team {
                team,
                why: "it leads back to itself",
            }),
            None => Ok(()),
        }
    }

    /// A team that lies on a cycle or leads to one.
    fn in_a_cycle(&self) -> Option<TeamId> {
        let targets = |team: &Team| -> Vec<TeamId> {
            let actions = team.members.iter().map(|m| self.program(*m).action);
            let teams = actions.filter_map(|action| match action {
                Action::Team(target) => Some(target),
                Action::Atomic(_) => None,
            });
            teams.collect()
        };
        // Teams that lead to none but settled ones are settled, until no more are.
        let mut open: BTreeMap<TeamId, usize> = BTreeMap::new();
        let mut leading_to: BTreeMap<TeamId, Vec<TeamId>> = BTreeMap::new();
        for (id, team) in &self.teams {
            let targets = targets(team);
            open.insert(*id, targets.len());
            for target in targets {
                leading_to.entry(target).or_default().push(*id);
            }
        }
        let mut settled: Vec<TeamId> = open
            .iter()
            .filter(|(_, n)| **n == 0)
            .map(|(id, _)| *id)
            .collect();
        while let Some(team) = settled.pop() {
            open.remove(&team);
            for source in leading_to.get(&team).into_iter().flatten() {
                if let Some(left) = open.get_mut(source) {
                    *left -= 1;
                    if *left == 0 {
                        settled.push(*source);
                    }
                }
            }
        }
        open.into_keys().next()
    }
}

impl Genes {
    fn check_program(&self, program: &Program) -> Result<(), &'static str> {
        if program.instructions.is_empty() {
            return Err("it has no instruction");
        }
        if program.instructions.len() > usize::from(u16::MAX) {
            return Err("it has more instructions than a file can count");
        }
        if program.offset >= self.shape.observed().max(1) {
            return Err("its offset lies beyond the observation");
        }
        if let Action::Atomic(action) = program.action
            && action >= self.shape.atomic_actions()
        {
            return Err("the task does not have its action");
        }
        self.check_constants(&program.constants)?;
        let codes = &program.instructions;
        codes.iter().try_for_each(|i| self.check_instruction(i))
    }

    fn check_instruction(&self, instruction: &Instruction) -> Result<(), &'static str> {
        let Instruction { op, a, b, .. } = instruction;
        if !self.ops.contains(op) {
            return Err("this run does not use one of its operations");
        }
        if usize::from(instruction.destination) >= REGISTERS {
            return Err("it writes a register that does not exist");
        }
        let [kind_a, kind_b] = op.operands();
        if self.reads(a, kind_a) && self.reads(b, kind_b) {
            Ok(())
        } else {
            Err("it reads where nothing is")
        }
    }

    /// Whether an operand of this kind can be read there.
    fn reads(&self, source: &Source, kind: Operand) -> bool {
        let (register, element) = (usize::from(source.register), source.element);
        let elements = match kind {
            Operand::Cell => INDEXED_CELLS as u16,
            // Operands that are vectors or matrices may begin anywhere in the observation.
            _ => self.shape.observed().max(self.shape.square()),
        };
        let registers = match kind {
            Operand::ScalarSlot | Operand::VectorSlot | Operand::MatrixSlot => SLOTS,
            _ => REGISTERS,
        };
        register < registers && element < elements
    }

    fn check_team(&self, team: &Team) -> Result<(), &'static str> {
        if team.members.len() as u64 > MOST_MEMBERS {
            return Err("it has too many programs");
        }
        if team.reset_rule.is_some() != self.reset_rules {
            return Err("it has a rule of resets in a run without them, or none");
        }
        self.check_constants(&team.memory)
    }

    fn check_constants(&self, constants: &Constants) -> Result<(), &'static str> {
        let words = constants.registers().words(self.shape.width);
        if constants.values().len() == words {
            Ok(())
        } else {
            Err("its constants are more or fewer than its registers take")
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::Registers;
    use super::super::tests::{genes, params};
    use super::*;
    use tpg_tasks::task::Rng;

    /// What `check` says of a random population after a change to one of its programs and the team that has it.
    fn said(change: impl FnOnce(TeamId, &mut Team, &mut Program)) -> String {
        let genes = genes();
        let mut population = Population::random(&genes, &params(), &mut Rng::new(3));
        assert_eq!(population.check(&genes), Ok(()));
        let root = population.roots[0];
        let mut team = Team::clone(population.team(root));
        let member = team.members[0];
        let mut program = Program::clone(population.program(member));
        change(root, &mut team, &mut program);
        population.teams.insert(root, Arc::new(team));
        population.programs.insert(member, Arc::new(program));
        population
            .check(&genes)
            .map_or_else(|e| e.to_string(), |()| String::new())
    }

    #[test]
    fn what_no_run_makes_is_named() {
        let program = |change: fn(&mut Program)| said(|_, _, program| change(program));
        let cases = [
            (program(|p| p.instructions.clear()), "no instruction"),
            (
                program(|p| p.instructions[0].destination = 8),
                "a register that does not exist",
            ),
            (
                program(|p| p.instructions[0].a.register = 200),
                "reads where nothing is",
            ),
            (
                program(|p| p.instructions[0].b.element = 9999),
                "reads where nothing is",
            ),
            (
                program(|p| p.instructions[0].op = tpg_runtime::isa::Op::MatVec),
                "its operations",
            ),
            (program(|p| p.offset = 3), "beyond the observation"),
            (
                program(|p| p.action = Action::Atomic(3)),
                "does not have its action",
            ),
            (
                program(|p| p.action = Action::Team(TeamId(9999))),
                "does not hold",
            ),
            (
                program(|p| p.constants = Constants::from_parts(Registers::ALL, [0.0].into())),
                "more or fewer",
            ),
            (
                said(|root, _, program| program.action = Action::Team(root)),
                "back to itself",
            ),
            (said(|_, team, _| team.members.clear()), "an atomic action"),
            (
                said(|_, team, _| team.reset_rule = None),
                "a rule of resets",
            ),
        ];
        for (said, part) in cases {
            assert!(said.contains(part), "{said:?} does not say {part:?}");
        }
    }
}
