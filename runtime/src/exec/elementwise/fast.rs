//! Each operation with loops of its own, unrolled for the width.

use core::cell::Cell;

use crate::exec::rows::{matrix, put_row, vector};
use crate::exec::scalars::load;
use crate::math::{self, HOST};

/// `f` of every pair of elements of two vectors.
#[inline(always)]
pub(in crate::exec) fn zip_vector<const W: usize>(
    words: &mut [f32],
    [d, a, b]: [usize; 3],
    f: impl Fn(f32, f32) -> f32,
) {
    let value = math::zip(vector::<W>(words, a), vector::<W>(words, b), f);
    put_row(words, d, &value);
}

/// `f` of every element of a vector.
#[inline(always)]
pub(in crate::exec) fn map_vector<const W: usize>(
    words: &mut [f32],
    [d, a]: [usize; 2],
    f: impl Fn(f32) -> f32,
) {
    let value = math::map(vector::<W>(words, a), f);
    put_row(words, d, &value);
}

/// `f` of a scalar and every element of a vector.
#[inline(always)]
pub(in crate::exec) fn scale_vector<const W: usize>(
    words: &mut [f32],
    [d, s, x]: [u16; 3],
    f: impl Fn(f32, f32) -> f32,
) {
    let s = load(words, s);
    map_vector::<W>(words, [d, x].map(usize::from), |x| f(s, x));
}

/// `f` of every pair of elements of two matrices, on hosts eight at a time.
///
/// With groups of four, the compiler joins groups itself, after an expensive test of whether they overlap.
#[inline(always)]
pub(in crate::exec) fn zip_matrix<const W: usize>(
    words: &mut [f32],
    [d, a, b]: [usize; 3],
    f: impl Fn(f32, f32) -> f32,
) {
    let words = Cell::from_mut(words).as_slice_of_cells();
    let part = |at: usize| {
        words
            .get(at..)
            .and_then(|rest| rest.get(..W * W))
            .unwrap_or_default()
    };
    let mut rest = [part(d), part(a), part(b)];
    if HOST {
        rest = zip_groups::<8>(rest, &f);
    }
    rest = zip_groups::<4>(rest, &f);
    zip_groups::<1>(rest, &f);
}

/// `f` of pairs of cells, `N` at a time, while at least `N` are left. Returns the cells that are left.
#[inline(always)]
fn zip_groups<const N: usize>(
    [d, a, b]: [&[Cell<f32>]; 3],
    f: impl Fn(f32, f32) -> f32,
) -> [&[Cell<f32>]; 3] {
    let [d, a, b] = [d, a, b].map(<[_]>::as_chunks::<N>);
    for ((d, a), b) in d.0.iter().zip(a.0).zip(b.0) {
        let value = math::zip(
            &a.each_ref().map(Cell::get),
            &b.each_ref().map(Cell::get),
            &f,
        );
        for (place, value) in d.iter().zip(value) {
            place.set(value);
        }
    }
    [d.1, a.1, b.1]
}

/// `f` of every element of a matrix.
#[inline(always)]
pub(in crate::exec) fn map_matrix<const W: usize>(
    words: &mut [f32],
    [d, a]: [usize; 2],
    f: impl Fn(f32) -> f32,
) {
    zip_matrix::<W>(words, [d, a, a], |x, _| f(x));
}

/// `f` of a vector.
#[inline(always)]
pub(in crate::exec) fn reduce_vector<const W: usize>(
    words: &mut [f32],
    [d, a]: [usize; 2],
    f: impl Fn(&[f32]) -> f32,
) {
    put_row(words, d, &[f(vector::<W>(words, a))]);
}

/// `f` of every row of a matrix.
#[inline(always)]
pub(in crate::exec) fn reduce_rows<const W: usize>(
    words: &mut [f32],
    [d, a]: [usize; 2],
    f: impl Fn(&[f32]) -> f32,
) {
    if let Some(rows) = matrix::<W>(words, a) {
        put_row(words, d, &rows.each_ref().map(|row| f(row)));
    }
}

/// `f` of all elements of a matrix.
#[inline(always)]
pub(in crate::exec) fn reduce_matrix<const W: usize>(
    words: &mut [f32],
    [d, a]: [usize; 2],
    f: impl Fn(&[f32]) -> f32,
) {
    if let Some(rows) = matrix::<W>(words, a) {
        put_row(words, d, &[f(rows.as_flattened())]);
    }
}

/// `f` of a scalar and every element of a matrix.
#[inline(always)]
pub(in crate::exec) fn scale_matrix<const W: usize>(
    words: &mut [f32],
    [d, s, x]: [u16; 3],
    f: impl Fn(f32, f32) -> f32,
) {
    let s = load(words, s);
    map_matrix::<W>(words, [d, x].map(usize::from), |x| f(s, x));
}
