//! Clones a program inside its team, with a bid of its own. The team has more structure, and tuning has more constants.

use tpg_runtime::isa::{Destination, Op, REGISTERS};
use tpg_runtime::tables::Section;

use super::{Genes, Instruction, Population, Program, Registers, Shape, Source, Team};
use tpg_tasks::task::Rng;

/// Clones a program of the team, with a new bid, behind its last member. Returns whether it could.
///
/// The clone has its original's action and, where outputs have programs of their own, its output. It bids bᵀo + c, where o is
/// the observation, b ~ N(0, 1/W) and c = 0. If the original's code computes a bid, this is added to it. b and c lie in registers
/// that the code does not name. The program to clone is drawn among the atomic ones that have such registers and would not come to
/// more than `most` instructions. Without one, without constants, or without the operations `dot` and `add`, nothing is cloned.
pub fn grow(
    population: &mut Population,
    team: &mut Team,
    genes: &Genes,
    most: usize,
    rng: &mut Rng,
) -> bool {
    let candidates: Vec<(Program, Free)> = team
        .members
        .iter()
        .map(|id| population.program(*id))
        .filter(|program| program.is_atomic() && genes.constants)
        .filter_map(|program| {
            Some((
                Program::clone(program),
                Free::of(&program.instructions, &genes.shape)?,
            ))
        })
        .filter(|(program, free)| program.instructions.len() + free.instructions() <= most)
        .collect();
    if candidates.is_empty() || ![Op::Dot, Op::Add].iter().all(|op| genes.ops.contains(op)) {
        return false;
    }
    let at = rng.below(candidates.len() as u64) as usize;
    let Some((mut program, free)) = candidates.into_iter().nth(at) else {
        return false;
    };
    free.append_bid(&mut program.instructions);
    let (width, code) = (genes.shape.width, &program.instructions);
    let constants = &mut program.constants;
    constants.fit(genes.initial_registers(code), width, || 0.0);
    let deviation = f64::from(width).sqrt();
    constants.set(Section::Vector, free.vector, width, || {
        (rng.normal() / deviation) as f32
    });
    constants.set(Section::Scalar, free.offset, width, || 0.0);
    team.members.push(population.add_program(program));
    true
}

/// Registers for a new bid, which the code does not name.
struct Free {
    vector: u8,
    offset: u8,
    /// Register of the product bᵀo where the code computes a bid to add it to. `None`: the product replaces the bid.
    product: Option<u8>,
}

/// The registers of a section that code does not name, ascending. Those of the bid and of the outputs are never among them.
pub(super) fn unnamed(
    code: &[Instruction],
    section: Section,
    shape: &Shape,
) -> impl Iterator<Item = u8> + use<> {
    let fixed = Registers([0b11, 0b10, 0]).union(shape.results());
    let taken = fixed.union(Registers::named(code));
    (0..REGISTERS as u8).filter(move |k| !taken.contains(section, *k))
}

impl Free {
    fn of(code: &[Instruction], shape: &Shape) -> Option<Free> {
        let mut scalars = unnamed(code, Section::Scalar, shape);
        let vector = unnamed(code, Section::Vector, shape).next()?;
        let offset = scalars.next()?;
        // A stateful bid that is only added to would grow without end.
        let computed = code
            .iter()
            .any(|i| i.op.destination() == Destination::S && i.destination == 0);
        let product = if computed {
            Some(scalars.next()?)
        } else {
            None
        };
        Some(Free {
            vector,
            offset,
            product,
        })
    }

    /// How many instructions [`append_bid`](Self::append_bid) adds.
    const fn instructions(&self) -> usize {
        2 + self.product.is_some() as usize
    }

    fn append_bid(&self, code: &mut Vec<Instruction>) {
        let register = Source::register;
        code.push(Instruction {
            op: Op::Dot,
            destination: self.product.unwrap_or(0),
            a: register(self.vector),
            b: Source::observation(0),
        });
        code.extend(
            self.product
                .into_iter()
                .chain([self.offset])
                .map(|term| Instruction {
                    op: Op::Add,
                    destination: 0,
                    a: register(0),
                    b: register(term),
                }),
        );
    }
}
