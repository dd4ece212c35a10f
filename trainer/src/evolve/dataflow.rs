//! Which registers and slots of memory code reads and writes, and which of its instructions can matter.

use tpg_runtime::isa::{Group, Op, Operand};
use tpg_runtime::tables::Section;

use super::{Instruction, Registers, Source};

impl Registers {
    /// The registers that code names.
    pub(crate) fn named(code: &[Instruction]) -> Self {
        let mut registers = Registers::default();
        for instruction in code {
            if let Some(section) = register_written(instruction.op) {
                registers.insert(section, instruction.destination);
            }
            registers.insert_reads(instruction, u8::MAX);
        }
        registers
    }

    /// The slots of team memory that code reads.
    pub(crate) fn slots_read(code: &[Instruction]) -> Self {
        let mut slots = Registers::default();
        for (section, slot) in code.iter().filter_map(slot_read) {
            slots.insert(section, slot);
        }
        slots
    }

    /// Adds the registers that an instruction reads. A write of indexed memory stores register c in column c: it reads those of
    /// these columns.
    fn insert_reads(&mut self, instruction: &Instruction, columns: u8) {
        let kinds = instruction.op.operands();
        for (kind, source) in kinds.into_iter().zip([&instruction.a, &instruction.b]) {
            if let Some((section, register)) = register_read(kind, source) {
                self.insert(section, register);
            }
        }
        if instruction.op == Op::MemWrite {
            self.0[Section::Scalar as usize] |= columns;
        }
    }
}

/// The register that a source of this kind reads, if it reads one.
pub(crate) fn register_read(kind: Operand, source: &Source) -> Option<(Section, u8)> {
    if source.observed {
        return None;
    }
    let section = match kind {
        Operand::S => Section::Scalar,
        Operand::SOrVElement if !source.of_vector => Section::Scalar,
        Operand::V | Operand::VElement | Operand::SOrVElement => Section::Vector,
        Operand::M | Operand::MElement => Section::Matrix,
        _ => return None,
    };
    Some((section, source.register))
}

/// The kind of register that an instruction writes, if it writes one.
pub(crate) fn register_written(op: Op) -> Option<Section> {
    op.destination().section()
}

/// The section of team memory that an instruction reads, with its slot.
pub(crate) fn slot_read(instruction: &Instruction) -> Option<(Section, u8)> {
    register_written(instruction.op)?;
    Some((instruction.op.section()?, instruction.a.register))
}

/// What outside a program depends on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Demand {
    /// Registers read after a run: bid and action.
    pub results: Registers,
    /// Whether registers are kept from run to run.
    pub stateful: bool,
    /// Sections of team memory that a team of this program reads.
    pub sections: [bool; 3],
    /// Columns of indexed memory that some program reads.
    pub columns: u8,
}

impl Demand {
    /// Every write of memory matters.
    pub(crate) const fn all(results: Registers, stateful: bool) -> Self {
        Demand {
            results,
            stateful,
            sections: [true; 3],
            columns: u8::MAX,
        }
    }
}

/// Which of the instructions can influence what is demanded.
pub(crate) fn effective(instructions: &[Instruction], demand: &Demand) -> Vec<bool> {
    analyse(instructions, demand).0
}

/// The registers whose initial values can influence what is demanded. They are live when the code first runs, or effective code
/// reloads them.
pub(crate) fn initial_registers(code: &[Instruction], demand: &Demand) -> Registers {
    let (keep, mut initial) = analyse(code, demand);
    for (instruction, _) in code.iter().zip(keep).filter(|(_, keep)| *keep) {
        if instruction.op.group() == Group::Constants
            && let Some(section) = register_written(instruction.op)
        {
            initial.insert(section, instruction.destination);
        }
    }
    initial
}

/// The effective instructions, and the registers that are live before the first of them.
///
/// Makes a backward pass over the code. With stateful registers it repeats the pass until all that is live at the start is live at
/// the end.
fn analyse(instructions: &[Instruction], demand: &Demand) -> (Vec<bool>, Registers) {
    let mut live_at_end = demand.results;
    loop {
        let mut live = live_at_end;
        let mut keep = vec![false; instructions.len()];
        for (keep, instruction) in keep.iter_mut().zip(instructions).rev() {
            *keep = pass(instruction, demand, &mut live);
        }
        let next = live_at_end.union(live);
        if !demand.stateful || next == live_at_end {
            return (keep, live);
        }
        live_at_end = next;
    }
}

