//! Scalar instructions: the loop in which most decisions spend their time.

use core::borrow::BorrowMut;

use super::context::read_cell;
use crate::isa::{self, Group, Op};
use crate::math::{HOST, Word, classic, scalar};
use crate::tables::{Code, Instruction};
use crate::trace::Observer;
use crate::verify::Policy;

#[inline(always)]
pub(super) fn load<V: Word>(words: &[V], at: u16) -> V {
    words.get(usize::from(at)).copied().unwrap_or(V::ZERO)
}

#[inline(always)]
pub(super) fn store<V: Word>(words: &mut [V], at: u16, value: V, running: V::Mask) {
    if let Some(word) = words.get_mut(usize::from(at)) {
        *word = value.over(*word, running);
    }
}

/// Runs scalar instructions up to the first other one and returns the code from there.
///
/// This is a function of its own with few arguments, so that the compiler keeps the loop's variables in registers. `S`
/// is an array where the capacity is known: if it has room for every 16-bit offset, no access needs a check.
#[inline(never)]
pub(super) fn scalars<'c, V: Word, S: BorrowMut<[V]> + ?Sized, O: Observer>(
    policy: &Policy<'_>,
    words: &mut S,
    running: V::Mask,
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
        // On a microcontroller, an instruction whose fields are not all offsets goes to the other loop at once. What
        // follows then needs no further check and no value in place of a missing word.
        let inside = |at: u16| usize::from(at) < words.len();
        if !(HOST || inside(d) && inside(at_a) && inside(at_b)) {
            return rest;
        }
        let (a, b) = (load(words, at_a), load(words, at_b));
        // Lanes that do not run a program need not compute what takes long; all other operations are faster on all lanes.
        macro_rules! costly {
            ($unit:literal, $some:expr, $all:expr) => {
                if V::LANES > 1 && $unit >= 24 {
                    $some
                } else {
                    $all
                }
            };
        }
        // What an operation does, by its cost, form and operands. All others end the loop.
        macro_rules! result {
            ($unit:literal Scalar $f:ident: S <- S, S) => {
                costly!(
                    $unit,
                    a.zip_in(running, b, scalar::$f),
                    a.zip(b, scalar::$f)
                )
            };
            ($unit:literal Scalar $f:ident: S <- S, None) => {
                costly!($unit, a.map_in(running, scalar::$f), a.map(scalar::$f))
            };
            ($unit:literal Scalar $f:ident: SUpdate <- $source:ident, S) => {
                load(words, d).zip3(a, b, scalar::$f)
            };
            ($unit:literal Classic $f:ident: S <- S, None) => {
                costly!($unit, a.map_in(running, classic::$f), a.map(classic::$f))
            };
            ($unit:literal Classic $f:ident: SUpdate <- S, None) => {
                load(words, d).zip(a, classic::$f)
            };
            ($unit:literal Classic $f:ident: SUpdate <- None, None) => {
                load(words, d).map(classic::$f)
            };
            ($unit:literal Move: S <- Cell, None) => {{
                read_cell(policy, observer, at_a);
                a
            }};
            ($unit:literal Move: S <- $element:ident, None) => {
                a
            };
            ($($other:tt)*) => {
                return rest
            };
        }
        macro_rules! dispatch {
            ($($code:literal $name:ident $mnemonic:literal $group:ident: $dst:ident <- $a:ident, $b:ident; $unit:literal $extent:ident; $notation:literal; $form:ident $($function:ident)?)*) => {
                match op {
                    $(Op::$name => {
                        if !const { Group::$group.is_built() } {
                            return rest;
                        }
                        result!($unit $form $($function)?: $dst <- $a, $b)
                    })*
                }
            };
        }
        let result = isa::table!(dispatch);
        store(words, d, result, running);
    }
}
