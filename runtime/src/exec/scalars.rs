//! Scalar instructions: the loop in which most decisions spend their time.

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
            Op::Add => math::add(a, b),
            Op::Sub => math::sub(a, b),
            Op::Mul => math::mul(a, b),
            Op::Div => math::div(a, b),
            Op::Min => math::min(a, b),
            Op::Max => math::max(a, b),
            Op::Pow => math::pow(a, b),
            Op::Abs => math::abs(a),
            Op::Recip => math::recip(a),
            Op::Sqr => math::sqr(a),
            Op::Cube => math::cube(a),
            Op::Sqrt => math::sqrt(a),
            Op::Sin => math::sin(a),
            Op::Cos => math::cos(a),
            Op::Tan => math::tan(a),
            Op::Asin => math::asin(a),
            Op::Acos => math::acos(a),
            Op::Atan => math::atan(a),
            Op::Tanh => math::tanh(a),
            Op::Exp => math::exp(a),
            Op::Log => math::log(a),
            Op::Heaviside => math::heaviside(a),
            Op::Cond => math::cond(load(words, i.d), a, b),
            Op::VElement | Op::MElement => a,
            Op::MemRead => {
                read_cell(policy, observer, i.a);
                a
            }
            Op::ClassicAdd => classic::add(load(words, i.d), a),
            Op::ClassicSub => classic::sub(load(words, i.d), a),
            Op::ClassicMult => classic::mult(load(words, i.d)),
            Op::ClassicDiv => classic::div(load(words, i.d)),
            Op::ClassicNeg => classic::neg(load(words, i.d), a),
            Op::ClassicCos => classic::cos(a),
            Op::ClassicLog => classic::log(load(words, i.d), a),
            Op::ClassicExp => classic::exp(a),
            _ => return rest,
        };
        store(words, i.d, result);
    }
}
