//! Instructions that reach beyond the registers: to evolved constants and to shared memory.

use super::context::Context;
use crate::isa::{self, Group, Op, Section};
use crate::math::Word;
use crate::tables::{Code, Instruction};
use crate::trace::Observer;

/// Runs instructions that touch constants or shared memory up to the first other one, and returns the code from there. `width` is
/// the policy's vector width.
///
/// On microcontrollers, where the width is known, it is a part of its only caller.
#[cfg_attr(target_pointer_width = "64", inline(never))]
#[cfg_attr(not(target_pointer_width = "64"), inline(always))]
pub(super) fn shared<'c, V: Word, O: Observer>(
    words: &mut [V],
    context: &mut Context<'_, V, O>,
    width: usize,
    code: Code<'c>,
) -> Code<'c> {
    let mut rest = code;
    while let [bytes, tail @ ..] = rest {
        let Some(i) = Instruction::from_bytes(bytes) else {
            return &[];
        };
        let [d, a] = [i.d, i.a].map(usize::from);
        // What an operation does, by its form and operands. All others end the loop.
        macro_rules! run {
            (Reload: S <- None, None) => {
                context.reload(words, i.d, 1)
            };
            (Reload: V <- None, None) => {
                context.reload(words, i.d, width)
            };
            (Reload: M <- None, None) => {
                context.reload(words, i.d, width * width)
            };
            (Write: None <- S, None) => {
                context.write(words, Section::Scalar, a, width)
            };
            (Write: None <- V, None) => {
                context.write(words, Section::Vector, a, width)
            };
            (Write: None <- M, None) => {
                context.write(words, Section::Matrix, a, width)
            };
            (Read: S <- ScalarSlot, None) => {
                context.read(words, Section::Scalar, i, width)
            };
            (Read: S <- VectorSlot, VectorIndex) => {
                context.read(words, Section::Vector, i, width)
            };
            (Read: S <- MatrixSlot, MatrixIndex) => {
                context.read(words, Section::Matrix, i, width)
            };
            (ReadWhole: V <- VectorSlot, None) => {
                context.read_whole(words, Section::Vector, [d, a], width)
            };
            (ReadWhole: M <- MatrixSlot, None) => {
                context.read_whole(words, Section::Matrix, [d, a], width)
            };
            (WriteCells: None <- None, None) => {
                context.write_cells(words)
            };
            ($($other:tt)*) => {
                return rest
            };
        }
        macro_rules! dispatch {
            ($($code:literal $name:ident $mnemonic:literal $group:ident: $dst:ident <- $a:ident, $b:ident; $unit:literal $extent:ident; $notation:literal; $form:ident $($function:ident)?)*) => {
                match i.op {
                    $(Op::$name => {
                        if !const { Group::$group.is_built() } {
                            return rest;
                        }
                        run!($form $($function)?: $dst <- $a, $b)
                    })*
                }
            };
        }
        isa::table!(dispatch);
        rest = tail;
    }
    rest
}