/// Updates the live registers backwards across one instruction. Returns whether the instruction is effective.
fn pass(instruction: &Instruction, demand: &Demand, live: &mut Registers) -> bool {
    let op = instruction.op;
    let written = register_written(op).map(|section| (section, instruction.destination));
    let needed = match written {
        Some((section, register)) => live.contains(section, register),
        None if op == Op::MemWrite => demand.columns != 0,
        None => op.section().is_some_and(|s| demand.sections[s as usize]),
    };
    if !needed {
        return false;
    }
    if let Some((section, register)) = written
        && !op.destination().is_update()
    {
        live.remove(section, register);
    }
    live.insert_reads(instruction, demand.columns);
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scalar(op: Op, destination: u8, a: u8, b: u8) -> Instruction {
        Instruction {
            op,
            destination,
            a: Source::register(a),
            b: Source::register(b),
        }
    }

    fn demand(stateful: bool) -> Demand {
        Demand {
            results: Registers([1, 0, 0]),
            stateful,
            sections: [false; 3],
            columns: 0,
        }
    }

    #[test]
    fn overwritten_and_unread_results_are_dropped() {
        let code = [
            scalar(Op::Add, 0, 1, 2),
            scalar(Op::Sub, 3, 1, 1),
            scalar(Op::Mul, 0, 4, 4),
        ];
        assert_eq!(effective(&code, &demand(false)), [false, false, true]);
    }

    #[test]
    fn stateful_registers_carry_liveness_into_the_next_run() {
        // s0 reads s3 before s3 is written: only a later run sees the write.
        let code = [scalar(Op::Add, 0, 3, 3), scalar(Op::Sub, 3, 1, 1)];
        assert_eq!(effective(&code, &demand(false)), [true, false]);
        assert_eq!(effective(&code, &demand(true)), [true, true]);
    }

    #[test]
    fn a_constant_is_read_before_it_is_overwritten_or_when_it_is_reloaded() {
        // s0 = s3 + s4; s3 = s1 - s1: the constants of s1, s3, s4 are read, that of s3 by the first run alone.
        let mut code = vec![scalar(Op::Add, 0, 3, 4), scalar(Op::Sub, 3, 1, 1)];
        assert_eq!(initial_registers(&code, &demand(true)).0, [0b1_1010, 0, 0]);
        code.insert(0, scalar(Op::Sub, 4, 5, 5));
        assert_eq!(initial_registers(&code, &demand(true)).0, [0b10_1010, 0, 0]);
        code.insert(1, scalar(Op::ReloadS, 4, 0, 0));
        assert_eq!(initial_registers(&code, &demand(true)).0, [0b1_1010, 0, 0]);
    }

    #[test]
    fn the_conditional_reads_what_it_may_leave() {
        for op in [Op::Cond, Op::Latch] {
            let code = [scalar(Op::Add, 0, 1, 2), scalar(op, 0, 3, 4)];
            assert_eq!(effective(&code, &demand(false)), [true, true]);
        }
    }

    #[test]
    fn a_latch_keeps_its_register_alive_and_a_move_does_not() {
        let wide = |op, destination, a, b| Instruction {
            op,
            destination,
            a: Source::register(a),
            b: Source::register(b),
        };
        // v1 = v2 .* v2; if s1 > 0: v1 = v3; s0 = norm(v1).
        let mut code = [
            wide(Op::VMul, 1, 2, 2),
            wide(Op::VLatch, 1, 1, 3),
            wide(Op::VNorm, 0, 1, 0),
        ];
        assert_eq!(effective(&code, &demand(false)), [true, true, true]);
        assert_eq!(
            initial_registers(&code, &demand(false)).0,
            [0b10, 0b1100, 0]
        );
        code[1] = wide(Op::VMove, 1, 3, 0);
        assert_eq!(effective(&code, &demand(false)), [false, true, true]);
        assert_eq!(initial_registers(&code, &demand(false)).0, [0, 0b1000, 0]);
        // A latch into m0 from itself, read in the next run alone.
        let code = [wide(Op::MMean, 0, 0, 0), wide(Op::MLatch, 0, 1, 2)];
        assert_eq!(effective(&code, &demand(false)), [true, false]);
        assert_eq!(effective(&code, &demand(true)), [true, true]);
        assert_eq!(initial_registers(&code, &demand(true)).0, [0b10, 0, 0b101]);
    }

    #[test]
    fn a_write_matters_where_its_section_is_read() {
        let code = [scalar(Op::Add, 5, 1, 2), scalar(Op::WriteS, 0, 5, 0)];
        assert_eq!(effective(&code, &demand(false)), [false, false]);
        let mut read = demand(false);
        read.sections[0] = true;
        assert_eq!(effective(&code, &read), [true, true]);
    }

    #[test]
    fn dead_code_names_registers_too() {
        let code = [scalar(Op::MatVec, 2, 3, 4), scalar(Op::Add, 0, 1, 1)];
        assert_eq!(Registers::named(&code).0, [0b11, 0b1_0100, 0b1000]);
        assert_eq!(initial_registers(&code, &demand(true)).0, [0b10, 0, 0]);
        assert_eq!(
            initial_registers(&[], &demand(true)).0,
            [1, 0, 0],
            "the bid"
        );
    }
}
