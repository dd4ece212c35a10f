//! Element-wise operations and reductions of vectors and matrices, for speed or, with the feature `small-code`, for size.
//!
//! Destinations may be sources too, but never overlap them partly: element k of a result depends on nothing that was
//! overwritten before it, if a group of elements is read whole before any of it is written.

#[cfg(not(feature = "small-code"))]
mod fast;
#[cfg(feature = "small-code")]
mod small;

#[cfg(not(feature = "small-code"))]
pub(super) use fast::{
    map_matrix, map_vector, reduce_matrix, reduce_rows, reduce_vector, scale_matrix, scale_vector,
    zip_matrix, zip_vector,
};
#[cfg(feature = "small-code")]
pub(super) use small::{
    map_matrix, map_vector, reduce_matrix, reduce_rows, reduce_vector, scale_matrix, scale_vector,
    zip_matrix, zip_vector,
};
