//! All operations by one loop, which calls each through a pointer.

/// Element k of `d` becomes `f` of element k · `step` of `a` and element k of `b`.
#[inline(never)]
fn each(words: &mut [f32], [d, a, b]: [usize; 3], step: usize, len: usize, f: fn(f32, f32) -> f32) {
    for k in 0..len {
        let x = words.get(a + k * step).copied().unwrap_or(0.0);
        let y = words.get(b + k).copied().unwrap_or(0.0);
        if let Some(place) = words.get_mut(d + k) {
            *place = f(x, y);
        }
    }
}

/// Element k of `d` becomes `f` of element k of `a`.
#[inline(never)]
fn each_one(words: &mut [f32], [d, a]: [usize; 2], len: usize, f: fn(f32) -> f32) {
    for k in 0..len {
        let x = words.get(a + k).copied().unwrap_or(0.0);
        if let Some(place) = words.get_mut(d + k) {
            *place = f(x);
        }
    }
}

/// Element r of `d` becomes `f` of the row r at `a`.
#[inline(never)]
fn reduce(
    words: &mut [f32],
    [d, a]: [usize; 2],
    [rows, columns]: [usize; 2],
    f: fn(&[f32]) -> f32,
) {
    for r in 0..rows {
        let row = words.get(a + r * columns..);
        let row = row.and_then(|rest| rest.get(..columns));
        let value = f(row.unwrap_or_default());
        if let Some(place) = words.get_mut(d + r) {
            *place = value;
        }
    }
}

/// `f` of a vector.
pub(in crate::exec) fn reduce_vector<const W: usize>(
    words: &mut [f32],
    at: [usize; 2],
    f: fn(&[f32]) -> f32,
) {
    reduce(words, at, [1, W], f);
}

/// `f` of every row of a matrix.
pub(in crate::exec) fn reduce_rows<const W: usize>(
    words: &mut [f32],
    at: [usize; 2],
    f: fn(&[f32]) -> f32,
) {
    reduce(words, at, [W, W], f);
}

/// `f` of all elements of a matrix.
pub(in crate::exec) fn reduce_matrix<const W: usize>(
    words: &mut [f32],
    at: [usize; 2],
    f: fn(&[f32]) -> f32,
) {
    reduce(words, at, [1, W * W], f);
}

/// `f` of every pair of elements of two vectors.
pub(in crate::exec) fn zip_vector<const W: usize>(
    words: &mut [f32],
    at: [usize; 3],
    f: fn(f32, f32) -> f32,
) {
    each(words, at, 1, W, f);
}

/// `f` of every element of a vector.
pub(in crate::exec) fn map_vector<const W: usize>(
    words: &mut [f32],
    at: [usize; 2],
    f: fn(f32) -> f32,
) {
    each_one(words, at, W, f);
}

/// `f` of a scalar and every element of a vector.
pub(in crate::exec) fn scale_vector<const W: usize>(
    words: &mut [f32],
    at: [u16; 3],
    f: fn(f32, f32) -> f32,
) {
    each(words, at.map(usize::from), 0, W, f);
}

/// `f` of every pair of elements of two matrices.
pub(in crate::exec) fn zip_matrix<const W: usize>(
    words: &mut [f32],
    at: [usize; 3],
    f: fn(f32, f32) -> f32,
) {
    each(words, at, 1, W * W, f);
}

/// `f` of every element of a matrix.
pub(in crate::exec) fn map_matrix<const W: usize>(
    words: &mut [f32],
    at: [usize; 2],
    f: fn(f32) -> f32,
) {
    each_one(words, at, W * W, f);
}

/// `f` of a scalar and every element of a matrix.
pub(in crate::exec) fn scale_matrix<const W: usize>(
    words: &mut [f32],
    at: [u16; 3],
    f: fn(f32, f32) -> f32,
) {
    each(words, at.map(usize::from), 0, W * W, f);
}
