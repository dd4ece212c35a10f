//! Facts about a policy's graph that both languages need: which programs run in which team, and what cannot happen.

use std::collections::{BTreeMap, BTreeSet};

use tpg_runtime::Policy;
use tpg_runtime::blob::{ActionKind, MemoryModel, RegisterMode};
use tpg_runtime::isa::{Form, Op, Operand};
use tpg_runtime::registers::Location;
use tpg_runtime::tables::{Instruction, Program, ProgramId, Range, Target, Team, TeamId};

/// A policy with the facts that its graph gives about every decision.
pub(super) struct Plan<'p> {
    pub(super) policy: &'p Policy<'p>,
    pub(super) width: usize,
    pub(super) inputs: usize,
    /// Elements of all observations in the window.
    pub(super) observed: usize,
    pub(super) window: usize,
    pub(super) outputs: usize,
    /// Whether each output has its own programs.
    pub(super) each: bool,
    pub(super) stateful: bool,
    /// Kept cells of indexed memory.
    pub(super) cells: Vec<u16>,
    pub(super) programs: Vec<Program>,
    pub(super) teams: Vec<TeamPlan>,
    /// Programs that more than one team may run in the same decision.
    pub(super) cached: BTreeSet<u16>,
    /// Teams whose visits must be recorded, because some program must check them at run time.
    pub(super) marked: BTreeSet<u16>,
}

/// A team and those of its members that can take part in a decision.
pub(super) struct TeamPlan {
    pub(super) record: Team,
    /// Whether any decision can visit this team.
    pub(super) reached: bool,
    pub(super) members: Vec<Member>,
}

/// A program that takes part in its team's decision.
#[derive(Debug, Clone, Copy)]
pub(super) struct Member {
    pub(super) program: u16,
    /// If this team was already visited, the program takes no part.
    pub(super) unless_visited: Option<u16>,
}

/// A function to write. It runs one program. If the program uses team memory, it does so for one team.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Function {
    pub(super) program: u16,
    pub(super) team: Option<u16>,
}

impl<'p> Plan<'p> {
    /// Whether all outputs have the header's range.
    pub(super) fn has_one_range(&self) -> bool {
        let header = self.policy.header();
        let common = Range {
            low: header.action_low,
            high: header.action_high,
        };
        let mut ranges = self.policy.output_ranges();
        ranges.all(|range| range == common)
    }

    /// How many elements of earlier observations the window holds.
    pub(super) const fn earlier(&self) -> usize {
        self.observed.saturating_sub(self.inputs)
    }

    pub(super) fn new(policy: &'p Policy<'p>) -> Self {
        let (header, tables) = (policy.header(), policy.tables());
        let programs: Vec<Program> = tables.programs.iter().map(Program::from_bytes).collect();
        let records: Vec<Team> = tables.teams.iter().map(Team::from_bytes).collect();
        let members: Vec<Vec<u16>> = records.iter().map(|team| distinct(policy, team)).collect();
        let below = below(&programs, &members);
        let mut plan = Plan {
            policy,
            width: usize::from(header.width),
            inputs: usize::from(header.observation_len),
            observed: header.observed(),
            window: usize::from(header.window),
            outputs: header.outputs(),
            each: header.action_kind == ActionKind::Each,
            stateful: header.register_mode == RegisterMode::Stateful,
            cells: tables
                .cells
                .iter()
                .map(|c| u16::from_le_bytes(*c))
                .collect(),
            programs,
            teams: Vec::new(),
            cached: BTreeSet::new(),
            marked: BTreeSet::new(),
        };
        for (number, record) in records.into_iter().enumerate() {
            let number = number as u16;
            let list = members[usize::from(number)].iter();
            let member = |program: &u16| plan.member(number, *program, &below);
            let members = list.filter_map(member).collect();
            plan.teams.push(TeamPlan {
                record,
                reached: number == 0 || below[0].contains(&number),
                members,
            });
        }
        let reached = || {
            plan.teams
                .iter()
                .zip(0u16..)
                .filter(|(team, _)| team.reached)
        };
        let mut cached = BTreeSet::new();
        for (first, from) in reached() {
            for (second, _) in
                reached().filter(|(_, to)| *to != from && below[usize::from(from)].contains(to))
            {
                let ran: BTreeSet<u16> = first.members.iter().map(|m| m.program).collect();
                cached.extend(
                    second
                        .members
                        .iter()
                        .map(|m| m.program)
                        .filter(|p| ran.contains(p)),
                );
            }
        }
        let marked = reached()
            .flat_map(|(team, _)| &team.members)
            .filter_map(|m| m.unless_visited);
        plan.marked = marked.collect();
        plan.cached = cached;
        plan
    }

    /// Whether a program takes part in a team, and on what condition. `None` if its target team was certainly visited.
    fn member(&self, team: u16, program: u16, below: &[BTreeSet<u16>]) -> Option<Member> {
        let unless_visited = match self.program(program).target {
            Target::Atomic(_) => None,
            Target::Team(TeamId(next)) if next == 0 || next == team => return None,
            Target::Team(TeamId(next)) => below[usize::from(next)].contains(&team).then_some(next),
        };
        Some(Member {
            program,
            unless_visited,
        })
    }

