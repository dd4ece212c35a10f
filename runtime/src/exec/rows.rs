//! Vectors and matrices in the state's words.

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

#[inline(always)]
pub(super) fn put_matrix<const W: usize>(words: &mut [f32], at: usize, value: &[[f32; W]; W]) {
    let place = words.get_mut(at..).map(|rest| rest.as_chunks_mut::<W>().0);
    if let Some(place) = place.and_then(|rows| rows.first_chunk_mut::<W>()) {
        *place = *value;
    }
}
