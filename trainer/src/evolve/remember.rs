//! Gives a program a running average of what it has observed, and gains on it, which tuning can then use.

use tpg_runtime::isa::Op;
use tpg_runtime::tables::Section;

use super::grow::unnamed;
use super::{Genes, Instruction, Population, Program, ProgramId, Shape, Source};

/// Initial share of the difference to the observation by which the average moves in each decision.
const INITIAL_RATE: f32 = 0.2;

/// The operations that a memory needs.
#[must_use]
pub fn memory_ops(shape: &Shape) -> Vec<Op> {
    let [product, sum] = output_ops(shape);
    vec![Op::VSub, Op::VScale, Op::VAdd, product, sum]
}

/// The operations that compute outputs from a vector and add to them.
fn output_ops(shape: &Shape) -> [Op; 2] {
    match shape.output_section() {
        Some(Section::Vector) => [Op::MatVec, Op::VAdd],
        _ => [Op::Dot, Op::Add],
    }
}

/// Adds a copy of a program that remembers what it observed.
///
/// The copy computes m ← m + r·(o − m) and output ← output + H·m; for discrete actions bid ← bid + hᵀm. Where outputs fill
/// several vectors, those of the first one get it. At first H is zero, so
/// that the copy does what its original does, and r is 0.2. All of this lies in registers that the code does not name, which
/// stateful programs keep.
///
/// Returns `None` in a run without constants or without [`memory_ops`], if there are too few registers, and if the copy would come
/// to more than `most` instructions. It also does if the code does not set the outputs by a product, because outputs that are only added to would grow without end.
pub fn remember(
    population: &mut Population,
    id: ProgramId,
    genes: &Genes,
    most: usize,
) -> Option<ProgramId> {
    let original = population.program(id).clone();
    let code = &original.instructions;
    if !genes.constants
        || !memory_ops(&genes.shape)
            .iter()
            .all(|op| genes.ops.contains(op))
    {
        return None;
    }
    let [product, sum] = output_ops(&genes.shape);
    // Among discrete actions the bid chooses.
    let output = u8::from(genes.shape.output_section().is_some());
    let mut sets_output = code.iter();
    if !sets_output.any(|i| i.op == product && i.destination == output) {
        return None;
    }
    let mut scalars = unnamed(code, Section::Scalar, &genes.shape);
    let mut vectors = unnamed(code, Section::Vector, &genes.shape);
    let rate = scalars.next()?;
    let (trace, change) = (vectors.next()?, vectors.next()?);
    let (kind, gains, part) = if product == Op::MatVec {
        let gains = unnamed(code, Section::Matrix, &genes.shape).next()?;
        (Section::Matrix, gains, change)
    } else {
        (Section::Vector, vectors.next()?, scalars.next()?)
    };
    let instruction = |op, destination, a, b| Instruction {
        op,
        destination,
        a,
        b,
    };
    let (observation, register) = (Source::observation(0), Source::register);
    let mut program = Program::clone(&original);
    program.instructions.extend([
        instruction(Op::VSub, change, observation, register(trace)),
        instruction(Op::VScale, change, register(rate), register(change)),
        instruction(Op::VAdd, trace, register(trace), register(change)),
        instruction(product, part, register(gains), register(trace)),
        instruction(sum, output, register(output), register(part)),
    ]);
    if program.instructions.len() > most {
        return None;
    }
    let (width, code) = (genes.shape.width, &program.instructions);
    let constants = &mut program.constants;
    constants.fit(genes.initial_registers(code), width, || 0.0);
    constants.set(kind, gains, width, || 0.0);
    constants.set(Section::Vector, trace, width, || 0.0);
    constants.set(Section::Scalar, rate, width, || INITIAL_RATE);
    Some(population.add_program(program))
}
