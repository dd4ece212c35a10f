//! Instructions on vectors, matrices, constants and shared memory.

use super::rows::{
    each_row, elements, map_matrix, map_vector, matrix, put_matrix, put_row, vector, zip_matrix,
    zip_vector,
};
use super::scalars::{load, store};
use super::shared::{read, read_whole, reload, write, write_indexed};
use super::{Code, Shared};
use crate::isa::Op;
use crate::math;
use crate::tables::{Instruction, Program, Section, Team};
use crate::trace::Observer;
use crate::verify::Policy;

/// Runs instructions that touch vectors, matrices, constants or shared memory up to the first scalar one and returns
/// what is left from there.
#[inline(never)]
pub fn wides<'c, const W: usize, O: Observer>(
    policy: &Policy<'_>,
    words: &mut [f32],
    shared: &mut Shared<'_, O>,
    team: &Team,
    program: &Program,
    code: Code<'c>,
) -> Code<'c> {
    let mut rest = code;
    while let [bytes, tail @ ..] = rest {
        let Some(i) = Instruction::from_bytes(bytes) else {
            return &[];
        };
        let [d, a, b] = [i.d, i.a, i.b].map(usize::from);
        match i.op {
            Op::VAdd => zip_vector::<W>(words, [d, a, b], math::add),
            Op::VSub => zip_vector::<W>(words, [d, a, b], math::sub),
            Op::VMul => zip_vector::<W>(words, [d, a, b], math::mul),
            Op::VDiv => zip_vector::<W>(words, [d, a, b], math::div),
            Op::VMin => zip_vector::<W>(words, [d, a, b], math::min),
            Op::VMax => zip_vector::<W>(words, [d, a, b], math::max),
            Op::VAbs => map_vector::<W>(words, [d, a], math::abs),
            Op::VRecip => map_vector::<W>(words, [d, a], math::recip),
            Op::VHeaviside => map_vector::<W>(words, [d, a], math::heaviside),
            Op::VScale => {
                let s = load(words, i.a);
                map_vector::<W>(words, [d, b], |x| math::mul(s, x));
            }
            Op::VBroadcast => put_row(words, d, &[load(words, i.a); W]),
            Op::Dot => store(
                words,
                i.d,
                math::dot(vector::<W>(words, a), vector::<W>(words, b)),
            ),
            Op::VNorm => store(words, i.d, math::norm(vector::<W>(words, a))),
            Op::VMean => store(words, i.d, math::mean(vector::<W>(words, a))),
            Op::VStd => store(words, i.d, math::std(vector::<W>(words, a))),
            Op::MatVec => {
                let x = vector(words, b);
                if let Some(value) = matrix::<W>(words, a).map(|m| math::mat_vec(m, x)) {
                    put_row(words, d, &value);
                }
            }
            Op::RowNorm => put_row(words, d, &each_row::<W>(words, a, math::norm)),
            Op::RowMean => put_row(words, d, &each_row::<W>(words, a, math::mean)),
            Op::RowStd => put_row(words, d, &each_row::<W>(words, a, math::std)),
            Op::ColumnNorm => {
                if let Some(value) = matrix::<W>(words, a).map(math::column_norm) {
                    put_row(words, d, &value);
                }
            }
            Op::MAdd => zip_matrix::<W>(words, [d, a, b], math::add),
            Op::MSub => zip_matrix::<W>(words, [d, a, b], math::sub),
            Op::MMul => zip_matrix::<W>(words, [d, a, b], math::mul),
            Op::MDiv => zip_matrix::<W>(words, [d, a, b], math::div),
            Op::MMin => zip_matrix::<W>(words, [d, a, b], math::min),
            Op::MMax => zip_matrix::<W>(words, [d, a, b], math::max),
            Op::MAbs => map_matrix::<W>(words, [d, a], math::abs),
            Op::MRecip => map_matrix::<W>(words, [d, a], math::recip),
            Op::MHeaviside => map_matrix::<W>(words, [d, a], math::heaviside),
            Op::Transpose => {
                if let Some(value) = matrix::<W>(words, a).map(math::transpose) {
                    put_matrix(words, d, &value);
                }
            }
            Op::MScale => {
                let s = load(words, i.a);
                map_matrix::<W>(words, [d, b], |x| math::mul(s, x));
            }
            Op::Outer => {
                let (x, y) = (*vector::<W>(words, a), *vector::<W>(words, b));
                for (r, x) in x.iter().enumerate() {
                    put_row(words, d + r * W, &math::map(&y, |y| math::mul(*x, y)));
                }
            }
            Op::MatMul => {
                let product = matrix::<W>(words, a)
                    .zip(matrix::<W>(words, b))
                    .map(|(x, y)| math::mat_mul(x, y));
                if let Some(value) = product {
                    put_matrix(words, d, &value);
                }
            }
            Op::BroadcastRows => put_matrix(words, d, &[*vector::<W>(words, a); W]),
            Op::BroadcastColumns => {
                let column = *vector::<W>(words, a);
                for (r, x) in column.iter().enumerate() {
                    put_row(words, d + r * W, &[*x; W]);
                }
            }
            Op::MNorm => store(words, i.d, math::norm(elements::<W>(words, a))),
            Op::MMean => store(words, i.d, math::mean(elements::<W>(words, a))),
            Op::MStd => store(words, i.d, math::std(elements::<W>(words, a))),
            Op::ReloadS => reload(policy, words, program, i.d, 1),
            Op::ReloadV => reload(policy, words, program, i.d, W),
            Op::ReloadM => reload(policy, words, program, i.d, W * W),
            Op::WriteS => write(words, shared, team, Section::Scalar, a, W),
            Op::WriteV => write(words, shared, team, Section::Vector, a, W),
            Op::WriteM => write(words, shared, team, Section::Matrix, a, W),
            Op::ReadS => read(words, shared, team, Section::Scalar, i, W),
            Op::ReadV => read(words, shared, team, Section::Vector, i, W),
            Op::ReadM => read(words, shared, team, Section::Matrix, i, W),
            Op::ReadWholeV => read_whole(words, shared, team, Section::Vector, [d, a], W),
            Op::ReadWholeM => read_whole(words, shared, team, Section::Matrix, [d, a], W),
            Op::MemWrite => write_indexed(policy, words, shared, program),
            _ => return rest,
        }
        rest = tail;
    }
    rest
}
