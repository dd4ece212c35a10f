//! Instructions on vectors, matrices, constants and shared memory.

#![cfg_attr(
    not(feature = "all-operations"),
    allow(
        dead_code,
        unused_imports,
        unused_variables,
        unused_mut,
        unreachable_code,
        clippy::never_loop,
        reason = "without some groups of operations, some helpers have no caller, without all of them the loop has no turns"
    )
)]

use super::elementwise::{
    map_matrix, map_vector, reduce_matrix, reduce_rows, reduce_vector, scale_matrix, scale_vector,
    zip_matrix, zip_vector,
};
use super::rows::{matrix, put_matrix, put_row, vector};
use super::scalars::{load, store};
use super::shared::{read, read_whole, reload, write, write_indexed};
use super::{Code, Shared};
use crate::isa::Op;
use crate::math::{self, lanes};
use crate::tables::{Instruction, Program, Section, Team};
use crate::trace::Observer;
use crate::verify::Policy;

/// Runs instructions that touch vectors, matrices, constants or shared memory up to the first scalar one and returns
/// what is left from there.
#[inline(never)]
pub fn vectors<'c, const W: usize, O: Observer>(
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
            #[cfg(feature = "vector")]
            Op::VAdd => zip_vector::<W>(words, [d, a, b], lanes::add),
            #[cfg(feature = "vector")]
            Op::VSub => zip_vector::<W>(words, [d, a, b], lanes::sub),
            #[cfg(feature = "vector")]
            Op::VMul => zip_vector::<W>(words, [d, a, b], lanes::mul),
            #[cfg(feature = "vector")]
            Op::VDiv => zip_vector::<W>(words, [d, a, b], lanes::div),
            #[cfg(feature = "vector")]
            Op::VMin => zip_vector::<W>(words, [d, a, b], lanes::min),
            #[cfg(feature = "vector")]
            Op::VMax => zip_vector::<W>(words, [d, a, b], lanes::max),
            #[cfg(feature = "vector")]
            Op::VAbs => map_vector::<W>(words, [d, a], lanes::abs),
            #[cfg(feature = "vector")]
            Op::VRecip => map_vector::<W>(words, [d, a], lanes::recip),
            #[cfg(feature = "vector")]
            Op::VHeaviside => map_vector::<W>(words, [d, a], lanes::heaviside),
            #[cfg(feature = "vector")]
            Op::VScale => scale_vector::<W>(words, [i.d, i.a, i.b]),
            #[cfg(feature = "vector")]
            Op::VBroadcast => put_row(words, d, &[load(words, i.a); W]),
            #[cfg(feature = "vector")]
            Op::Dot => store(
                words,
                i.d,
                math::dot(vector::<W>(words, a), vector::<W>(words, b)),
            ),
            #[cfg(feature = "vector")]
            Op::VNorm => reduce_vector::<W>(words, [d, a], math::norm),
            #[cfg(feature = "vector")]
            Op::VMean => reduce_vector::<W>(words, [d, a], math::mean),
            #[cfg(feature = "vector")]
            Op::VStd => reduce_vector::<W>(words, [d, a], math::std),
            #[cfg(feature = "matrix")]
            Op::MatVec => {
                let x = vector(words, b);
                if let Some(value) = matrix::<W>(words, a).map(|m| math::mat_vec(m, x)) {
                    put_row(words, d, &value);
                }
            }
            #[cfg(feature = "matrix")]
            Op::RowNorm => reduce_rows::<W>(words, [d, a], math::norm),
            #[cfg(feature = "matrix")]
            Op::RowMean => reduce_rows::<W>(words, [d, a], math::mean),
            #[cfg(feature = "matrix")]
            Op::RowStd => reduce_rows::<W>(words, [d, a], math::std),
            #[cfg(feature = "matrix")]
            Op::ColumnNorm => {
                if let Some(value) = matrix::<W>(words, a).map(math::column_norm) {
                    put_row(words, d, &value);
                }
            }
            #[cfg(feature = "matrix")]
            Op::MAdd => zip_matrix::<W>(words, [d, a, b], lanes::add),
            #[cfg(feature = "matrix")]
            Op::MSub => zip_matrix::<W>(words, [d, a, b], lanes::sub),
            #[cfg(feature = "matrix")]
            Op::MMul => zip_matrix::<W>(words, [d, a, b], lanes::mul),
            #[cfg(feature = "matrix")]
            Op::MDiv => zip_matrix::<W>(words, [d, a, b], lanes::div),
            #[cfg(feature = "matrix")]
            Op::MMin => zip_matrix::<W>(words, [d, a, b], lanes::min),
            #[cfg(feature = "matrix")]
            Op::MMax => zip_matrix::<W>(words, [d, a, b], lanes::max),
            #[cfg(feature = "matrix")]
            Op::MAbs => map_matrix::<W>(words, [d, a], lanes::abs),
            #[cfg(feature = "matrix")]
            Op::MRecip => map_matrix::<W>(words, [d, a], lanes::recip),
            #[cfg(feature = "matrix")]
            Op::MHeaviside => map_matrix::<W>(words, [d, a], lanes::heaviside),
            #[cfg(feature = "matrix")]
            Op::Transpose => {
                if let Some(value) = matrix::<W>(words, a).map(math::transpose) {
                    put_matrix(words, d, &value);
                }
            }
            #[cfg(feature = "matrix")]
            Op::MScale => scale_matrix::<W>(words, [i.d, i.a, i.b]),
            #[cfg(feature = "matrix")]
            Op::Outer => {
                let (x, y) = (*vector::<W>(words, a), *vector::<W>(words, b));
                for (r, x) in x.iter().enumerate() {
                    put_row(words, d + r * W, &math::map(&y, |y| lanes::mul(*x, y)));
                }
            }
            #[cfg(feature = "matrix")]
            Op::MatMul => {
                if let Some(y) = matrix::<W>(words, b).copied() {
                    // No row of the left factor is read twice, so the product may take its place row by row.
                    for r in 0..W {
                        let row = math::row_mul(vector::<W>(words, a + r * W), &y);
                        put_row(words, d + r * W, &row);
                    }
                }
            }
            #[cfg(feature = "matrix")]
            Op::BroadcastRows => put_matrix(words, d, &[*vector::<W>(words, a); W]),
            #[cfg(feature = "matrix")]
            Op::BroadcastColumns => {
                let column = *vector::<W>(words, a);
                for (r, x) in column.iter().enumerate() {
                    put_row(words, d + r * W, &[*x; W]);
                }
            }
            #[cfg(feature = "matrix")]
            Op::MNorm => reduce_matrix::<W>(words, [d, a], math::norm),
            #[cfg(feature = "matrix")]
            Op::MMean => reduce_matrix::<W>(words, [d, a], math::mean),
            #[cfg(feature = "matrix")]
            Op::MStd => reduce_matrix::<W>(words, [d, a], math::std),
            #[cfg(feature = "constants")]
            Op::ReloadS => reload(policy, words, program, i.d, 1),
            #[cfg(feature = "constants")]
            Op::ReloadV => reload(policy, words, program, i.d, W),
            #[cfg(feature = "constants")]
            Op::ReloadM => reload(policy, words, program, i.d, W * W),
            #[cfg(feature = "team-memory")]
            Op::WriteS => write(policy, words, shared, team, Section::Scalar, a, W),
            #[cfg(feature = "team-memory")]
            Op::WriteV => write(policy, words, shared, team, Section::Vector, a, W),
            #[cfg(feature = "team-memory")]
            Op::WriteM => write(policy, words, shared, team, Section::Matrix, a, W),
            #[cfg(feature = "team-memory")]
            Op::ReadS => read(words, shared, team, Section::Scalar, i, W),
            #[cfg(feature = "team-memory")]
            Op::ReadV => read(words, shared, team, Section::Vector, i, W),
            #[cfg(feature = "team-memory")]
            Op::ReadM => read(words, shared, team, Section::Matrix, i, W),
            #[cfg(feature = "team-memory")]
            Op::ReadWholeV => read_whole(words, shared, team, Section::Vector, [d, a], W),
            #[cfg(feature = "team-memory")]
            Op::ReadWholeM => read_whole(words, shared, team, Section::Matrix, [d, a], W),
            #[cfg(feature = "classic")]
            Op::MemWrite => write_indexed(policy, words, shared, program),
            _ => return rest,
        }
        rest = tail;
    }
    rest
}
