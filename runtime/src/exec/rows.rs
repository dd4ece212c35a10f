//! Vectors and matrices in the state's words.
//!
//! Destinations may be sources too, but never overlap them partly: element k of a result depends on nothing that was
//! overwritten before it, if a group of elements is read whole before any of it is written.

use core::cell::Cell;

use crate::math;

/// A vector in place.
#[inline(always)]
pub(super) fn vector<const W: usize>(words: &[f32], at: usize) -> &[f32; W] {
    words
        .get(at..)
        .and_then(|rest| rest.first_chunk::<W>())
        .unwrap_or(&[0.0; W])
}

#[inline(always)]
pub(super) fn put_row<const W: usize>(words: &mut [f32], at: usize, value: &[f32; W]) {
    if let Some(place) = words
        .get_mut(at..)
        .and_then(|rest| rest.first_chunk_mut::<W>())
    {
        *place = *value;
    }
}

/// A W×W matrix in place.
#[inline(always)]
pub(super) fn matrix<const W: usize>(words: &[f32], at: usize) -> Option<&[[f32; W]; W]> {
    let (rows, _) = words.get(at..)?.as_chunks::<W>();
    rows.first_chunk::<W>()
}

/// The elements of a matrix, row by row.
#[inline(always)]
pub(super) fn elements<const W: usize>(words: &[f32], at: usize) -> &[f32] {
    matrix::<W>(words, at).map_or(&[], |rows| rows.as_flattened())
}

#[inline(always)]
pub(super) fn put_matrix<const W: usize>(words: &mut [f32], at: usize, value: &[[f32; W]; W]) {
    let place = words.get_mut(at..).map(|rest| rest.as_chunks_mut::<W>().0);
    if let Some(place) = place.and_then(|rows| rows.first_chunk_mut::<W>()) {
        *place = *value;
    }
}

/// One result for each row of the matrix at `at`.
#[inline(always)]
pub(super) fn each_row<const W: usize>(
    words: &[f32],
    at: usize,
    f: impl Fn(&[f32]) -> f32,
) -> [f32; W] {
    let mut out = [0.0; W];
    if let Some(rows) = matrix::<W>(words, at) {
        for (out, row) in out.iter_mut().zip(rows) {
            *out = f(row);
        }
    }
    out
}

/// `f` of every pair of elements of two vectors.
#[inline(always)]
pub(super) fn zip_vector<const W: usize>(
    words: &mut [f32],
    [d, a, b]: [usize; 3],
    f: impl Fn(f32, f32) -> f32,
) {
    let value = math::zip(vector::<W>(words, a), vector::<W>(words, b), f);
    put_row(words, d, &value);
}

/// `f` of every element of a vector.
#[inline(always)]
pub(super) fn map_vector<const W: usize>(
    words: &mut [f32],
    [d, a]: [usize; 2],
    f: impl Fn(f32) -> f32,
) {
    let value = math::map(vector::<W>(words, a), f);
    put_row(words, d, &value);
}

/// `f` of every pair of elements of two matrices, four at a time.
#[inline(always)]
pub(super) fn zip_matrix<const W: usize>(
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
            .as_chunks::<4>()
    };
    let (d, a, b) = (part(d), part(a), part(b));
    for ((d, a), b) in d.0.iter().zip(a.0).zip(b.0) {
        put(d, &math::zip(&get(a), &get(b), &f));
    }
    for ((d, a), b) in d.1.iter().zip(a.1).zip(b.1) {
        d.set(f(a.get(), b.get()));
    }
}

/// `f` of every element of a matrix, four at a time.
#[inline(always)]
pub(super) fn map_matrix<const W: usize>(
    words: &mut [f32],
    [d, a]: [usize; 2],
    f: impl Fn(f32) -> f32,
) {
    zip_matrix::<W>(words, [d, a, a], |x, _| f(x));
}

#[inline(always)]
fn get(four: &[Cell<f32>; 4]) -> [f32; 4] {
    four.each_ref().map(Cell::get)
}

#[inline(always)]
fn put(four: &[Cell<f32>; 4], value: &[f32; 4]) {
    for (place, value) in four.iter().zip(value) {
        place.set(*value);
    }
}
