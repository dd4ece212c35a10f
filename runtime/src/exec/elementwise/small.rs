//! All operations by one loop, which calls each through a pointer.

use crate::math::Word;

/// Element k of `d` becomes `f` of element k · `step` of `a` and element k of `b`.
#[inline(never)]
fn each<V: Word>(
    words: &mut [V],
    [d, a, b]: [usize; 3],
    step: usize,
    len: usize,
    running: V::Mask,
    f: fn(f32, f32) -> f32,
) {
    for k in 0..len {
        let x = words.get(a + k * step).copied().unwrap_or(V::ZERO);
        let y = words.get(b + k).copied().unwrap_or(V::ZERO);
        if let Some(place) = words.get_mut(d + k) {
            *place = x.zip(y, f).over(*place, running);
        }
    }
}

/// Element k of `d` becomes `f` of element k of `a`.
#[inline(never)]
fn each_one<V: Word>(
    words: &mut [V],
    [d, a]: [usize; 2],
    len: usize,
    running: V::Mask,
    f: fn(f32) -> f32,
) {
    for k in 0..len {
        let x = words.get(a + k).copied().unwrap_or(V::ZERO);
        if let Some(place) = words.get_mut(d + k) {
            *place = x.map(f).over(*place, running);
        }
    }
}

/// Element r of `d` becomes `f` of the row r at `a`.
#[inline(never)]
fn reduce<V: Word>(
    words: &mut [V],
    [d, a]: [usize; 2],
    [rows, columns]: [usize; 2],
    running: V::Mask,
    f: fn(&[V]) -> V,
) {
    for r in 0..rows {
        let row = words.get(a + r * columns..);
        let row = row.and_then(|rest| rest.get(..columns));
        let value = f(row.unwrap_or_default());
        if let Some(place) = words.get_mut(d + r) {
            *place = value.over(*place, running);
        }
    }
}

/// `f` of a vector.
pub(in crate::exec) fn reduce_vector<V: Word, const W: usize>(
    words: &mut [V],
    at: [usize; 2],
    running: V::Mask,
    f: fn(&[V]) -> V,
) {
    reduce(words, at, [1, W], running, f);
}

/// `f` of every row of a matrix.
pub(in crate::exec) fn reduce_rows<V: Word, const W: usize>(
    words: &mut [V],
    at: [usize; 2],
    running: V::Mask,
    f: fn(&[V]) -> V,
) {
    reduce(words, at, [W, W], running, f);
}

/// `f` of all elements of a matrix.
pub(in crate::exec) fn reduce_matrix<V: Word, const W: usize>(
    words: &mut [V],
    at: [usize; 2],
    running: V::Mask,
    f: fn(&[V]) -> V,
) {
    reduce(words, at, [1, W * W], running, f);
}

/// `f` of every pair of elements of two vectors.
pub(in crate::exec) fn zip_vector<V: Word, const W: usize>(
    words: &mut [V],
    at: [usize; 3],
    running: V::Mask,
    f: fn(f32, f32) -> f32,
) {
    each(words, at, 1, W, running, f);
}

/// `f` of every element of a vector.
pub(in crate::exec) fn map_vector<V: Word, const W: usize>(
    words: &mut [V],
    at: [usize; 2],
    running: V::Mask,
    f: fn(f32) -> f32,
) {
    each_one(words, at, W, running, f);
}

/// `f` of a scalar and every element of a vector.
pub(in crate::exec) fn scale_vector<V: Word, const W: usize>(
    words: &mut [V],
    at: [u16; 3],
    running: V::Mask,
    f: fn(f32, f32) -> f32,
) {
    each(words, at.map(usize::from), 0, W, running, f);
}

/// `f` of every pair of elements of two matrices.
pub(in crate::exec) fn zip_matrix<V: Word, const W: usize>(
    words: &mut [V],
    at: [usize; 3],
    running: V::Mask,
    f: fn(f32, f32) -> f32,
) {
    each(words, at, 1, W * W, running, f);
}

/// `f` of every element of a matrix.
pub(in crate::exec) fn map_matrix<V: Word, const W: usize>(
    words: &mut [V],
    at: [usize; 2],
    running: V::Mask,
    f: fn(f32) -> f32,
) {
    each_one(words, at, W * W, running, f);
}

/// `f` of a scalar and every element of a matrix.
pub(in crate::exec) fn scale_matrix<V: Word, const W: usize>(
    words: &mut [V],
    at: [u16; 3],
    running: V::Mask,
    f: fn(f32, f32) -> f32,
) {
    each(words, at.map(usize::from), 0, W * W, running, f);
}
