//! Scalar instructions: the loop in which most decisions spend their time.

#![cfg_attr(
    not(feature = "all-operations"),
    allow(
        dead_code,
        unused_imports,
        unused_variables,
        unused_mut,
        unreachable_code,
        reason = "without some groups of operations, some helpers have no caller"
    )
)]

use core::borrow::BorrowMut;

use super::Code;
use super::shared::read_cell;
use crate::isa::Op;
use crate::math::{self, classic};
use crate::tables::Instruction;
use crate::trace::Observer;
use crate::verify::Policy;

#[inline(always)]
pub(super) fn load(words: &[f32], at: u16) -> f32 {
    words.get(usize::from(at)).copied().unwrap_or(0.0)
}

#[inline(always)]
pub(super) fn store(words: &mut [f32], at: u16, value: f32) {
    if let Some(word) = words.get_mut(usize::from(at)) {
        *word = value;
    }
}

/// Runs scalar instructions up to the first other one and returns what is left from there.
///
/// A function of its own with few arguments, so that the loop lives in registers. `S` is an array where the capacity is
/// known: with room for every 16-bit offset no access needs a check.
#[inline(never)]
pub(super) fn scalars<'c, S: BorrowMut<[f32]> + ?Sized, O: Observer>(
    policy: &Policy<'_>,
    words: &mut S,
    observer: &mut O,
    code: Code<'c>,
) -> Code<'c> {
    let words = words.borrow_mut();
    let mut instructions = code.iter();
    loop {
        let rest = instructions.as_slice();
        let Some(bytes) = instructions.next() else {
            return rest;
        };
        let Some(i) = Instruction::from_bytes(bytes) else {
            return &[];
        };
        let (a, b) = (load(words, i.a), load(words, i.b));
        let result = match i.op {
            #[cfg(feature = "scalar")]
            Op::Add => math::add(a, b),
            #[cfg(feature = "scalar")]
            Op::Sub => math::sub(a, b),
            #[cfg(feature = "scalar")]
            Op::Mul => math::mul(a, b),
            #[cfg(feature = "scalar")]
            Op::Div => math::div(a, b),
            #[cfg(feature = "scalar")]
            Op::Min => math::min(a, b),
            #[cfg(feature = "scalar")]
            Op::Max => math::max(a, b),
            #[cfg(feature = "scalar")]
            Op::Pow => math::pow(a, b),
            #[cfg(feature = "scalar")]
            Op::Abs => math::abs(a),
            #[cfg(feature = "scalar")]
            Op::Recip => math::recip(a),
            #[cfg(feature = "scalar")]
            Op::Sqr => math::sqr(a),
            #[cfg(feature = "scalar")]
            Op::Cube => math::cube(a),
            #[cfg(feature = "scalar")]
            Op::Sqrt => math::sqrt(a),
            #[cfg(feature = "scalar")]
            Op::Sin => math::sin(a),
            #[cfg(feature = "scalar")]
            Op::Cos => math::cos(a),
            #[cfg(feature = "scalar")]
            Op::Tan => math::tan(a),
            #[cfg(feature = "scalar")]
            Op::Asin => math::asin(a),
            #[cfg(feature = "scalar")]
            Op::Acos => math::acos(a),
            #[cfg(feature = "scalar")]
            Op::Atan => math::atan(a),
            #[cfg(feature = "scalar")]
            Op::Tanh => math::tanh(a),
            #[cfg(feature = "scalar")]
            Op::Exp => math::exp(a),
            #[cfg(feature = "scalar")]
            Op::Log => math::log(a),
            #[cfg(feature = "scalar")]
            Op::Heaviside => math::heaviside(a),
            #[cfg(feature = "scalar")]
            Op::Cond => math::cond(load(words, i.d), a, b),
            #[cfg(any(feature = "matrix", feature = "vector"))]
            Op::VElement | Op::MElement => a,
            #[cfg(feature = "classic")]
            Op::MemRead => {
                read_cell(policy, observer, i.a);
                a
            }
            #[cfg(feature = "classic")]
            Op::ClassicAdd => classic::add(load(words, i.d), a),
            #[cfg(feature = "classic")]
            Op::ClassicSub => classic::sub(load(words, i.d), a),
            #[cfg(feature = "classic")]
            Op::ClassicMult => classic::mult(load(words, i.d)),
            #[cfg(feature = "classic")]
            Op::ClassicDiv => classic::div(load(words, i.d)),
            #[cfg(feature = "classic")]
            Op::ClassicNeg => classic::neg(load(words, i.d), a),
            #[cfg(feature = "classic")]
            Op::ClassicCos => classic::cos(a),
            #[cfg(feature = "classic")]
            Op::ClassicLog => classic::log(load(words, i.d), a),
            #[cfg(feature = "classic")]
            Op::ClassicExp => classic::exp(a),
            _ => return rest,
        };
        store(words, i.d, result);
    }
}