    pub(super) fn program(&self, number: u16) -> &Program {
        &self.programs[usize::from(number)]
    }

    pub(super) fn code(&self, program: u16) -> impl Iterator<Item = Instruction> {
        let code = self.policy.tables().code(self.program(program));
        code.iter().filter_map(Instruction::from_bytes)
    }

    /// The teams that decisions can visit, with their numbers.
    pub(super) fn reached(&self) -> impl Iterator<Item = (u16, &TeamPlan)> {
        (0u16..).zip(&self.teams).filter(|(_, team)| team.reached)
    }

    /// The teams that keep memory, with their numbers.
    pub(super) fn remembering(&self) -> impl Iterator<Item = (u16, &Team)> {
        let teams = (0u16..).zip(self.teams.iter().map(|team| &team.record));
        teams.filter(|(_, team)| team.streams() > 0)
    }

    /// Every function to write, in the order of programs.
    pub(super) fn functions(&self) -> BTreeSet<Function> {
        let of_team = |(number, team): (u16, &TeamPlan)| -> Vec<Function> {
            team.members
                .iter()
                .map(|m| self.function(m.program, number))
                .collect()
        };
        self.reached().flat_map(of_team).collect()
    }

    /// The function that runs a program for a team.
    pub(super) fn function(&self, program: u16, team: u16) -> Function {
        let record = &self.teams[usize::from(team)].record;
        let touches = |i: Instruction| {
            i.op.section()
                .is_some_and(|section| record.kept(section) != 0)
        };
        Function {
            program,
            team: self.code(program).any(touches).then_some(team),
        }
    }

    /// Whether a program reads or writes indexed memory.
    pub(super) fn uses_cells(&self, program: u16) -> bool {
        let reads =
            |i: Instruction| i.op.operands()[0] == Operand::Cell || i.op.form() == Form::WriteCells;
        !self.cells.is_empty() && self.code(program).any(reads)
    }

    /// Whether any policy state is indexed memory.
    pub(super) fn is_indexed(&self) -> bool {
        self.policy.header().memory_model == MemoryModel::Indexed && !self.cells.is_empty()
    }

    /// The operations that the functions execute.
    pub(super) fn operations(&self) -> BTreeSet<Op> {
        let functions = self.functions();
        let code = functions.iter().flat_map(|f| self.code(f.program));
        code.map(|instruction| instruction.op).collect()
    }

    /// The programs that run and keep their registers.
    pub(super) fn stateful_programs(&self) -> BTreeSet<u16> {
        let ran = self.functions().into_iter().map(|f| f.program);
        ran.filter(|_| self.stateful).collect()
    }

    /// The programs that end a decision with a discrete action other than 0, each with its action.
    pub(super) fn actions(&self) -> BTreeMap<u16, u16> {
        let ran = self.functions().into_iter().map(|f| f.program);
        ran.filter_map(|program| match self.program(program).target {
            Target::Atomic(action) if action != 0 => Some((program, action)),
            _ => None,
        })
        .collect()
    }

    /// Whether a program ends a decision with a continuous action.
    pub(super) fn acts(&self, program: u16) -> bool {
        self.outputs > 0 && matches!(self.program(program).target, Target::Atomic(_))
    }

    /// The number of continuous action values that an acting program gives.
    pub(super) fn values(&self) -> usize {
        if self.each { 1 } else { self.outputs }
    }

    /// The output that a program gives, if each output has its own programs.
    pub(super) fn own_output(&self, program: u16) -> Option<u16> {
        match self.program(program).target {
            Target::Atomic(output) if self.each => Some(output),
            _ => None,
        }
    }

    /// Where a register or observation operand lies.
    pub(super) fn locate(&self, program: &Program, at: u16) -> Location {
        self.policy
            .locate(program, at)
            .expect("operands of a verified policy are registers or in the window")
    }

    /// The index of a kept cell among all kept cells.
    pub(super) fn cell(&self, at: u16) -> usize {
        let start = self.policy.header().words as usize - self.cells.len();
        usize::from(at) - start
    }
}

/// A team's programs without repetitions. A repeated program bids the same again, so it cannot win.
fn distinct(policy: &Policy<'_>, team: &Team) -> Vec<u16> {
    let mut seen = BTreeSet::new();
    let members = policy.tables().members(team).map(|ProgramId(p)| p);
    members.filter(|program| seen.insert(*program)).collect()
}

/// For each team, the teams that a decision may visit after it.
fn below(programs: &[Program], members: &[Vec<u16>]) -> Vec<BTreeSet<u16>> {
    let next = move |team: usize| {
        members[team].iter().filter_map(move |program| {
            match programs[usize::from(*program)].target {
                Target::Team(TeamId(next)) if next != 0 && usize::from(next) != team => Some(next),
                _ => None,
            }
        })
    };
    let reach = |start: usize| {
        let (mut found, mut open) = (BTreeSet::new(), vec![start]);
        while let Some(team) = open.pop() {
            for next in next(team) {
                if usize::from(next) != start && found.insert(next) {
                    open.push(usize::from(next));
                }
            }
        }
        found
    };
    (0..members.len()).map(reach).collect()
}
