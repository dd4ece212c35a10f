//! Which constants programs and teams have.

use tpg_runtime::blob::RegisterMode;

use super::dataflow::{Demand, initial_registers};
use super::{Constants, Genes, Instruction, Program, Registers};
use tpg_tasks::task::Rng;

impl Genes {
    /// The registers of a program with this code that have constants: those whose initial values can matter.
    #[must_use]
    pub fn initial_registers(&self, code: &[Instruction]) -> Registers {
        initial_registers(code, &self.demand())
    }

    /// What may depend on a program, wherever it leads and whatever other programs read.
    pub(super) fn demand(&self) -> Demand {
        let stateful = self.register_mode == RegisterMode::Stateful;
        Demand::all(self.shape.results(), stateful)
    }

    /// The constants of a new program with this code, U[−1, 1]; none in a run without.
    #[must_use]
    pub fn program_constants(&self, code: &[Instruction], rng: &mut Rng) -> Constants {
        let mut constants = Constants::default();
        self.fit_program(&mut constants, code, rng);
        constants
    }

    /// Makes constants those of a program with this code. Those that it did not have are drawn, U[−1, 1].
    pub fn fit_program(&self, constants: &mut Constants, code: &[Instruction], rng: &mut Rng) {
        if self.constants {
            let registers = self.initial_registers(code);
            constants.fit(registers, self.shape.width, || initial_constant(rng));
        }
    }

    /// Makes constants those of the memory of a team with these programs. Those that it did not have are drawn, U[−1, 1].
    pub fn fit_memory<'a>(
        &self,
        constants: &mut Constants,
        programs: impl Iterator<Item = &'a Program>,
        rng: &mut Rng,
    ) {
        if self.constants && self.team_memory {
            let slots = programs
                .map(|program| Registers::slots_read(&program.instructions))
                .fold(Registers::default(), Registers::union);
            constants.fit(slots, self.shape.width, || initial_constant(rng));
        }
    }
}

/// An initial constant, U[−1, 1].
fn initial_constant(rng: &mut Rng) -> f32 {
    rng.uniform(-1.0, 1.0) as f32
}
