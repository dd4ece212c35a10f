//! Each operation with loops of its own, unrolled for the width.

use core::cell::Cell;

use crate::exec::rows::{matrix, put_row, vector};
use crate::exec::scalars::load;
use crate::math::{self, HOST, Word};

/// `f` of every pair of elements of two vectors.
#[inline(always)]
pub(in crate::exec) fn zip_vector<V: Word, const W: usize>(
    words: &mut [V],
    [d, a, b]: [usize; 3],
    running: V::Mask,
    f: impl Fn(f32, f32) -> f32,
) {
    let (x, y) = (vector::<V, W>(words, a), vector::<V, W>(words, b));
    let value = math::zip(x, y, |x, y| x.zip(y, &f));
    put_row(words, d, &value, running);
}

/// `f` of every element of a vector.
#[inline(always)]
pub(in crate::exec) fn map_vector<V: Word, const W: usize>(
    words: &mut [V],
    [d, a]: [usize; 2],
    running: V::Mask,
    f: impl Fn(f32) -> f32,
) {
    let value = math::map(vector::<V, W>(words, a), |x| x.map(&f));
    put_row(words, d, &value, running);
}

/// `f` of a scalar and every element of a vector.
#[inline(always)]
pub(in crate::exec) fn scale_vector<V: Word, const W: usize>(
    words: &mut [V],
    [d, s, x]: [u16; 3],
    running: V::Mask,
    f: impl Fn(f32, f32) -> f32,
) {
    let (s, [d, x]) = (load(words, s), [d, x].map(usize::from));
    let value = math::map(vector::<V, W>(words, x), |x| s.zip(x, &f));
    put_row(words, d, &value, running);
}

/// `f` of every pair of elements of two matrices, on hosts eight at a time.
///
/// With groups of four, the compiler joins groups itself, after an expensive test of whether they overlap.
#[inline(always)]
pub(in crate::exec) fn zip_matrix<V: Word, const W: usize>(
    words: &mut [V],
    at: [usize; 3],
    running: V::Mask,
    f: impl Fn(f32, f32) -> f32,
) {
    each_pair::<V, W>(words, at, running, |x, y| x.zip(y, &f));
}

#[inline(always)]
fn each_pair<V: Word, const W: usize>(
    words: &mut [V],
    [d, a, b]: [usize; 3],
    running: V::Mask,
    f: impl Fn(V, V) -> V,
) {
    let words = Cell::from_mut(words).as_slice_of_cells();
    let part = |at: usize| {
        words
            .get(at..)
            .and_then(|rest| rest.get(..W * W))
            .unwrap_or_default()
    };
    let f = |x: V, y: V, old: V| f(x, y).over(old, running);
    let mut rest = [part(d), part(a), part(b)];
    if V::LANES == 1 {
        if HOST {
            rest = zip_groups::<V, 8>(rest, &f);
        }
        rest = zip_groups::<V, 4>(rest, &f);
    }
    zip_groups::<V, 1>(rest, &f);
}

/// `f` of pairs of cells, `N` at a time, while at least `N` are left. Returns the cells that are left.
#[inline(always)]
fn zip_groups<V: Word, const N: usize>(
    [d, a, b]: [&[Cell<V>]; 3],
    f: impl Fn(V, V, V) -> V,
) -> [&[Cell<V>]; 3] {
    let [d, a, b] = [d, a, b].map(<[_]>::as_chunks::<N>);
    for ((d, a), b) in d.0.iter().zip(a.0).zip(b.0) {
        let (a, b) = (a.each_ref().map(Cell::get), b.each_ref().map(Cell::get));
        let mut value = d.each_ref().map(Cell::get);
        for ((value, a), b) in value.iter_mut().zip(a).zip(b) {
            *value = f(a, b, *value);
        }
        for (place, value) in d.iter().zip(value) {
            place.set(value);
        }
    }
    [d.1, a.1, b.1]
}

/// `f` of every element of a matrix.
#[inline(always)]
pub(in crate::exec) fn map_matrix<V: Word, const W: usize>(
    words: &mut [V],
    [d, a]: [usize; 2],
    running: V::Mask,
    f: impl Fn(f32) -> f32,
) {
    each_pair::<V, W>(words, [d, a, a], running, |x, _| x.map(&f));
}

/// `f` of a vector.
#[inline(always)]
pub(in crate::exec) fn reduce_vector<V: Word, const W: usize>(
    words: &mut [V],
    [d, a]: [usize; 2],
    running: V::Mask,
    f: impl Fn(&[V]) -> V,
) {
    put_row(words, d, &[f(vector::<V, W>(words, a))], running);
}

/// `f` of every row of a matrix.
#[inline(always)]
pub(in crate::exec) fn reduce_rows<V: Word, const W: usize>(
    words: &mut [V],
    [d, a]: [usize; 2],
    running: V::Mask,
    f: impl Fn(&[V]) -> V,
) {
    if let Some(rows) = matrix::<V, W>(words, a) {
        put_row(words, d, &rows.each_ref().map(|row| f(row)), running);
    }
}

/// `f` of all elements of a matrix.
#[inline(always)]
pub(in crate::exec) fn reduce_matrix<V: Word, const W: usize>(
    words: &mut [V],
    [d, a]: [usize; 2],
    running: V::Mask,
    f: impl Fn(&[V]) -> V,
) {
    if let Some(rows) = matrix::<V, W>(words, a) {
        put_row(words, d, &[f(rows.as_flattened())], running);
    }
}

/// `f` of a scalar and every element of a matrix.
#[inline(always)]
pub(in crate::exec) fn scale_matrix<V: Word, const W: usize>(
    words: &mut [V],
    [d, s, x]: [u16; 3],
    running: V::Mask,
    f: impl Fn(f32, f32) -> f32,
) {
    let (s, [d, x]) = (load(words, s), [d, x].map(usize::from));
    each_pair::<V, W>(words, [d, x, x], running, |x, _| s.zip(x, &f));
}
