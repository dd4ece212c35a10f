//! Scalar instructions: the loop in which most decisions spend their time.

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

use core::borrow::BorrowMut;

use super::Code;
use super::shared::read_cell;
use crate::isa::Op;
use crate::math::{self, classic, raw};
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

/// Whether loops are shaped for a host, which predicts branches, or for a microcontroller, where each instruction costs.
///
/// On a host, scalar results meet the number rule in one place, at the end of the loop, rather than in each operation that needs it:
/// all words are finite, so where the rule has nothing to do it changes nothing. On a microcontroller, an instruction
/// whose fields are no offsets is left to [`super::vectors`] before anything else is done with it: what then follows
/// needs no further check, and no value in place of a missing one.
pub(super) const HOST: bool = cfg!(target_pointer_width = "64");

/// The number rule, unless it is applied later.
#[inline(always)]
fn ruled(x: f32) -> f32 {
    if HOST { x } else { math::settle(x) }
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
        let (op, [d, at_a, at_b]) = Instruction::parts(bytes);
        let Some(op) = op else { return rest };
        let inside = |at: u16| usize::from(at) < words.len();
        if !(HOST || inside(d) && inside(at_a) && inside(at_b)) {
            return rest;
        }
        let (a, b) = (load(words, at_a), load(words, at_b));
        let result = match op {
            #[cfg(feature = "scalar")]
            Op::Add => ruled(raw::add(a, b)),
            #[cfg(feature = "scalar")]
            Op::Sub => ruled(raw::sub(a, b)),
            #[cfg(feature = "scalar")]
            Op::Mul => ruled(raw::mul(a, b)),
            #[cfg(feature = "scalar")]
            Op::Div => ruled(raw::div(a, b)),
            #[cfg(feature = "scalar")]
            Op::Min => math::min(a, b),
            #[cfg(feature = "scalar")]
            Op::Max => math::max(a, b),
            #[cfg(feature = "scalar")]
            Op::Pow => ruled(raw::pow(a, b)),
            #[cfg(feature = "scalar")]
            Op::Abs => math::abs(a),
            #[cfg(feature = "scalar")]
            Op::Recip => ruled(raw::recip(a)),
            #[cfg(feature = "scalar")]
            Op::Sqr => ruled(raw::sqr(a)),
            #[cfg(feature = "scalar")]
            Op::Cube => ruled(raw::cube(a)),
            #[cfg(feature = "scalar")]
            Op::Sqrt => ruled(raw::sqrt(a)),
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
            Op::Atan => ruled(raw::atan(a)),
            #[cfg(feature = "scalar")]
            Op::Tanh => ruled(raw::tanh(a)),
            #[cfg(feature = "scalar")]
            Op::Exp => ruled(raw::exp(a)),
            #[cfg(feature = "scalar")]
            Op::Log => ruled(raw::log(a)),
            #[cfg(feature = "scalar")]
            Op::Heaviside => math::heaviside(a),
            #[cfg(feature = "scalar")]
            Op::Cond => math::cond(load(words, d), a, b),
            #[cfg(any(feature = "matrix", feature = "vector"))]
            Op::VElement | Op::MElement => a,
            #[cfg(feature = "classic")]
            Op::MemRead => {
                read_cell(policy, observer, at_a);
                a
            }
            #[cfg(feature = "classic")]
            Op::ClassicAdd => classic::add(load(words, d), a),
            #[cfg(feature = "classic")]
            Op::ClassicSub => classic::sub(load(words, d), a),
            #[cfg(feature = "classic")]
            Op::ClassicMult => classic::mult(load(words, d)),
            #[cfg(feature = "classic")]
            Op::ClassicDiv => classic::div(load(words, d)),
            #[cfg(feature = "classic")]
            Op::ClassicNeg => classic::neg(load(words, d), a),
            #[cfg(feature = "classic")]
            Op::ClassicCos => classic::cos(a),
            #[cfg(feature = "classic")]
            Op::ClassicLog => classic::log(load(words, d), a),
            #[cfg(feature = "classic")]
            Op::ClassicExp => classic::exp(a),
            _ => return rest,
        };
        store(words, d, if HOST { math::finite(result) } else { result });
    }
}
