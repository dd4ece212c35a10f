//! Initial values of registers, slots, cells and front ends.

use std::collections::BTreeSet;

use tpg_runtime::isa::{Destination, Form, Operand, REGISTERS};
use tpg_runtime::tables::{Instruction, Program, Section, Team};

use super::plan::{Function, Plan};
use tpg_runtime::registers::Location;

/// A register with its value after a reset.
#[derive(Debug, Clone)]
pub(super) struct Register {
    pub(super) section: Section,
    pub(super) number: usize,
    pub(super) values: Vec<f32>,
    /// Whether an instruction of its program writes it.
    pub(super) written: bool,
    /// Whether anything reads it.
    pub(super) read: bool,
}

/// A slot of a team's memory with its value after a reset.
#[derive(Debug, Clone)]
pub(super) struct Slot {
    pub(super) section: Section,
    pub(super) number: usize,
    pub(super) values: Vec<f32>,
}

/// A part of the memory that programs share.
#[derive(Debug, Clone, Copy)]
pub(super) enum Shared {
    Slot {
        team: u16,
        section: Section,
        number: usize,
    },
    /// All kept cells.
    Cells,
}

impl Plan<'_> {
    /// The columns that a front end's model describes.
    pub(super) fn believed(&self) -> Vec<u16> {
        let front_end = self.policy.front_end();
        let columns = front_end.map_or(&[][..], |front_end| front_end.columns);
        columns.iter().map(|c| u16::from_le_bytes(*c)).collect()
    }

    /// The initial values of `len` words. Their constants begin at `start` in the table.
    fn initial(&self, start: u32, len: usize) -> Vec<f32> {
        let constants = self.policy.tables().constants.iter().skip(start as usize);
        let values = constants.map(|x| f32::from_le_bytes(*x));
        values.chain(std::iter::repeat(0.0)).take(len).collect()
    }

    /// A program's registers: scalars, vectors, matrices.
    pub(super) fn registers(&self, number: u16) -> Vec<Register> {
        self.used_registers(number, self.written_and_read(number, |_| true))
    }

    /// A program's registers, of which these are written and read.
    fn used_registers(
        &self,
        number: u16,
        [written, read]: [BTreeSet<(u8, usize)>; 2],
    ) -> Vec<Register> {
        let program = self.program(number);
        let values = self.initial(program.constants_start, program.register_words(self.width));
        let mut rest = values.as_slice();
        let mut out = Vec::new();
        for (section, count) in Section::ALL.into_iter().zip(program.registers) {
            for number in 0..usize::from(count) {
                let (head, tail) = rest.split_at(section.slot_words(self.width));
                out.push(Register {
                    section,
                    number,
                    values: head.to_vec(),
                    written: written.contains(&(section as u8, number)),
                    read: read.contains(&(section as u8, number)),
                });
                rest = tail;
            }
        }
        out
    }

    /// The registers that the function of a program writes or reads.
    pub(super) fn mentioned(&self, function: Function) -> Vec<Register> {
        let number = function.program;
        let used = self.written_and_read(number, |i| self.has_effect(function, i));
        let mut registers = self.used_registers(number, used);
        registers.retain(|register| register.written || register.read);
        registers
    }

    /// Whether an instruction does anything in a function. A write to memory that nothing reads does not, nor does a move
    /// of a register to itself.
    pub(super) fn has_effect(&self, function: Function, i: &Instruction) -> bool {
        let keeps = |team: u16, section| self.teams[usize::from(team)].record.kept(section) != 0;
        match (i.op.form(), i.op.section()) {
            (Form::Write, Some(section)) => function.team.is_some_and(|team| keeps(team, section)),
            (Form::WriteCells, _) => !self.cells.is_empty(),
            (Form::Move, _) => i.op.operands()[0] == Operand::Cell || i.a != i.d,
            _ => true,
        }
    }

    /// The registers that those instructions of a program write that count, then those that they read, each as section and
    /// number. The end of the program counts as a read.
    fn written_and_read(
        &self,
        number: u16,
        counts: impl Fn(&Instruction) -> bool,
    ) -> [BTreeSet<(u8, usize)>; 2] {
        let program = self.program(number);
        let register = |at: u16| match self.locate(program, at) {
            Location::Window(_) => None,
            Location::Scalar(k) => Some((Section::Scalar as u8, k)),
            Location::Vector(k, _) => Some((Section::Vector as u8, k)),
            Location::Matrix(k, _) => Some((Section::Matrix as u8, k)),
        };
        // The bid is the first scalar register, so the program's end reads it.
        let mut read = BTreeSet::from([(Section::Scalar as u8, 0)]);
        let mut written = BTreeSet::new();
        if self.acts(number) {
            let outputs = (0..self.values() as u16).map(|k| program.output + k);
            read.extend(outputs.filter_map(register));
        } else {
            read.extend(register(program.output));
        }
        for i in self.code(number).filter(|i| counts(i)) {
            if i.op.destination() != Destination::None {
                written.extend(register(i.d));
            }
            if i.op.destination().is_update() {
                read.extend(register(i.d));
            }
            for (kind, at) in i.op.operands().into_iter().zip([i.a, i.b]) {
                if kind.is_value() {
                    read.extend(register(at));
                }
            }
            if i.op.form() == Form::WriteCells {
                read.extend((0..REGISTERS).map(|k| (Section::Scalar as u8, k)));
            }
        }
        [written, read]
    }

    /// The evolved constants of the register that begins at an offset.
    pub(super) fn constants_at(&self, number: u16, location: Location) -> Vec<f32> {
        let (section, k) = match location {
            Location::Vector(k, _) => (Section::Vector, k),
            Location::Matrix(k, _) => (Section::Matrix, k),
            Location::Scalar(k) | Location::Window(k) => (Section::Scalar, k),
        };
        let mut registers = self.registers(number).into_iter();
        let same = registers.find(|r| r.section == section && r.number == k);
        same.map(|register| register.values).unwrap_or_default()
    }

    /// The kept slots of a team in state order.
    pub(super) fn slots(&self, team: &Team) -> Vec<Slot> {
        let memory = self.policy.tables().memory;
        let words = team.memory_words(self.width);
        let values = if memory.is_empty() {
            self.initial(team.constants_start, words)
        } else {
            let from = usize::from(team.memory_start) - self.memory_start();
            floats(memory.get(from..).unwrap_or_default())
        };
        let mut rest = values.as_slice();
        let mut out = Vec::new();
        for section in Section::ALL {
            for number in (0..8).filter(|slot| team.kept(section) & (1 << slot) != 0) {
                let (head, tail) = rest.split_at(section.slot_words(self.width));
                out.push(Slot {
                    section,
                    number,
                    values: head.to_vec(),
                });
                rest = tail;
            }
        }
        out
    }

    /// The values of the kept cells after a reset.
    pub(super) fn cell_values(&self) -> Vec<f32> {
        let memory = self.policy.tables().memory;
        if memory.is_empty() {
            return vec![0.0; self.cells.len()];
        }
        floats(&memory[memory.len() - self.cells.len()..])
    }

    /// The parts of the shared memory in state order, each with its number of words.
    pub(super) fn shared(&self) -> Vec<(Shared, usize)> {
        let mut shared = Vec::new();
        for (team, record) in self.remembering() {
            shared.extend(self.slots(record).into_iter().map(|slot| {
                let Slot {
                    section, number, ..
                } = slot;
                let piece = Shared::Slot {
                    team,
                    section,
                    number,
                };
                (piece, slot.values.len())
            }));
        }
        if self.is_indexed() {
            shared.push((Shared::Cells, self.cells.len()));
        }
        shared
    }

    fn memory_start(&self) -> usize {
        let registers = self
            .programs
            .iter()
            .map(|p: &Program| p.register_words(self.width));
        self.policy.header().registers_start() + registers.sum::<usize>()
    }

    /// The number of words of shared memory.
    pub(super) fn memory_words(&self) -> usize {
        self.policy.header().words as usize - self.memory_start()
    }
}

/// The sections of memory that a team keeps.
pub(super) fn sections(team: &Team) -> impl Iterator<Item = Section> + use<'_> {
    let kept = |section: &Section| team.kept(*section) != 0;
    Section::ALL.into_iter().filter(kept)
}

/// The numbers in a table.
pub(super) fn floats(words: &[[u8; 4]]) -> Vec<f32> {
    words.iter().map(|w| f32::from_le_bytes(*w)).collect()
}
