//! Vectors and matrices in the state's words.

/// A row of W words, copied to the stack, so that destinations may overlap sources.
#[inline(always)]
pub(super) fn row<const W: usize>(words: &[f32], at: usize) -> [f32; W] {
    words
        .get(at..)
        .and_then(|rest| rest.first_chunk::<W>())
        .map_or([0.0; W], |row| *row)
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
    for (r, row) in value.iter().enumerate() {
        put_row(words, at + r * W, row);
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
    for (r, out) in out.iter_mut().enumerate() {
        *out = f(&row::<W>(words, at + r * W));
    }
    out
}

/// Row by row, `f` of the rows at `a` and `b`, into the matrix at `d`.
#[inline(always)]
pub(super) fn rows2<const W: usize>(
    words: &mut [f32],
    [d, a, b]: [usize; 3],
    f: impl Fn(&[f32; W], &[f32; W]) -> [f32; W],
) {
    for offset in (0..W).map(|r| r * W) {
        let value = f(&row(words, a + offset), &row(words, b + offset));
        put_row(words, d + offset, &value);
    }
}
