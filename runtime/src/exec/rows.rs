//! Vectors and matrices in the state's words.

use crate::math::{self, Word};

/// A vector in place; zeros if it reaches past the state.
#[inline(always)]
pub(super) fn vector<V: Word, const W: usize>(words: &[V], at: usize) -> &[V; W] {
    words
        .get(at..)
        .and_then(|rest| rest.first_chunk::<W>())
        .unwrap_or_else(V::zeros)
}

/// Stores a vector in the lanes that run.
#[inline(always)]
pub(super) fn put_row<V: Word, const W: usize>(
    words: &mut [V],
    at: usize,
    value: &[V; W],
    running: V::Mask,
) {
    if let Some(place) = words
        .get_mut(at..)
        .and_then(|rest| rest.first_chunk_mut::<W>())
    {
        *place = over(value, place, running);
    }
}

/// A W×W matrix in place.
#[inline(always)]
pub(super) fn matrix<V: Word, const W: usize>(words: &[V], at: usize) -> Option<&[[V; W]; W]> {
    let (rows, _) = words.get(at..)?.as_chunks::<W>();
    rows.first_chunk::<W>()
}

/// Stores a matrix in the lanes that run.
#[inline(always)]
pub(super) fn put_matrix<V: Word, const W: usize>(
    words: &mut [V],
    at: usize,
    value: &[[V; W]; W],
    running: V::Mask,
) {
    let place = words.get_mut(at..).map(|rest| rest.as_chunks_mut::<W>().0);
    if let Some(place) = place.and_then(|rows| rows.first_chunk_mut::<W>()) {
        for (place, value) in place.iter_mut().zip(value) {
            *place = over(value, place, running);
        }
    }
}

#[inline(always)]
fn over<V: Word, const W: usize>(value: &[V; W], old: &[V; W], running: V::Mask) -> [V; W] {
    math::zip(value, old, |value, old| value.over(old, running))
}
