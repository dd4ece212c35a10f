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
use crate::isa::code;
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

/// Whether the loop is shaped for a host, which predicts branches, or for a microcontroller, where each instruction costs.
///
/// On a host, results meet the number rule in one place, at the end of the loop, rather than in each operation that needs it:
/// all words are finite, so where the rule has nothing to do it changes nothing. On a microcontroller, an instruction
/// whose fields are no offsets is left to [`super::wides`] before anything else is done with it: what then follows
/// needs no further check, and no value in place of a missing one.
const HOST: bool = cfg!(target_pointer_width = "64");

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
    stored: Code<'c>,
) -> Code<'c> {
    let words = words.borrow_mut();
    let mut instructions = stored.iter();
    loop {
        let rest = instructions.as_slice();
        let Some(bytes) = instructions.next() else {
            return rest;
        };
        let (code, [d, at_a, at_b]) = Instruction::fields(bytes);
        let inside = |at: u16| usize::from(at) < words.len();
        if !(HOST || inside(d) && inside(at_a) && inside(at_b)) {
            return rest;
        }
        let (a, b) = (load(words, at_a), load(words, at_b));
        let result = match code {
            #[cfg(feature = "scalar")]
            code::Add => ruled(raw::add(a, b)),
            #[cfg(feature = "scalar")]
            code::Sub => ruled(raw::sub(a, b)),
            #[cfg(feature = "scalar")]
            code::Mul => ruled(raw::mul(a, b)),
            #[cfg(feature = "scalar")]
            code::Div => ruled(raw::div(a, b)),
            #[cfg(feature = "scalar")]
            code::Min => math::min(a, b),
            #[cfg(feature = "scalar")]
            code::Max => math::max(a, b),
            #[cfg(feature = "scalar")]
            code::Pow => ruled(raw::pow(a, b)),
            #[cfg(feature = "scalar")]
            code::Abs => math::abs(a),
            #[cfg(feature = "scalar")]
            code::Recip => ruled(raw::recip(a)),
            #[cfg(feature = "scalar")]
            code::Sqr => ruled(raw::sqr(a)),
            #[cfg(feature = "scalar")]
            code::Cube => ruled(raw::cube(a)),
            #[cfg(feature = "scalar")]
            code::Sqrt => ruled(raw::sqrt(a)),
            #[cfg(feature = "scalar")]
            code::Sin => math::sin(a),
            #[cfg(feature = "scalar")]
            code::Cos => math::cos(a),
            #[cfg(feature = "scalar")]
            code::Tan => math::tan(a),
            #[cfg(feature = "scalar")]
            code::Asin => math::asin(a),
            #[cfg(feature = "scalar")]
            code::Acos => math::acos(a),
            #[cfg(feature = "scalar")]
            code::Atan => ruled(raw::atan(a)),
            #[cfg(feature = "scalar")]
            code::Tanh => ruled(raw::tanh(a)),
            #[cfg(feature = "scalar")]
            code::Exp => ruled(raw::exp(a)),
            #[cfg(feature = "scalar")]
            code::Log => ruled(raw::log(a)),
            #[cfg(feature = "scalar")]
            code::Heaviside => math::heaviside(a),
            #[cfg(feature = "scalar")]
            code::Cond => math::cond(load(words, d), a, b),
            #[cfg(any(feature = "matrix", feature = "vector"))]
            code::VElement | code::MElement => a,
            #[cfg(feature = "classic")]
            code::MemRead => {
                read_cell(policy, observer, at_a);
                a
            }
            #[cfg(feature = "classic")]
            code::ClassicAdd => classic::add(load(words, d), a),
            #[cfg(feature = "classic")]
            code::ClassicSub => classic::sub(load(words, d), a),
            #[cfg(feature = "classic")]
            code::ClassicMult => classic::mult(load(words, d)),
            #[cfg(feature = "classic")]
            code::ClassicDiv => classic::div(load(words, d)),
            #[cfg(feature = "classic")]
            code::ClassicNeg => classic::neg(load(words, d), a),
            #[cfg(feature = "classic")]
            code::ClassicCos => classic::cos(a),
            #[cfg(feature = "classic")]
            code::ClassicLog => classic::log(load(words, d), a),
            #[cfg(feature = "classic")]
            code::ClassicExp => classic::exp(a),
            _ => return rest,
        };
        store(words, d, if HOST { math::finite(result) } else { result });
    }
}
