//! Instructions on the vectors and matrices of a program: the only ones that are compiled for each width.

use super::elementwise::{
    map_matrix, map_vector, reduce_matrix, reduce_rows, reduce_vector, scale_matrix, scale_vector,
    zip_matrix, zip_vector,
};
use super::rows::{matrix, put_matrix, put_row, vector};
use super::scalars::{load, store};
use crate::isa::{self, Group, Op};
use crate::math::{self, Mask, Word, lanes};
use crate::tables::{Code, Instruction};

/// Runs instructions on vectors and matrices up to the first other one, and returns the code from there. `W` is the policy's
/// vector width.
#[inline(never)]
pub(super) fn vectors<'c, V: Word, const W: usize>(
    words: &mut [V],
    running: V::Mask,
    code: Code<'c>,
) -> Code<'c> {
    let mut rest = code;
    while let [bytes, tail @ ..] = rest {
        let Some(i) = Instruction::from_bytes(bytes) else {
            return &[];
        };
        let [d, a, b] = [i.d, i.a, i.b].map(usize::from);
        // What an operation does, by its form and operands. All others end the loop.
        macro_rules! run {
            (Each $f:ident: V <- V, V) => { zip_vector::<V, W>(words, [d, a, b], running, lanes::$f) };
            (Each $f:ident: V <- V, None) => { map_vector::<V, W>(words, [d, a], running, lanes::$f) };
            (Each $f:ident: M <- M, M) => { zip_matrix::<V, W>(words, [d, a, b], running, lanes::$f) };
            (Each $f:ident: M <- M, None) => { map_matrix::<V, W>(words, [d, a], running, lanes::$f) };
            (Scale $f:ident: V <- S, V) => { scale_vector::<V, W>(words, [i.d, i.a, i.b], running, lanes::$f) };
            (Scale $f:ident: M <- S, M) => { scale_matrix::<V, W>(words, [i.d, i.a, i.b], running, lanes::$f) };
            (Outer $f:ident: M <- V, V) => {{
                let (x, y) = (*vector::<V, W>(words, a), *vector::<V, W>(words, b));
                for (r, x) in x.iter().enumerate() {
                    put_row(words, d + r * W, &math::map(&y, |y| x.zip(y, lanes::$f)), running);
                }
            }};
            (Reduce $f:ident: S <- V, None) => { reduce_vector::<V, W>(words, [d, a], running, math::$f) };
            (Reduce $f:ident: S <- M, None) => { reduce_matrix::<V, W>(words, [d, a], running, math::$f) };
            (Rows $f:ident: V <- M, None) => { reduce_rows::<V, W>(words, [d, a], running, math::$f) };
            (Whole $f:ident: S <- V, V) => {{
                let value = math::$f(vector::<V, W>(words, a), vector::<V, W>(words, b));
                store(words, i.d, value, running)
            }};
            (Whole $f:ident: V <- M, V) => {{
                let x = vector(words, b);
                if let Some(value) = matrix::<V, W>(words, a).map(|m| math::$f(m, x)) {
                    put_row(words, d, &value, running);
                }
            }};
            (Whole $f:ident: V <- M, None) => {
                if let Some(value) = matrix::<V, W>(words, a).map(math::$f) {
                    put_row(words, d, &value, running);
                }
            };
            (Whole $f:ident: M <- M, None) => {
                if let Some(value) = matrix::<V, W>(words, a).map(math::$f) {
                    put_matrix(words, d, &value, running);
                }
            };
            (Whole mat_mul: M <- M, M) => {
                if let Some(y) = matrix::<V, W>(words, b).copied() {
                    // No row of the left factor is read twice, so the product may take its place row by row.
                    for r in 0..W {
                        let row = math::row_mul(vector::<V, W>(words, a + r * W), &y);
                        put_row(words, d + r * W, &row, running);
                    }
                }
            };
            (Fill: V <- S, None) => { put_row(words, d, &[load(words, i.a); W], running) };
            (FillRows: M <- V, None) => { put_matrix(words, d, &[*vector::<V, W>(words, a); W], running) };
            (FillColumns: M <- V, None) => {{
                let column = *vector::<V, W>(words, a);
                for (r, x) in column.iter().enumerate() {
                    put_row(words, d + r * W, &[*x; W], running);
                }
            }};
            (Latch: VUpdate <- S, V) => {{
                let open = running.and(load(words, i.a).test(math::opens));
                if open.any() {
                    map_vector::<V, W>(words, [d, b], open, lanes::same)
                }
            }};
            (Latch: MUpdate <- S, M) => {{
                let open = running.and(load(words, i.a).test(math::opens));
                if open.any() {
                    map_matrix::<V, W>(words, [d, b], open, lanes::same)
                }
            }};
            ($($other:tt)*) => { return rest };
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
